#include "apps/compare/overlay.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "apps/common/output_file.h"
#include "apps/common/text.h"
#include "apps/compare/canvas.h"
#include "apps/compare/encode.h"
#include "apps/compare/pixel_ellipse.h"
#include "apps/compare/pose_curves.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

const cv::Scalar kWhite(255, 255, 255), kEllipse(0, 215, 255), kUnusedEllipse(90, 150, 170),
    kOutlier(60, 60, 255);
const cv::Scalar kHorizon(255, 230, 120), kGrid(255, 255, 255), kGridRim(90, 60, 30);
const std::array<cv::Scalar, 3> kAxes = {cv::Scalar(70, 70, 255), cv::Scalar(80, 220, 60),
                                         cv::Scalar(255, 140, 50)};  // X red, Y green, Z blue.
const std::array<cv::Scalar, 4> kFreePencils = {cv::Scalar(220, 80, 230), cv::Scalar(40, 160, 255),
                                                cv::Scalar(230, 220, 60),
                                                cv::Scalar(120, 255, 200)};

// So many straight pieces make an ellipse of this longer semi-axis: they miss it by 0.1 px.
int PiecesOfEllipse(double semi_axis_px) {
  return static_cast<int>(std::clamp(7.0 * std::sqrt(semi_axis_px), 16.0, 400.0));
}

// And an image of a straight line, which lenses bend by a fortieth of its length at most: by 0.1
// px.
int PiecesOfLine(double length_px) {
  return static_cast<int>(std::clamp(0.5 * std::sqrt(length_px), 1.0, 50.0));
}

// ---- Evidence ----

void DrawContourPoints(const CircleObservation& circle, Canvas* canvas) {
  for (std::size_t i = 0; i < circle.points.size(); ++i) {
    const bool inlier = circle.inliers.empty() || circle.inliers[i] != 0;
    canvas->Dot(circle.points[i], inlier ? 1.6 : 2.2, inlier ? kWhite : kOutlier);
  }
}

void DrawEllipse(const Camera& camera, const CircleObservation& circle, bool used, Canvas* canvas) {
  Ellipse ellipse;
  if (!circle.fit || !ConicToEllipse(circle.fit->conic, &ellipse)) return;
  const int pieces = PiecesOfEllipse(ellipse.a * camera.fx);
  const auto pixels = ProjectCurve(camera, pieces, 0.0, 2.0 * kPi, [&ellipse](double t) {
    return EllipsePoint(ellipse, t).homogeneous().eval();
  });
  canvas->Polyline(pixels, used ? kEllipse : kUnusedEllipse, used ? 2 : 1);
}

cv::Scalar PencilColor(const PencilObservation& pencil, std::size_t index) {
  return pencil.direction == PencilDirection::kFree
             ? kFreePencils[index % kFreePencils.size()]
             : kAxes[static_cast<std::size_t>(pencil.direction)];
}

// A straight line of the scene between two pixels is a curve of the photo: drawn by its plane.
void DrawSegment(const Camera& camera, const Segment& segment, const cv::Scalar& color,
                 Canvas* canvas) {
  CalibratedPoint a, b;
  if (!PixelToCalibrated(camera, segment[0], &a) || !PixelToCalibrated(camera, segment[1], &b))
    return;
  const Eigen::Vector3d from = a.Homogeneous(), to = b.Homogeneous();
  const int pieces = PiecesOfLine((segment[1] - segment[0]).norm());
  canvas->Polyline(ProjectCurve(camera, pieces, 0.0, 1.0,
                                [&](double t) { return ((1.0 - t) * from + t * to).eval(); }),
                   color, 2);
}

void DrawPencils(const Observations& observations, Canvas* canvas) {
  std::size_t num_free = 0;
  for (const PencilObservation& pencil : observations.pencils) {
    const cv::Scalar color = PencilColor(pencil, num_free);
    if (pencil.direction == PencilDirection::kFree) ++num_free;
    for (const LineObservation& line : pencil.lines) {
      const Segment ends = EndPoints(line);
      DrawSegment(observations.camera, ends, color, canvas);
      canvas->Dot(ends[0], 3.0, color);
      canvas->Dot(ends[1], 3.0, color);
    }
  }
}

// ---- The pose ----

void DrawGrid(const PoseCurves& curves, const cv::Scalar& color, int thickness, Canvas* canvas) {
  for (const PixelCurve& line : curves.grid) canvas->Polyline(line, color, thickness);
}

void DrawVanishingLine(const PixelCurve& pixels, Canvas* canvas) {
  canvas->Dashes(pixels, kHorizon, 2);
  for (const Eigen::Vector2d& pixel : pixels) {
    if (!canvas->IsInside(pixel, 24.0)) continue;
    canvas->Label(pixel + Eigen::Vector2d(0.0, canvas->Scaled(-8.0)), "vanishing line", kHorizon,
                  0.5);
    return;
  }
}

void DrawAxes(const PoseCurves& curves, const PoseHypothesis& hypothesis, Canvas* canvas) {
  if (curves.axes[0].empty()) return;
  const Eigen::Matrix3d& rotation = hypothesis.cam_from_world.rotation;
  const bool rotation_is_free = hypothesis.RotationIsFree();
  // The farthest first, so that nearer ones lie on top.
  std::array<int, 3> order = {0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return rotation(2, a) > rotation(2, b); });
  static constexpr std::array<const char*, 3> kNames = {"X", "Y", "Z"};
  for (const int axis : order) {
    if (rotation_is_free && axis != 2) continue;  // A convention, nothing that was seen.
    const auto index = static_cast<std::size_t>(axis);
    const PixelCurve& pixels = curves.axes[index];
    canvas->Arrow(pixels, kAxes[index], 3);
    if (!pixels.back().allFinite()) continue;
    const Eigen::Vector2d ahead =
        (pixels.back() - curves.origin).stableNormalized() * canvas->Scaled(15.0);
    canvas->Label(pixels.back() + ahead, rotation_is_free ? "normal" : kNames[index], kAxes[index],
                  0.75, true);
  }
  canvas->Dot(curves.origin, 4.5, kWhite);
}

