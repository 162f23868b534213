#include "circline/ransac/fit_observations.h"

#include <algorithm>
#include <cmath>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/line.h"
#include "circline/estimators/point_noise.h"
#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/line_model.h"
#include "circline/ransac/pencil_model.h"
#include "circline/ransac/robust_conic.h"

namespace circline {
namespace {

// A circle or a line: its points, calibrated once, and their noise as far as it is known. Fits are
// made for points of 1 px; SetCovariance gives them the noise.
struct Feature {
  std::vector<CalibratedPoint> points;
  std::vector<int> indices;  // Of `points` among the pixels.
  bool is_stated = false;
  double sigma_px = 0.0;
};

// The gate of a residual in units of a noise that MeasurePointNoise has from `freedom` degrees of
// freedom: what Student's t, with the one of the prior, exceeds as often as a Gaussian exceeds
// kInlierSigmas (Wallace 1959; 7 % too large at 3 degrees, 1 % at 6).
double StudentGate(double freedom) {
  const double f = freedom + 1.0, scale = std::sqrt(std::max(1.0, f - 2.0) / f);
  const double z = kInlierSigmas * (8.0 * f + 3.0) / (8.0 * f + 1.0);
  return scale * std::sqrt(f * std::expm1(z * z / f));
}

class Fitter {
 public:
  Fitter(const FitOptions& options, Observations* observations, std::vector<std::string>* problems)
      : options_(options), observations_(*observations), problems_(problems) {}

  void FitAll() {
    observations_.num_dropped_points = 0;
    for (CircleObservation& circle : observations_.circles) {
      circles_.push_back(Prepare(circle.points, circle.sigma_px));
      circle.fit.reset();
      circle.inliers.clear();
      const Status status = FitCircle(circles_.back(), nullptr, &circle);
      if (!status.ok()) Report("circle '" + circle.id + "'", status.message);
    }
    for (PencilObservation& pencil : observations_.pencils) {
      pencil.fit.reset();
      std::vector<Feature>& features = lines_.emplace_back();
      for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
        LineObservation& line = pencil.lines[i];
        features.push_back(Prepare(line.points, LineSigma(pencil, line)));
        line.fit.reset();
        line.inliers.clear();
        line.is_parallel = true;
        const Status status = FitLine(features.back(), &line);
        if (!status.ok()) Report(LineName(pencil, i), status.message);
      }
    }
    for (int round = 0; round < kMaxRounds && FollowNoise(); ++round) continue;
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      SetCovariance(circles_[i], &observations_.circles[i]);
    }
    FitDirections();
  }

 private:
  void Report(const std::string& what, const std::string& problem) {
    if (problems_ != nullptr) problems_->push_back(what + ": " + problem);
  }

  static std::string LineName(const PencilObservation& pencil, std::size_t i) {
    return "pencil '" + pencil.id + "', line " + std::to_string(i);
  }

  Feature Prepare(const std::vector<Eigen::Vector2d>& pixels, double stated_px) {
    Feature f;
    observations_.num_dropped_points +=
        PixelsToCalibrated(observations_.camera, pixels, &f.points, &f.indices);
    f.is_stated = stated_px > 0.0;
    f.sigma_px = f.is_stated ? stated_px : options_.sigma_px;
    return f;
  }

  double Gate(const Feature& f) const {
    const double gate = kInlierSigmas * f.sigma_px, cap = options_.inlier_threshold_px;
    return cap > 0.0 ? std::min(cap, gate) : gate;
  }

  // Each fit gets a seed of its own.
  RobustFitOptions FeatureOptions(double threshold) {
    RobustFitOptions result;
    result.ransac.threshold = threshold;
    result.ransac.confidence = options_.confidence;
    result.ransac.max_iterations = options_.max_iterations;
    result.ransac.seed = Random(options_.seed + num_fits_++).Next();
    return result;
  }

