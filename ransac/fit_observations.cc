#include "circline/ransac/fit_observations.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/exactness.h"
#include "circline/estimators/line.h"
#include "circline/estimators/point_noise.h"
#include "circline/ransac/camera_of_fits.h"
#include "circline/ransac/conic_search.h"
#include "circline/ransac/dense_clusters.h"
#include "circline/ransac/fit_directions.h"
#include "circline/ransac/line_model.h"
#include "circline/ransac/robust_conic.h"
#include "circline/ransac/stated_noise.h"

namespace circline {
namespace {

class PointFitter {
 public:
  explicit PointFitter(FitRun* run) : run_(*run) {}

  // Circles and lines, with the noise of their points; no more is needed to compare cameras.
  void FitPoints() {
    run_.observations.num_dropped_points = 0;
    for (CircleObservation& circle : run_.observations.circles) {
      circles_.push_back(Prepare(circle.points, circle.sigma_px));
      circle.fit.reset();
      circle.inliers.clear();
      circle.second.reset();
      circles_.back().status = FitCircle(circles_.back(), nullptr, &circle);
      if (LeaveClustersOut(circle.points, circle.inliers, &circles_.back()))
        circles_.back().status = FitCircle(circles_.back(), nullptr, &circle);
    }
    for (PencilObservation& pencil : run_.observations.pencils) {
      pencil.fit.reset();
      pencil.readings.clear();
      std::vector<FittedFeature>& features = lines_.emplace_back();
      for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
        LineObservation& line = pencil.lines[i];
        features.push_back(Prepare(line.points, LineSigma(pencil, line)));
        line.fit.reset();
        line.inliers.clear();
        line.is_parallel = true;
        features.back().status = FitLine(features.back(), &line);
        if (LeaveClustersOut(line.points, line.inliers, &features.back()))
          features.back().status = FitLine(features.back(), &line);
      }
    }
    for (int round = 0; round < FitRun::kMaxRounds && FollowNoise(); ++round) continue;
  }