void DrawCenters(const PoseEstimate& estimate, Canvas* canvas) {
  for (std::size_t i = estimate.hypotheses.size(); i-- > 0;) {
    for (const CircleEstimate& circle : estimate.hypotheses[i].circles) {
      if (!circle.center_px.allFinite() || circle.center_px.isZero()) continue;
      if (i == 0) {
        canvas->Cross(circle.center_px, 7.0, kEllipse);
      } else if (i == 1) {
        canvas->Ring(circle.center_px, 5.0, kEllipse);
      }
    }
  }
}

void DrawPose(const Observations& observations, const PoseEstimate& estimate, Canvas* canvas) {
  const PoseHypothesis& best = estimate.hypotheses.front();
  const PoseCurves curves = CurvesOfPose(observations, best, canvas->width(), canvas->height());
  if (!curves.grid.empty()) {
    canvas->Blend(0.35, [&] { DrawGrid(curves, kGridRim, 3, canvas); });
    canvas->Blend(0.7, [&] { DrawGrid(curves, kGrid, 1, canvas); });
  }
  DrawVanishingLine(curves.vanishing_line, canvas);
  DrawCenters(estimate, canvas);
  DrawAxes(curves, best, canvas);
}

// ---- The caption ----

std::string SigmaText(const PoseHypothesis& hypothesis) {
  const Eigen::Vector3d sigma = hypothesis.SigmaRotation() / kDegree;
  if (!sigma.allFinite()) {
    const std::optional<double> normal = SigmaNormalDeg(hypothesis);
    return normal ? "sigma of the normal " + FormatShort(*normal, 2) + " deg"
                  : "a rotation is free";
  }
  return "sigma " + FormatShort(sigma.norm(), 2) + " deg";
}

// What a picture has room for: what was found, or the first reason of `joint`, else of the last
// solver.
std::string WhyNoPose(const ImageRun& run) {
  if (!run.observations.message.empty() || run.solvers.empty()) return run.observations.message;
  auto told = std::find_if(run.solvers.begin(), run.solvers.end(),
                           [](const SolverRun& solver) { return solver.solver == "joint"; });
  if (told == run.solvers.end()) --told;
  const std::string& reasons = told->estimate.status.message;
  return reasons.substr(0, reasons.find("; "));
}

cv::Mat WithCaption(const ImageRun& run, const SolverRun* shown, const Canvas& canvas) {
  if (shown == nullptr) return canvas.WithCaption("no pose", {WhyNoPose(run)});
  const PoseHypothesis& best = shown->estimate.hypotheses.front();
  std::string title =
      shown->solver + (shown->stage == SolverStage::kRefined ? ", refined" : ", closed form");
  const auto error = shown->errors.front().Headline();
  if (error) title += "    error " + FormatShort(*error, 2) + " deg";
  const std::size_t count = shown->estimate.hypotheses.size();
  return canvas.WithCaption(
      title, {best.num_inliers > 0 ? "rms " + FormatShort(best.rms_px, 2) + " px" : "predicted",
              SigmaText(best),
              "probability " + FormatFixed(best.probability, 2) + " (" + std::to_string(count) +
                  (count == 1 ? " hypothesis)" : " hypotheses)")});
}

// Whether the shown pose rests on this circle; where there is no pose, all are drawn alike.
bool IsUsed(const CircleObservation& circle, const SolverRun* shown) {
  if (shown == nullptr) return true;
  const std::vector<CircleEstimate>& used = shown->estimate.hypotheses.front().circles;
  return std::any_of(used.begin(), used.end(),
                     [&](const CircleEstimate& estimate) { return estimate.id == circle.id; });
}

}  // namespace

cv::Mat DrawOverlay(const ImageRun& run) {
  Canvas canvas(run.photo);
  const Observations& observations = run.observations;
  canvas.Blend(0.55, [&] {
    for (const CircleObservation& circle : observations.circles) DrawContourPoints(circle, &canvas);
  });
  const SolverRun* shown = AnswerToShow(run.solvers);
  for (const CircleObservation& circle : observations.circles) {
    DrawEllipse(observations.camera, circle, IsUsed(circle, shown), &canvas);
  }
  DrawPencils(observations, &canvas);
  if (shown != nullptr) DrawPose(observations, shown->estimate, &canvas);
  return WithCaption(run, shown, canvas);
}

Status WriteOverlay(const std::string& folder, ImageRun* run, std::string* file, cv::Mat* picture) {
  if (!run->read_error.empty() || run->photo.empty()) return Status::Ok();
  *file = "overlays/" + run->image->stem + ".png";
  const std::string path = folder + "/" + *file;
  const Stopwatch watch;
  try {
    const cv::Mat drawn = DrawOverlay(*run);
    const Status status = WriteFile(path, EncodePng(drawn));
    run->stages.emplace_back("overlay", watch.Microseconds());
    if (picture != nullptr) *picture = drawn;
    return status;
  } catch (const std::exception& error) {  // Such as a picture too large for the memory.
    return Status::Failed(path + " cannot be drawn: " + error.what());
  }
}

}  // namespace circline::apps
