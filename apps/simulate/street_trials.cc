#include "apps/simulate/street_trials.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "apps/common/in_parallel.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "circline/ransac/detection/structure/look_for_focal.h"
#include "circline/refine/estimate_pose.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSure = 0.9, kWrongDeg = 5.0, kSigmas = 2.0;
constexpr std::array<double, 3> kThresholdsDeg = {3.0, 5.0, 10.0};
// Directions this far from a right angle make no frame with axes between them.
constexpr double kSkewDeg = 5.0;

// Frames of the plane that two directions span, as good as each other: the normal is their product,
// an axis along the one, along the other or, where they are nearly at right angles, between.
std::vector<Matrix3d> FramesOf(const Vector3d& first, const Vector3d& second) {
  const Vector3d normal = first.cross(second).normalized(), other = second.cross(normal);
  const double turn = std::atan2(first.cross(other).dot(normal), first.dot(other));
  const bool is_skew = std::abs(turn) / kDegree > kSkewDeg;
  const int steps = is_skew ? 1 : 8;
  std::vector<Matrix3d> frames;
  for (int k = 0; k <= steps; ++k) {
    const Vector3d x = Eigen::AngleAxisd(turn * k / steps, normal) * first;
    Matrix3d frame;
    frame << x, normal.cross(x), normal;
    for (int quarter = 0; quarter < 4; ++quarter) {
      for (const double side : {1.0, -1.0}) {
        frames.push_back(frame);
        frames.back().col(1) *= side;
        frames.back().col(2) *= side;
      }
      frame.col(0).swap(frame.col(1));
      frame.col(1) *= -1.0;
    }
  }
  return frames;
}

// The error, camera frame, radians, to the nearest frame of any plane of the house.
Vector3d NearestError(const HouseDirections& house, const Matrix3d& rotation) {
  Vector3d nearest = Vector3d::Constant(std::numeric_limits<double>::infinity());
  for (const auto& [i, j] : {std::pair(0U, 1U), std::pair(1U, 2U), std::pair(0U, 2U)}) {
    for (const Matrix3d& frame : FramesOf(house[i], house[j])) {
      const Vector3d error = LogRotation(frame * rotation.transpose());
      if (error.norm() < nearest.norm()) nearest = error;
    }
  }
  return nearest;
}

void JudgeFocal(const StreetPhoto& photo, const Camera& camera, const PoseEstimate& estimate,
                StreetAnswer* answer) {
  const double best = std::log(CameraOf(estimate.hypotheses.front(), camera).fx);
  double variance = 0.0;
  for (const PoseHypothesis& h : estimate.hypotheses) {
    const double sigma = h.focal_sigma / h.focal_scale;
    const double off = std::log(CameraOf(h, camera).fx) - best;
    variance += h.probability * (sigma * sigma + off * off);
  }
  answer->focal_error = best - std::log(photo.focal_px);
  answer->focal_sigma = std::sqrt(variance);
}

StreetAnswer Judge(const StreetPhoto& photo, const Observations& observations) {
  StreetAnswer answer;
  EstimationOptions options;
  if (photo.sigma.IsWide()) options.camera_sigma = photo.sigma;
  const PoseEstimate estimate = EstimatePose(observations, options);
  if (!estimate.status.ok() || estimate.hypotheses.front().RotationIsFree()) return answer;
  const PoseHypothesis& best = estimate.hypotheses.front();
  answer.failed = false;
  answer.probability = best.probability;
  answer.sigma = best.SigmaRotation();
  if (photo.sigma.IsWide()) JudgeFocal(photo, observations.camera, estimate, &answer);
  for (const HouseDirections& house : photo.houses) {
    const Vector3d error = NearestError(house, best.cam_from_world.rotation);
    const double angle_deg = error.norm() / kDegree;
    if (&house == &photo.houses.front()) answer.error_deg = angle_deg;
    if (!(angle_deg < answer.error_any_deg)) continue;
    answer.error_any_deg = angle_deg;
    answer.error = error;
  }
  return answer;
}

