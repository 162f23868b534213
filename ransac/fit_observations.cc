#include "circline/ransac/fit_observations.h"

#include <algorithm>
#include <cmath>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/line.h"
#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/line_model.h"
#include "circline/ransac/pencil_model.h"
#include "circline/ransac/robust_conic.h"

namespace circline {
namespace {

// 99.8 % of a Gaussian's points.
constexpr double kInlierSigmas = 3.03;

class Fitter {
 public:
  Fitter(const FitOptions& options, Observations* observations, std::vector<std::string>* problems)
      : options_(options), observations_(*observations), problems_(problems) {}

  void FitAll() {
    observations_.num_dropped_points = 0;
    for (CircleObservation& circle : observations_.circles) FitCircle(&circle);
    for (PencilObservation& pencil : observations_.pencils) FitPencil(&pencil);
  }

 private:
  void Report(const std::string& what, const std::string& problem) {
    if (problems_ != nullptr) problems_->push_back(what + ": " + problem);
  }

  // A feature that states its noise is held to it; the next feature gets a seed of its own.
  RobustFitOptions FeatureOptions(double feature_sigma_px) {
    RobustFitOptions result;
    result.sigma_px = feature_sigma_px > 0.0 ? feature_sigma_px : options_.sigma_px;
    result.ransac.threshold = feature_sigma_px > 0.0 ? std::min(options_.inlier_threshold_px,
                                                                kInlierSigmas * feature_sigma_px)
                                                     : options_.inlier_threshold_px;
    result.ransac.confidence = options_.confidence;
    result.ransac.max_iterations = options_.max_iterations;
    result.ransac.seed = Random(options_.seed + num_fits_++).Next();
    return result;
  }

  void Calibrate(const std::vector<Eigen::Vector2d>& pixels) {
    observations_.num_dropped_points +=
        PixelsToCalibrated(observations_.camera, pixels, &points_, &indices_);
  }

  // The mask of points_ as one of all pixels: what the camera cannot undistort is an outlier.
  std::vector<std::uint8_t> PixelMask(std::size_t num_pixels) const {
    std::vector<std::uint8_t> result(num_pixels, 0);
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      result[static_cast<std::size_t>(indices_[i])] = mask_[i];
    }
    return result;
  }

  void FitCircle(CircleObservation* circle) {
    circle->fit.reset();
    circle->inliers.clear();
    Calibrate(circle->points);
    EdgeDirections directions;
    directions.sigma_rad = options_.direction_sigma_rad;
    if (!circle->normals.empty()) {
      for (const int i : indices_) {
        directions.normals.push_back(circle->normals[static_cast<std::size_t>(i)]);
      }
    }
    ConicFit fit;
    const Status status =
        FitConicRobust(points_, FeatureOptions(circle->sigma_px), &fit, &mask_, ConicLimits(),
                       circle->normals.empty() ? nullptr : &directions);
    if (!status.ok()) return Report("circle '" + circle->id + "'", status.message);
    circle->fit = fit;
    circle->inliers = PixelMask(circle->points.size());
  }

  void FitPencil(PencilObservation* pencil) {
    pencil->fit.reset();
    std::vector<LineFit> fits;
    std::vector<std::size_t> positions;
    for (std::size_t i = 0; i < pencil->lines.size(); ++i) {
      LineObservation& line = pencil->lines[i];
      line.fit.reset();
      line.inliers.clear();
      Calibrate(line.points);
      LineFit fit;
      const Status status =
          FitLineRobust(points_, FeatureOptions(LineSigma(*pencil, line)), &fit, &mask_);
      if (!status.ok()) {
        Report(LineName(*pencil, i), status.message);
        continue;
      }
      line.fit = fit;
      line.inliers = PixelMask(line.points.size());
      fits.push_back(fit);
      positions.push_back(i);
    }
    FitDirection(fits, positions, pencil);
  }

  void FitDirection(const std::vector<LineFit>& fits, const std::vector<std::size_t>& positions,
                    PencilObservation* pencil) {
    // A single line along an axis is evidence of its own.
    if (pencil->direction != PencilDirection::kFree && fits.size() == 1) return;
    PencilOptions pencil_options;
    pencil_options.ransac = FeatureOptions(pencil->sigma_px).ransac;
    pencil_options.ransac.threshold = kInlierSigmas;
    VanishingPointFit fit;
    const Status status = FitVanishingPointRobust(fits, pencil_options, &fit, &mask_);
    if (!status.ok()) return Report("pencil '" + pencil->id + "'", status.message);
    pencil->fit = fit;
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      if (mask_[i] != 0) continue;
      Report(LineName(*pencil, positions[i]), "it is not parallel to the others of its pencil");
    }
  }

  static std::string LineName(const PencilObservation& pencil, std::size_t i) {
    return "pencil '" + pencil.id + "', line " + std::to_string(i);
  }

  const FitOptions& options_;
  Observations& observations_;
  std::vector<std::string>* problems_;
  std::uint64_t num_fits_ = 0;
  std::vector<CalibratedPoint> points_;
  std::vector<int> indices_;
  std::vector<std::uint8_t> mask_;
};

}  // namespace

Status FitOptions::Validate() const {
  if (!(inlier_threshold_px > 0.0) || !std::isfinite(inlier_threshold_px)) {
    return Status::Invalid("inlier_threshold_px must be positive");
  }
  if (!(confidence > 0.0 && confidence < 1.0)) {
    return Status::Invalid("confidence must be between 0 and 1, both excluded");
  }
  if (max_iterations < 1) return Status::Invalid("max_iterations must be 1 or more");
  if (!(sigma_px > 0.0) || !std::isfinite(sigma_px)) {
    return Status::Invalid("sigma_px must be positive");
  }
  if (!(direction_sigma_rad > 0.0 && direction_sigma_rad <= 0.5)) {
    return Status::Invalid("direction_sigma_rad must be positive and 0.5 at most");
  }
  return Status::Ok();
}

Status FitObservations(const FitOptions& options, Observations* observations,
                       std::vector<std::string>* problems) {
  Status status = options.Validate();
  if (status.ok()) status = observations->Validate();
  if (!status.ok()) return status;
  Fitter(options, observations, problems).FitAll();
  return Status::Ok();
}

}  // namespace circline
