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

// The line with its noise in its covariance.
LineFit WithNoise(const FittedFeature& f, const LineObservation& line, const NoiseModel& noise) {
  LineFit fit = *line.fit;
  fit.covariance *=
      f.sigma_px * f.sigma_px / noise.LineWeight(f.sigma_px, line.points, line.inliers);
  return fit;
}

// What segments say of their noise must not depend on what it was thought to be: it starts from
// those that are inliers by the median residual of a fit to the half of them that agrees best
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
  std::vector<double> residuals;
  for (const LineFit& line : fits) {
    residuals.push_back(std::abs(VanishingPointResidual(line, fit.direction)));
  }
  std::vector<double> sorted = residuals;
  std::sort(sorted.begin(), sorted.end());
  const double n = static_cast<double>(fits.size());
  const double gate = kInlierSigmas * 1.4826 * std::sqrt(n / (n - 2.0)) * sorted[num_kept - 1];
  for (std::size_t i = 0; i < positions.size(); ++i) {
    pencil->lines[positions[i]].is_parallel = residuals[i] <= gate;
  }
}

// The vanishing point of a pencil, and which of its lines are parallel.
Status FitDirection(const std::vector<FittedFeature>& features, FitRun* run,
                    PencilObservation* pencil) {
  const NoiseModel& noise = run->options.noise_model;
  PencilOptions options;
  run->SetNext(kInlierSigmas, &options.ransac);
  options.model_sigma_rad = noise.line_direction_rad;
  std::vector<LineFit> fits;
  std::vector<std::size_t> positions;
  for (std::size_t i = 0; i < features.size(); ++i) {
    LineObservation& line = pencil->lines[i];
    line.is_parallel = true;
    if (!line.fit) continue;
    fits.push_back(WithNoise(features[i], line, noise));
    positions.push_back(i);
  }
  pencil->fit.reset();
  // A single line along an axis is evidence of its own.
  if (RunsAlongAxis(*pencil) && fits.size() == 1) return Status::Ok();
  VanishingPointFit fit;
  std::vector<std::uint8_t> mask;
  const Status status = FitVanishingPointRobust(fits, options, &fit, &mask);
  if (!status.ok()) return status;
  pencil->fit = fit;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    pencil->lines[positions[i]].is_parallel = mask[i] != 0;
  }
  return status;
}

// Segments of two points tell their noise by how they miss their pencil's vanishing point.
bool FollowSegmentNoise(const Observations& observations,
                        std::vector<std::vector<FittedFeature>>* lines) {
  const PointNoise noise = MeasurePointNoise(observations);
  bool moved = false;
  for (std::size_t k = 0; k < lines->size(); ++k) {
    for (std::size_t i = 0; i < (*lines)[k].size(); ++i) {
      FittedFeature& f = (*lines)[k][i];
      if (f.HasNoiseFromPencil()) moved |= f.FollowNoise(noise.lines[k][i]);
    }
  }
  return moved;
}

}  // namespace

bool FittedFeature::FollowNoise(double measured_px) {
  if (is_stated) return false;
  const double before = sigma_px;
  sigma_px = measured_px;
  constexpr double kTolerance = 0.05;
  return std::abs(measured_px - before) > kTolerance * before;
}

void FitRun::SetNext(double threshold, RansacOptions* ransac) {
  ransac->threshold = threshold;
  ransac->confidence = options.confidence;
  ransac->max_iterations = options.max_iterations;
  ransac->seed = Random(options.seed + num_fits++).Next();
}

void FitRun::Report(const std::string& what, const std::string& problem) const {
  if (problems != nullptr) problems->push_back(what + ": " + problem);
}

void FitRun::Report(const PencilObservation& pencil, std::size_t line,
                    const std::string& problem) const {
  Report("pencil '" + pencil.id + "', line " + std::to_string(line), problem);
}

void FitDirections(std::vector<std::vector<FittedFeature>>* lines, FitRun* run) {
  std::vector<PencilObservation>& pencils = run->observations.pencils;
  std::vector<Status> status(pencils.size());
  for (std::size_t k = 0; k < pencils.size(); ++k) StartSegmentNoise((*lines)[k], &pencils[k]);
  FollowSegmentNoise(run->observations, lines);
  for (int round = 0; round < FitRun::kMaxRounds; ++round) {
    for (std::size_t k = 0; k < pencils.size(); ++k) {
      status[k] = FitDirection((*lines)[k], run, &pencils[k]);
    }
    if (!FollowSegmentNoise(run->observations, lines)) break;
  }
  for (std::size_t k = 0; k < pencils.size(); ++k) {
    PencilObservation& pencil = pencils[k];
    if (!status[k].ok()) run->Report("pencil '" + pencil.id + "'", status[k].message);
    for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
      LineObservation& line = pencil.lines[i];
      if (line.fit) line.fit = WithNoise((*lines)[k][i], line, run->options.noise_model);
      if (!line.is_parallel) {
        run->Report(pencil, i, "it is not parallel to the others of its pencil");
      }
    }
  }
}

}  // namespace circline