Observations Detect(const StreetPhoto& photo, std::uint64_t seed) {
  const auto collect = [&photo](const Camera& camera) {
    PhotoEvidence evidence;
    for (const StreetSegment& segment : photo.segments) {
      DetectedLine line;
      if (LineFromSegment(camera, segment.ends, photo.sigma_px, &line).ok())
        evidence.lines.push_back(std::move(line));
    }
    std::stable_sort(evidence.lines.begin(), evidence.lines.end(),
                     [](const auto& a, const auto& b) { return a.length_px > b.length_px; });
    return evidence;
  };
  DetectionOptions options;
  options.seed = seed;
  options.noise_model.camera = photo.sigma;
  const double diagonal_px = DiagonalPx(photo.camera.width, photo.camera.height);
  Observations observations;
  observations.camera = photo.camera;
  PhotoEvidence evidence = photo.sigma.IsWide()
                               ? LookForFocal(collect, options, diagonal_px, &observations)
                               : collect(photo.camera);
  ObserveEvidence(options, diagonal_px, &evidence, &observations);
  return observations;
}

// The plane of the upright direction and of the first one that has as many lines as another, x and
// z; the other direction is y where it is at right angles.
Observations Know(const StreetPhoto& photo) {
  Observations observations;
  observations.camera = photo.camera;
  std::array<PencilObservation, 3> pencils;
  for (const StreetSegment& segment : photo.segments) {
    if (segment.house != 0) continue;
    LineObservation line;
    line.points = {segment.ends[0], segment.ends[1]};
    pencils[static_cast<std::size_t>(segment.direction)].lines.push_back(line);
  }
  const std::size_t x = pencils[0].lines.size() >= pencils[1].lines.size() ? 0 : 1;
  for (const std::size_t k : {x, std::size_t{2}, 1 - x}) {
    PencilObservation& pencil = pencils[k];
    pencil.id = "L" + std::to_string(k);
    pencil.sigma_px = photo.sigma_px;
    if (k == x || k == 2) pencil.plane = "p0";
    if (k == x) pencil.direction = PencilDirection::kX;
    if (k == 2) pencil.direction = PencilDirection::kY;
    if (k == 1 - x && photo.is_orthogonal) pencil.direction = PencilDirection::kZ;
    if (!pencil.lines.empty()) observations.pencils.push_back(pencil);
  }
  observations.frame.plane = "p0";
  FitDirect(photo.sigma_px, &observations, nullptr, NoiseModel());
  return observations;
}

// Of its pose, and of that to what counts as wrong.
bool IsSure(const StreetAnswer& answer) {
  return !answer.failed && answer.probability >= kSure &&
         answer.sigma.norm() <= kWrongDeg * kDegree;
}

// Area under the share of errors below a threshold, from 0 to that of the argument, of its
// greatest, per cent.
double AreaUnderRecall(const std::vector<StreetTrial>& trials, StreetAnswer StreetTrial::*answer,
                       double most_deg) {
  double area = 0.0;
  for (const StreetTrial& trial : trials)
    area += std::max(0.0, 1.0 - (trial.*answer).error_deg / most_deg);
  return 100.0 * area / static_cast<double>(trials.size());
}

// Components of the answers that are not wrong within two standard deviations, per cent.
double CoveragePercent(const std::vector<StreetTrial>& trials, StreetAnswer StreetTrial::*which) {
  double within = 0.0, all = 0.0;
  for (const StreetTrial& trial : trials) {
    const StreetAnswer& answer = trial.*which;
    if (answer.failed || answer.error_any_deg > kWrongDeg) continue;
    within +=
        static_cast<double>((answer.error.array().abs() <= kSigmas * answer.sigma.array()).count());
    all += 3.0;
  }
  return 100.0 * within / std::max(1.0, all);
}

// What the focal length is off by, per cent: median and ninetieth percentile, and the share of
// photos that it is within ten of. Of houses that are square: others look as square ones do at
// another focal length.
std::string FocalSummary(const std::vector<StreetTrial>& trials, StreetAnswer StreetTrial::*which) {
  std::vector<double> off;
  for (const StreetTrial& trial : trials) {
    const StreetAnswer& answer = trial.*which;
    if (!trial.photo.is_orthogonal) continue;
    off.push_back(answer.failed ? std::numeric_limits<double>::infinity()
                                : 100.0 * std::abs(std::expm1(answer.focal_error)));
  }
  if (off.empty()) return "none";
  std::sort(off.begin(), off.end());
  const auto near = std::upper_bound(off.begin(), off.end(), 10.0) - off.begin();
  const double share = 100.0 * static_cast<double>(near) / static_cast<double>(off.size());
  return FormatFixed(off[off.size() / 2], 1) + " % (nine of ten " +
         FormatFixed(off[9 * off.size() / 10], 1) + " %), within 10 % in " + FormatFixed(share, 0) +
         " %";
}