  void FitAll() {
    FitPoints();
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      JudgeCircle(&circles_[i], &run_.observations.circles[i]);
      DoubtStatedNoise(run_.observations.circles[i], &circles_[i]);
    }
    ReportFailures();
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      CircleObservation& circle = run_.observations.circles[i];
      if (!circle.fit) continue;
      FitSecond(circles_[i], &circle);
      ShareNoise(circles_[i], circle.points, circle.inliers, &*circle.fit);
    }
    for (const PencilObservation& pencil : run_.observations.pencils) {
      const std::string problem =
          StatedNoiseProblem(run_.options, run_.observations.camera, pencil);
      if (!problem.empty()) run_.Report("pencil '" + pencil.id + "'", problem);
    }
    FitDirections(&lines_, &run_);
  }

 private:
  FittedFeature Prepare(const std::vector<Eigen::Vector2d>& pixels, double stated_px) {
    FittedFeature f;
    run_.observations.num_dropped_points +=
        PixelsToCalibrated(run_.observations.camera, pixels, &f.points, &f.indices);
    f.is_stated = stated_px > 0.0;
    f.sigma_px = f.is_stated ? stated_px : run_.options.sigma_px;
    return f;
  }

  double Gate(const FittedFeature& f) const {
    const double gate = kInlierSigmas * f.sigma_px, cap = run_.options.inlier_threshold_px;
    return cap > 0.0 ? std::min(cap, gate) : gate;
  }

  RobustFitOptions NextOptions(const FittedFeature& f) {
    RobustFitOptions result;
    run_.SetNext(Gate(f), &result.ransac);
    return result;
  }

  // mask_ as one of all pixels: what the camera cannot undistort is an outlier.
  std::vector<std::uint8_t> PixelMask(const FittedFeature& f, std::size_t num_pixels) const {
    std::vector<std::uint8_t> result(num_pixels, 0);
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      result[static_cast<std::size_t>(f.indices[i])] = mask_[i];
    }
    return result;
  }

  static bool HasManyOutliers(const std::vector<std::uint8_t>& inliers) {
    constexpr double kMany = 0.15;  // Of all points.
    return static_cast<double>(std::count(inliers.begin(), inliers.end(), 0)) >
           kMany * static_cast<double>(inliers.size());
  }

  // Where a fit has found many outliers, it may itself have followed some, or have found nothing:
  // leaves dense clusters out. False where there are none.
  bool LeaveClustersOut(const std::vector<Eigen::Vector2d>& pixels,
                        const std::vector<std::uint8_t>& inliers, FittedFeature* f) const {
    if (!inliers.empty() && !HasManyOutliers(inliers)) return false;
    const auto pixel = [&](int i) -> const Eigen::Vector2d& {
      return pixels[static_cast<std::size_t>(f->indices[static_cast<std::size_t>(i)])];
    };
    const double radius = kClusterThresholds * Gate(*f);
    constexpr int kMost = 4000;  // Points, evenly taken, that stand for all.
    const int n = static_cast<int>(f->points.size()), step = n / kMost + 1;
    const std::vector<int> spread = OutsideClusters(n, (n - 1) / step + 1, [&](int i, int j) {
      return (pixel(i) - pixel(j * step)).squaredNorm() < radius * radius;
    });
    if (spread.size() == f->points.size()) return false;
    FittedFeature rest = *f;
    rest.points.clear();
    rest.indices.clear();
    for (const int i : spread) {
      rest.points.push_back(f->points[static_cast<std::size_t>(i)]);
      rest.indices.push_back(f->indices[static_cast<std::size_t>(i)]);
    }
    *f = std::move(rest);
    return true;
  }

  // Those of the points; none where the contour has none.
  EdgeDirections Directions(const FittedFeature& f, const CircleObservation& circle) const {
    EdgeDirections directions;
    directions.sigma_rad = run_.options.direction_sigma_rad;
    if (circle.normals.empty()) return directions;
    for (const int i : f.indices)
      directions.normals.push_back(circle.normals[static_cast<std::size_t>(i)]);
    return directions;
  }

  // From `initial`, or by a search.
  Status FitCircle(const FittedFeature& f, const Eigen::Matrix3d* initial,
                   CircleObservation* circle) {
    ConicFit fit;
    const Status status =
        FindConic(f.points, NextOptions(f), initial, &fit, &mask_, Directions(f, *circle));
    if (!status.ok()) return status;
    circle->fit = fit;
    circle->inliers = PixelMask(f, circle->points.size());
    return status;
  }

  void FitSecond(const FittedFeature& f, CircleObservation* circle) {
    ConicReading second;
    const Status status = FitSecondConic(f.points, NextOptions(f), circle->fit->conic, &second.fit,
                                         &mask_, Directions(f, *circle));
    if (!status.ok()) return;
    second.inliers = PixelMask(f, circle->points.size());
    const auto share = 100 * std::count(mask_.begin(), mask_.end(), 1) /
                       static_cast<std::ptrdiff_t>(circle->points.size());
    run_.Report("circle '" + circle->id + "'",
                "a second ellipse passes through " + std::to_string(share) + " % of its points");
    ShareNoise(f, circle->points, second.inliers, &second.fit);
    circle->second = std::move(second);
  }

  Status FitLine(const FittedFeature& f, LineObservation* line) {
    LineFit fit;
    const Status status = FitLineRobust(f.points, NextOptions(f), &fit, &mask_);
    if (!status.ok()) return status;
    line->fit = fit;
    line->inliers = PixelMask(f, line->points.size());
    return status;
  }

  // Fits again what has another noise than its gate was made for; false if there is nothing. Where
  // the gate was too narrow for many points, the ellipse may be one through a few of them, or there
  // is none: a wider gate takes a new search.
  bool FollowNoise() {
    const PointNoise noise = MeasurePointNoise(run_.observations, run_.options.noise_model);
    bool moved = false;
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      CircleObservation& circle = run_.observations.circles[i];
      const double before = circles_[i].sigma_px;
      if (!circles_[i].FollowNoise(noise.circles[i])) continue;
      const bool is_wider = circles_[i].sigma_px > before;
      const bool search = is_wider && (!circle.fit || HasManyOutliers(circle.inliers));
      if (!search && !circle.fit) continue;
      moved |= FitCircle(circles_[i], search ? nullptr : &circle.fit->conic, &circle).ok();
    }
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      for (std::size_t i = 0; i < lines_[k].size(); ++i) {
        LineObservation& line = run_.observations.pencils[k].lines[i];
        if (!lines_[k][i].FollowNoise(noise.lines[k][i]) || !line.fit) continue;
        moved |= FitLine(lines_[k][i], &line).ok();
      }
    }
    return moved;
  }

  // Takes back what chance explains, now that the noise is known.
  void JudgeCircle(FittedFeature* f, CircleObservation* circle) {
    if (!circle->fit) return;
    const RobustFitOptions options = NextOptions(*f);
    const EdgeDirections directions = Directions(*f, *circle);
    const ConicSupport support =
        ConicSearch(f->points, directions, options).Support(circle->fit->conic);
    if (!support.MayBeChance()) return;
    if (!support.IsRefused()) {
      run_.Report("circle '" + circle->id + "'",
                  "scattered points would lie as near to an ellipse as its " +
                      std::to_string(support.num_inliers) + " do");
      return;
    }
    f->status = support.Refusal();
    circle->fit.reset();
    circle->inliers.clear();
  }

  // Where that is what makes outliers of most points, it is to blame, and not they.
  void DoubtStatedNoise(const CircleObservation& circle, FittedFeature* f) const {
    const std::string problem = StatedNoiseProblem(run_.options, run_.observations.camera, circle);
    if (problem.empty()) return;
    f->status = Status::Refused(problem);
    if (circle.fit) run_.Report("circle '" + circle.id + "'", problem);
  }

  void ReportFailures() const {
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      const CircleObservation& circle = run_.observations.circles[i];
      if (!circle.fit) run_.Report("circle '" + circle.id + "'", circles_[i].status.message);
    }
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      const PencilObservation& pencil = run_.observations.pencils[k];
      for (std::size_t i = 0; i < lines_[k].size(); ++i) {
        if (!pencil.lines[i].fit) run_.Report(pencil, i, lines_[k][i].status.message);
      }
    }
  }

  // From points of 1 px to those that there are, with what they share and how irregular they are.
  void ShareNoise(const FittedFeature& f, const std::vector<Eigen::Vector2d>& pixels,
                  const std::vector<std::uint8_t>& inliers, ConicFit* fit) const {
    const double weight = run_.options.noise_model.ContourWeight(f.sigma_px, pixels, inliers);
    fit->ScaleCovariance(f.sigma_px * f.sigma_px / weight);
    std::vector<CalibratedPoint> kept;
    for (std::size_t i = 0; i < f.points.size(); ++i) {
      if (inliers[static_cast<std::size_t>(f.indices[i])] != 0) kept.push_back(f.points[i]);
    }
    fit->irregularity = Irregularity(kept, fit->conic, run_.options.noise_model);
  }

  FitRun& run_;
  std::vector<FittedFeature> circles_;
  std::vector<std::vector<FittedFeature>> lines_;  // By pencil, by line.
  std::vector<std::uint8_t> mask_;
};

}  // namespace

Status FitOptions::Validate() const {
  if (!(inlier_threshold_px >= 0.0) || !std::isfinite(inlier_threshold_px)) {
    return Status::Invalid("inlier_threshold_px must be 0 or more");
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
  return noise_model.Validate();
}

Status FitObservations(const FitOptions& options, Observations* observations,
                       std::vector<std::string>* problems) {
  Status status = options.Validate();
  if (status.ok()) status = observations->Validate();
  if (!status.ok()) return status;
  const CameraSigma& sigma = options.noise_model.camera;
  const auto fit_points = [&](Observations* fitted) {
    FitRun run{options, *fitted, nullptr};
    PointFitter(&run).FitPoints();
  };
  TakeFocalOfFits(sigma, fit_points, observations);
  TakeLensOfFits(sigma, fit_points, observations);
  FitRun run{options, *observations, problems};
  PointFitter(&run).FitAll();
  return Status::Ok();
}

}  // namespace circline