  // mask_ as one of all pixels: what the camera cannot undistort is an outlier.
  std::vector<std::uint8_t> PixelMask(const Feature& f, std::size_t num_pixels) const {
    std::vector<std::uint8_t> result(num_pixels, 0);
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      result[static_cast<std::size_t>(f.indices[i])] = mask_[i];
    }
    return result;
  }

  // From `initial`, or by a search.
  Status FitCircle(const Feature& f, const ConicFit* initial, CircleObservation* circle) {
    EdgeDirections directions;
    directions.sigma_rad = options_.direction_sigma_rad;
    const bool has_normals = !circle->normals.empty();
    if (has_normals) {
      for (const int i : f.indices) {
        directions.normals.push_back(circle->normals[static_cast<std::size_t>(i)]);
      }
    }
    const EdgeDirections* given = has_normals ? &directions : nullptr;
    const RobustFitOptions options = FeatureOptions(Gate(f));
    ConicFit fit;
    const Status status =
        initial == nullptr ? FitConicRobust(f.points, options, &fit, &mask_, ConicLimits(), given)
                           : RefitConicRobust(f.points, options, initial->conic, &fit, &mask_,
                                              ConicLimits(), given);
    if (!status.ok()) return status;
    circle->fit = fit;
    circle->inliers = PixelMask(f, circle->points.size());
    return status;
  }

  Status FitLine(const Feature& f, LineObservation* line) {
    LineFit fit;
    const Status status = FitLineRobust(f.points, FeatureOptions(Gate(f)), &fit, &mask_);
    if (!status.ok()) return status;
    line->fit = fit;
    line->inliers = PixelMask(f, line->points.size());
    return status;
  }

  // True if the noise that was measured is not what the feature was fitted with.
  static bool TakeNoise(double measured_px, Feature* f) {
    if (f->is_stated) return false;
    const double before = f->sigma_px;
    f->sigma_px = measured_px;
    constexpr double kTolerance = 0.05;
    return std::abs(measured_px - before) > kTolerance * before;
  }

  // Fits again what has another noise than its gate was made for; false if there is nothing.
  bool FollowNoise() {
    const PointNoise noise = MeasurePointNoise(observations_);
    bool moved = false;
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      CircleObservation& circle = observations_.circles[i];
      if (!TakeNoise(noise.circles[i], &circles_[i]) || !circle.fit) continue;
      const ConicFit initial = *circle.fit;
      moved |= FitCircle(circles_[i], &initial, &circle).ok();
    }
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      for (std::size_t i = 0; i < lines_[k].size(); ++i) {
        LineObservation& line = observations_.pencils[k].lines[i];
        if (!TakeNoise(noise.lines[k][i], &lines_[k][i]) || !line.fit) continue;
        moved |= FitLine(lines_[k][i], &line).ok();
      }
    }
    return moved;
  }

  void SetCovariance(const Feature& f, CircleObservation* circle) const {
    if (!circle->fit) return;
    const double weight =
        options_.noise_model.ContourWeight(f.sigma_px, circle->points, circle->inliers);
    circle->fit->ScaleCovariance(f.sigma_px * f.sigma_px / weight);
  }

  // The line with its noise in its covariance.
  LineFit WithNoise(const Feature& f, const LineObservation& line) const {
    LineFit fit = *line.fit;
    fit.covariance *= f.sigma_px * f.sigma_px /
                      options_.noise_model.LineWeight(f.sigma_px, line.points, line.inliers);
    return fit;
  }

  static bool TellsNoise(const Feature& f) { return !f.is_stated && f.points.size() == 2; }

  // What segments say of their noise must not depend on what it was thought to be: it starts from
  // the half of them that agrees best.
  void StartSegmentNoise(PencilObservation* pencil, std::vector<Feature>* features) {
    std::vector<LineFit> fits;
    std::vector<std::size_t> positions;
    for (std::size_t i = 0; i < features->size(); ++i) {
      pencil->lines[i].is_parallel = true;
      if (!TellsNoise((*features)[i]) || !pencil->lines[i].fit) continue;
      fits.push_back(*pencil->lines[i].fit);
      positions.push_back(i);
    }
    const std::size_t num_kept = fits.size() / 2 + 1;
    VanishingPointFit fit;
    if (num_kept < 3 || !FitTrimmedDirection(fits, num_kept, &fit, &mask_).ok()) return;
    pencil->fit = fit;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      pencil->lines[positions[i]].is_parallel = mask_[i] != 0;
    }
  }

  // How much farther than kInlierSigmas each line may miss, as its noise is a guess from few points
  // or segments: the residual has Student's distribution.
  std::vector<double> GateFactors(const std::vector<Feature>& features,
                                  const PencilObservation& pencil) const {
    double parallel = 0.0, segments = 0.0;
    for (std::size_t i = 0; i < features.size(); ++i) {
      if (!pencil.lines[i].fit || !pencil.lines[i].is_parallel) continue;
      parallel += 1.0;
      segments += TellsNoise(features[i]) ? 1.0 : 0.0;
    }
    std::vector<double> factors(features.size(), 1.0);
    for (std::size_t i = 0; i < features.size(); ++i) {
      const std::vector<std::uint8_t>& mask = pencil.lines[i].inliers;
      if (features[i].is_stated) continue;
      const double freedom =
          features[i].points.size() == 2
              ? segments * std::max(0.0, 1.0 - 2.0 / parallel) + line_worth_ - 1.0
              : static_cast<double>(std::count(mask.begin(), mask.end(), 1)) - 2.0;
      factors[i] = StudentGate(std::max(0.0, freedom)) / kInlierSigmas;
    }
    return factors;
  }

  // The vanishing point of a pencil, and which of its lines are parallel.
  Status FitDirection(const std::vector<Feature>& features, PencilObservation* pencil) {
    const std::vector<double> factors = GateFactors(features, *pencil);
    PencilOptions options;
    options.ransac = FeatureOptions(kInlierSigmas).ransac;
    options.model_sigma_rad = options_.noise_model.line_direction_rad;
    std::vector<LineFit> fits;
    std::vector<std::size_t> positions;
    for (std::size_t i = 0; i < features.size(); ++i) {
      LineObservation& line = pencil->lines[i];
      line.is_parallel = true;
      if (!line.fit) continue;
      fits.push_back(WithNoise(features[i], line));
      positions.push_back(i);
    }
    pencil->fit.reset();
    // A single line along an axis is evidence of its own.
    if (pencil->direction != PencilDirection::kFree && fits.size() == 1) return Status::Ok();
    VanishingPointFit fit;
    Status status = FitVanishingPointRobust(fits, options, &fit, &mask_);
    const bool is_sure = *std::max_element(factors.begin(), factors.end()) == 1.0;
    constexpr int kPasses = 2;
    for (int pass = 0; pass < kPasses && status.ok() && !is_sure; ++pass) {
      std::vector<LineFit> chosen;
      for (std::size_t i = 0; i < fits.size(); ++i) {
        const LineFit line = WithDirectionError(fits[i], options.model_sigma_rad);
        mask_[i] = std::abs(VanishingPointResidual(line, fit.direction)) <=
                   kInlierSigmas * factors[positions[i]];
        if (mask_[i] != 0) chosen.push_back(line);
      }
      status = FitVanishingPoint(chosen, &fit);
    }
    if (!status.ok()) return status;
    pencil->fit = fit;
    for (std::size_t i = 0; i < fits.size(); ++i) {
      pencil->lines[positions[i]].is_parallel = mask_[i] != 0;
    }
    return status;
  }

  // Segments of two points tell their noise by how they miss their pencil's vanishing point.
  bool FollowSegmentNoise() {
    const PointNoise noise = MeasurePointNoise(observations_);
    line_worth_ = noise.line_worth;
    bool moved = false;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      for (std::size_t i = 0; i < lines_[k].size(); ++i) {
        Feature& f = lines_[k][i];
        if (TellsNoise(f)) moved |= TakeNoise(noise.lines[k][i], &f);
      }
    }
    return moved;
  }

  void FitDirections() {
    std::vector<PencilObservation>& pencils = observations_.pencils;
    std::vector<Status> status(pencils.size());
    for (std::size_t k = 0; k < pencils.size(); ++k) StartSegmentNoise(&pencils[k], &lines_[k]);
    FollowSegmentNoise();
    for (int round = 0; round < kMaxRounds; ++round) {
      for (std::size_t k = 0; k < pencils.size(); ++k) {
        status[k] = FitDirection(lines_[k], &pencils[k]);
      }
      if (!FollowSegmentNoise()) break;
    }
    for (std::size_t k = 0; k < pencils.size(); ++k) {
      PencilObservation& pencil = pencils[k];
      if (!status[k].ok()) Report("pencil '" + pencil.id + "'", status[k].message);
      for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
        LineObservation& line = pencil.lines[i];
        if (line.fit) line.fit = WithNoise(lines_[k][i], line);
        if (!line.is_parallel) {
          Report(LineName(pencil, i), "it is not parallel to the others of its pencil");
        }
      }
    }
  }

  static constexpr int kMaxRounds = 8;

  const FitOptions& options_;
  Observations& observations_;
  std::vector<std::string>* problems_;
  std::uint64_t num_fits_ = 0;
  double line_worth_ = 1.0;
  std::vector<Feature> circles_;
  std::vector<std::vector<Feature>> lines_;  // By pencil, by line.
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
  Fitter(options, observations, problems).FitAll();
  return Status::Ok();
}

}  // namespace circline
