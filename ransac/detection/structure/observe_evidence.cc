#include "circline/ransac/detection/structure/observe_evidence.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "circline/ransac/detection/structure/detect_pencils.h"

namespace circline {
namespace {

// Directions looked for beyond those wanted, so that the choice is made by the length of their
// lines and by the circles rather than by the number of lines.
constexpr int kExtraPencils = 3;

// What structure tells of a focal length that is a guess; of its logarithm. Right angles that it is
// told by are not judged again more strictly.
constexpr double kFoundFocalSigma = 0.1;

std::string Describe(const Observations& observations) {
  const std::size_t circles = observations.circles.size(), pencils = observations.pencils.size();
  if (circles == 0 && pencils == 0) {
    return "nothing found: no ellipse, no parallel lines, no rectangle";
  }
  if (circles == 0 && pencils == 1) {
    return "one pencil of parallel lines only, and no circle: that is a direction, not a pose";
  }
  if (circles == 0 && observations.frame.plane.empty()) {
    return "the pencils found span no plane, and there is no circle: that is no pose";
  }
  if (circles == 1 && pencils == 0) {
    return "one circle and nothing else: two poses explain it equally well";
  }
  return std::string();
}

}  // namespace

double DiagonalPx(int width, int height) {
  return std::max(kUsualDiagonalPx, std::hypot(width, height));
}

void ObserveEvidence(const DetectionOptions& options, double diagonal_px, PhotoEvidence* evidence,
                     Observations* observations) {
  std::vector<DetectedPencil> pencils;
  if (options.max_pencils > 0) {
    pencils = DetectPencils(evidence->lines, options.max_pencils + kExtraPencils, options.seed,
                            diagonal_px);
  }
  AssemblyOptions assembly;
  assembly.max_pencils = options.max_pencils;
  assembly.max_shared_plane_deg = options.max_shared_plane_deg;
  assembly.diagonal_px = diagonal_px;
  if (options.noise_model.camera.IsWide()) {
    assembly.camera.middle_rad =
        options.noise_model.camera.principal_point_px / observations->camera.fx;
    assembly.camera.log_focal = kFoundFocalSigma;
    assembly.prior_log_focal = StatedLogFocal(*observations);
    assembly.focal_sigma = options.noise_model.camera.LargestLogFocal();
  }
  AssembleObservations(assembly, evidence->lines, evidence->bent, &evidence->circles, &pencils,
                       observations);
  observations->message = Describe(*observations);
  const auto most = static_cast<std::size_t>(options.max_circles);
  if (evidence->num_ellipses > most && most > 0) {
    if (!observations->message.empty()) observations->message += "; ";
    observations->message += std::to_string(evidence->num_ellipses) + " ellipses found, the best " +
                             std::to_string(most) + " kept (max_circles)";
  }
}

Status LineFromSegment(const Camera& camera, const Segment& segment, double sigma_px,
                       DetectedLine* line) {
  line->ends = segment;
  line->points = {segment[0], segment[1]};
  line->length_px = (segment[1] - segment[0]).norm();
  line->sigma_px = sigma_px;
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(camera, line->points, &points);
  return FitLine(points, sigma_px, &line->fit);
}

}  // namespace circline
