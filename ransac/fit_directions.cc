#include "circline/ransac/fit_directions.h"

#include <algorithm>
#include <cmath>

#include "circline/estimators/line.h"
#include "circline/estimators/point_noise.h"
#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/robust_pencils.h"
#include "circline/ransac/trimmed_direction.h"

namespace circline {
namespace {

// The gate of a residual in units of a noise that MeasurePointNoise has from `freedom` degrees of
// freedom: what Student's t, with the one of the prior, exceeds as often as a Gaussian exceeds
// kInlierSigmas (Wallace 1959; 7 % too large at 3 degrees, 1 % at 6).
double StudentGate(double freedom) {
  const double f = freedom + 1.0, scale = std::sqrt(std::max(1.0, f - 2.0) / f);
  const double z = kInlierSigmas * (8.0 * f + 3.0) / (8.0 * f + 1.0);
  return scale * std::sqrt(f * std::expm1(z * z / f));
}

class DirectionFitter {
 public:
  DirectionFitter(std::vector<std::vector<FittedFeature>>* lines, FitRun* run)
      : lines_(*lines), run_(*run) {}

  void FitAll() {
    std::vector<PencilObservation>& pencils = run_.observations.pencils;
    std::vector<Status> status(pencils.size());
    for (std::size_t k = 0; k < pencils.size(); ++k) StartSegmentNoise(lines_[k], &pencils[k]);
    FollowSegmentNoise();
    for (int round = 0; round < FitRun::kMaxRounds; ++round) {
      for (std::size_t k = 0; k < pencils.size(); ++k) {
        status[k] = FitDirection(lines_[k], &pencils[k]);
      }
      if (!FollowSegmentNoise()) break;
    }
    for (std::size_t k = 0; k < pencils.size(); ++k) {
      PencilObservation& pencil = pencils[k];
      if (!status[k].ok()) run_.Report("pencil '" + pencil.id + "'", status[k].message);
      for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
        LineObservation& line = pencil.lines[i];
        if (line.fit) line.fit = WithNoise(lines_[k][i], line);
        if (!line.is_parallel) {
          run_.Report(pencil, i, "it is not parallel to the others of its pencil");
        }
      }
    }
  }

 private:
  // The line with its noise in its covariance.
  LineFit WithNoise(const FittedFeature& f, const LineObservation& line) const {
    LineFit fit = *line.fit;
    fit.covariance *= f.sigma_px * f.sigma_px /
                      run_.options.noise_model.LineWeight(f.sigma_px, line.points, line.inliers);
    return fit;
  }

  // What segments say of their noise must not depend on what it was thought to be: it starts from
  // those that are inliers by the median miss of a fit to the half of them that agrees best
  // (reweighted least trimmed squares, Rousseeuw and Leroy 1987).
  void StartSegmentNoise(const std::vector<FittedFeature>& features, PencilObservation* pencil) {
    std::vector<LineFit> fits;
    std::vector<std::size_t> positions;
    for (std::size_t i = 0; i < features.size(); ++i) {
      pencil->lines[i].is_parallel = true;
      if (!features[i].HasNoiseFromPencil() || !pencil->lines[i].fit) continue;
      fits.push_back(*pencil->lines[i].fit);
      positions.push_back(i);
    }
    const std::size_t num_kept = fits.size() / 2 + 1;
    VanishingPointFit fit;
    if (num_kept < 3 || !FitTrimmedDirection(fits, num_kept, &fit).ok()) return;
    pencil->fit = fit;
    std::vector<double> misses;
    for (const LineFit& line : fits) {
      misses.push_back(std::abs(VanishingPointResidual(line, fit.direction)));
    }
    std::vector<double> sorted = misses;
    std::sort(sorted.begin(), sorted.end());
    const double n = static_cast<double>(fits.size());
    const double gate = kInlierSigmas * 1.4826 * std::sqrt(n / (n - 2.0)) * sorted[num_kept - 1];
    for (std::size_t i = 0; i < positions.size(); ++i) {
      pencil->lines[positions[i]].is_parallel = misses[i] <= gate;
    }
  }

  // How much farther than kInlierSigmas each line may miss, as its noise is a guess from few points
  // or segments: the residual has Student's distribution.
  std::vector<double> GateFactors(const std::vector<FittedFeature>& features,
                                  const PencilObservation& pencil) const {
    double parallel = 0.0, segments = 0.0;
    for (std::size_t i = 0; i < features.size(); ++i) {
      if (!pencil.lines[i].fit || !pencil.lines[i].is_parallel) continue;
      parallel += 1.0;
      segments += features[i].HasNoiseFromPencil() ? 1.0 : 0.0;
    }
    std::vector<double> factors(features.size(), 1.0);
    for (std::size_t i = 0; i < features.size(); ++i) {
      const std::vector<std::uint8_t>& mask = pencil.lines[i].inliers;
      if (features[i].is_stated) continue;
      const double freedom =
          features[i].HasNoiseFromPencil()
              ? segments * std::max(0.0, 1.0 - 2.0 / parallel) + line_worth_ - 1.0
              : static_cast<double>(std::count(mask.begin(), mask.end(), 1)) - 2.0;
      factors[i] = StudentGate(std::max(0.0, freedom)) / kInlierSigmas;
    }
    return factors;
  }

  // The vanishing point of a pencil, and which of its lines are parallel.
  Status FitDirection(const std::vector<FittedFeature>& features, PencilObservation* pencil) {
    const std::vector<double> factors = GateFactors(features, *pencil);
    PencilOptions options;
    options.ransac = run_.NextRansac(kInlierSigmas);
    options.model_sigma_rad = run_.options.noise_model.line_direction_rad;
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
    const bool is_sure =
        std::all_of(factors.begin(), factors.end(), [](double factor) { return factor == 1.0; });
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
    const PointNoise noise = MeasurePointNoise(run_.observations);
    line_worth_ = noise.line_worth;
    bool moved = false;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      for (std::size_t i = 0; i < lines_[k].size(); ++i) {
        FittedFeature& f = lines_[k][i];
        if (f.HasNoiseFromPencil()) moved |= f.TakeNoise(noise.lines[k][i]);
      }
    }
    return moved;
  }

  std::vector<std::vector<FittedFeature>>& lines_;
  FitRun& run_;
  double line_worth_ = 1.0;
  std::vector<std::uint8_t> mask_;
};

}  // namespace

bool FittedFeature::TakeNoise(double measured_px) {
  if (is_stated) return false;
  const double before = sigma_px;
  sigma_px = measured_px;
  constexpr double kTolerance = 0.05;
  return std::abs(measured_px - before) > kTolerance * before;
}

RansacOptions FitRun::NextRansac(double threshold) {
  RansacOptions result;
  result.threshold = threshold;
  result.confidence = options.confidence;
  result.max_iterations = options.max_iterations;
  result.seed = Random(options.seed + num_fits++).Next();
  return result;
}

void FitRun::Report(const std::string& what, const std::string& problem) const {
  if (problems != nullptr) problems->push_back(what + ": " + problem);
}

void FitRun::Report(const PencilObservation& pencil, std::size_t line,
                    const std::string& problem) const {
  Report("pencil '" + pencil.id + "', line " + std::to_string(line), problem);
}

void FitDirections(std::vector<std::vector<FittedFeature>>* lines, FitRun* run) {
  DirectionFitter(lines, run).FitAll();
}

}  // namespace circline