std::vector<std::string> Cells(const StreetAnswer& answer) {
  if (answer.failed) return {"1", "", "", "", "", "", "", "", "", "", "", ""};
  std::vector<std::string> cells = {"0", FormatFixed(answer.error_deg, 5),
                                    FormatFixed(answer.error_any_deg, 5)};
  for (const Vector3d& v : {answer.error, answer.sigma}) {
    for (const double value : v) cells.push_back(FormatFixed(value / kDegree, 5));
  }
  cells.push_back(FormatFixed(answer.probability, 4));
  const bool is_guessed = answer.focal_sigma > 0.0;
  for (const double value : {answer.focal_error, answer.focal_sigma})
    cells.push_back(is_guessed ? FormatFixed(value, 5) : "");
  return cells;
}

}  // namespace

std::vector<StreetTrial> SimulateStreets(int num_trials, double focal_sigma, std::uint64_t seed,
                                         int threads) {
  UseThreads(threads);
  Progress progress("photos", num_trials);
  std::vector<StreetTrial> trials(static_cast<std::size_t>(num_trials));
  InParallel(trials.size(), [&](std::size_t k) {
    Random random(Random(seed).Next() + k);
    random = Random(random.Next());
    StreetTrial& trial = trials[k];
    trial.photo = DrawStreet(focal_sigma, &random);
    trial.detected = Judge(trial.photo, Detect(trial.photo, random.Next()));
    trial.known = Judge(trial.photo, Know(trial.photo));
    progress.Advance();
  });
  return trials;
}

std::string StreetCsv(const std::vector<StreetTrial>& trials) {
  std::string csv = "trial,orthogonal,houses,segments,sigma_px";
  for (const std::string who : {"detected", "known"}) {
    for (const char* what : {"failed", "error_deg", "error_any_deg", "error_x_deg", "error_y_deg",
                             "error_z_deg", "sigma_x_deg", "sigma_y_deg", "sigma_z_deg",
                             "probability", "focal_error", "focal_sigma"}) {
      csv += "," + who + "_" + what;
    }
  }
  csv += "\n";
  for (std::size_t k = 0; k < trials.size(); ++k) {
    const StreetPhoto& photo = trials[k].photo;
    csv += JoinList({std::to_string(k), photo.is_orthogonal ? "1" : "0",
                     std::to_string(photo.houses.size()), std::to_string(photo.segments.size()),
                     FormatFixed(photo.sigma_px, 4), JoinList(Cells(trials[k].detected), ","),
                     JoinList(Cells(trials[k].known), ",")},
                    ",") +
           "\n";
  }
  return csv;
}

std::string StreetSummary(const std::vector<StreetTrial>& trials) {
  std::vector<std::string> areas, ratios;
  for (const double most : kThresholdsDeg) {
    const double detected = AreaUnderRecall(trials, &StreetTrial::detected, most);
    const double known = AreaUnderRecall(trials, &StreetTrial::known, most);
    areas.push_back(FormatFixed(detected, 1) + " of " + FormatFixed(known, 1));
    ratios.push_back(FormatFixed(detected / known, 3));
  }
  double sure = 0.0, wrong = 0.0, failed = 0.0;
  for (const StreetTrial& trial : trials) {
    failed += trial.detected.failed ? 1.0 : 0.0;
    if (!IsSure(trial.detected)) continue;
    sure += 1.0;
    wrong += trial.detected.error_any_deg > kWrongDeg ? 1.0 : 0.0;
  }
  const double n = static_cast<double>(trials.size());
  std::string text = "rotation AUC@3/5/10 deg, detected against known: " + JoinList(areas, ", ") +
                     " (" + JoinList(ratios, ", ") + "); within 2 sigma " +
                     FormatFixed(CoveragePercent(trials, &StreetTrial::detected), 1) +
                     " % (known " + FormatFixed(CoveragePercent(trials, &StreetTrial::known), 1) +
                     " %); no answer " + FormatFixed(100.0 * failed / n, 1) + " %; sure " +
                     FormatFixed(100.0 * sure / n, 1) + " %, of these wrong " +
                     FormatFixed(100.0 * wrong / std::max(1.0, sure), 1) + " %\n";
  if (trials.front().photo.sigma.IsWide()) {
    text += "focal length, of square houses, off by " +
            FocalSummary(trials, &StreetTrial::detected) +
            "; known: " + FocalSummary(trials, &StreetTrial::known) + "\n";
  }
  return text;
}

}  // namespace circline::apps
