#include "circline/estimators/plane_focal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/focal_roots.h"
#include "circline/estimators/plane_equations.h"

namespace circline {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A Gauss-Newton step, no longer than what the linearisation is good for.
bool TakeStep(const PlaneEquations& equations, PlaneState* state, double* length) {
  constexpr double kLongest = 0.2;  // Radians; of logarithms.
  Vector4d step = -equations.information.ldlt().solve(equations.gradient);
  *length = step.head<3>().cwiseAbs().maxCoeff();
  if (!step.allFinite()) return false;
  if (*length > kLongest) step.head<3>() *= kLongest / *length;
  state->Step(step);
  return true;
}

// All unknowns together, to 1e-12.
bool Polish(const PlaneEvidence& evidence, PlaneState* state, PlaneEquations* equations) {
  constexpr int kMaxSteps = 50;
  double length = kInfinity;
  for (int i = 0; i < kMaxSteps && length > 1e-12; ++i) {
    if (!equations->Set(evidence, *state) || !TakeStep(*equations, state, &length)) {
      return false;
    }
  }
  constexpr double kConverged = 1e-6;  // Rounding may keep hard scenes from 1e-12.
  return length < kConverged && equations->Set(evidence, *state);
}

// Both states that the first circle's poses give at a focal length; false where it has none.
bool StartStates(const PlaneEvidence& evidence, double log_focal,
                 std::array<PlaneState, 2>* states) {
  const double f = std::exp(log_focal);
  const Vector3d K(f, f, 1.0);
  std::array<CirclePose, 2> poses;
  const int count =
      CirclePoses(K.asDiagonal() * evidence.circles[0]->conic * K.asDiagonal(), &poses);
  if (count == 0) return false;
  if (count == 1) poses[1] = poses[0];
  for (std::size_t i = 0; i < 2; ++i) {
    (*states)[i].log_focal = log_focal;
    if (!(*states)[i].Set(-poses[i].normal, evidence.circles[0]->conic)) return false;
    if (!evidence.radii.empty()) (*states)[i].log_unit -= std::log(evidence.radii[0]);
  }
  return true;
}

constexpr std::size_t kStarts = 40;

struct Start {
  PlaneState state;
  double chi2 = kInfinity;
};
using Branch = std::array<Start, kStarts>;

// Both branches, each continuous in the first circle's normal.
bool FillBranches(const PlaneEvidence& evidence, double low, double high,
                  std::array<Branch, 2>* branches) {
  for (std::size_t i = 0; i < kStarts; ++i) {
    const double part = static_cast<double>(i) / (kStarts - 1);
    std::array<PlaneState, 2> states;
    if (!StartStates(evidence, low + part * (high - low), &states)) return false;
    const auto agree = [&](std::size_t before, std::size_t now) {
      return (*branches)[before][i - 1].state.basis.col(2).dot(states[now].basis.col(2));
    };
    if (i > 0 && agree(0, 1) + agree(1, 0) > agree(0, 0) + agree(1, 1)) {
      std::swap(states[0], states[1]);
    }
    for (std::size_t k = 0; k < 2; ++k) {
      PlaneEquations equations;
      const bool valid = equations.Set(evidence, states[k]);
      (*branches)[k][i] = {states[k], valid ? equations.chi2 : kInfinity};
    }
  }
  return true;
}

FocalRefusal Check(const PlaneEvidence& evidence) {
  if (evidence.circles.empty() || evidence.circles.size() + evidence.pencils.size() < 2) {
    return FocalRefusal::kTooLittle;
  }
  if (!evidence.radii.empty() && evidence.radii.size() != evidence.circles.size()) {
    return FocalRefusal::kNotFinite;
  }
  for (const double radius : evidence.radii) {
    if (!(radius > 0.0) || !std::isfinite(radius)) return FocalRefusal::kNotFinite;
  }
  if (evidence.orthogonal_pencils && evidence.pencils.size() < 2) return FocalRefusal::kTooLittle;
  bool are_ellipses = true;
  for (const ConicFit* fit : evidence.circles) {
    if (!fit->conic.allFinite() || !fit->Covariance().allFinite()) return FocalRefusal::kNotFinite;
    Eigen::Matrix3d normalized;
    are_ellipses = are_ellipses && NormalizeEllipse(fit->conic, &normalized);
  }
  for (const VanishingPointFit* fit : evidence.pencils) {
    if (!fit->direction.allFinite() || !fit->covariance.allFinite()) {
      return FocalRefusal::kNotFinite;
    }
  }
  return are_ellipses ? FocalRefusal::kNone : FocalRefusal::kNoEllipse;
}

// Residuals less unknowns.
double Freedom(const PlaneEvidence& evidence) {
  const double circles = static_cast<double>(evidence.circles.size());
  const double pencils = static_cast<double>(evidence.pencils.size());
  return (evidence.radii.empty() ? 2.0 * circles : 3.0 * circles - 1.0) + pencils +
         (evidence.orthogonal_pencils ? 1.0 : 0.0) - 3.0;
}

// Whether the i-th start is lower than its neighbours. Minima may be nearer to each other than the
// starts are, so that the neighbours are starts, too.
bool IsNearMinimum(const Branch& branch, std::size_t i) {
  const auto chi2_at = [&branch](std::size_t k) {
    return k < kStarts ? branch[k].chi2 : kInfinity;
  };
  for (const std::size_t k : {i, i - 1, i + 1}) {
    if (chi2_at(k) < kInfinity && chi2_at(k) <= chi2_at(k - 1) && chi2_at(k) <= chi2_at(k + 1)) {
      return true;
    }
  }
  return false;
}

// Writes the distinct ones of one or more, the lowest chi2 first, without those that chi2 excludes.
// Returns how many.
int WriteDistinct(FocalSolution* begin, FocalSolution* end, double freedom,
                  std::array<FocalSolution, 4>* solutions) {
  constexpr double kSame = 1e-6;  // Of log focal.
  constexpr double kGate = 60.0;
  std::sort(begin, end,
            [](const FocalSolution& a, const FocalSolution& b) { return a.chi2 < b.chi2; });
  const double best = begin->chi2, unit = std::max(1.0, best / std::max(1.0, freedom));
  std::size_t count = 0;
  for (const FocalSolution* found = begin; found != end; ++found) {
    const FocalSolution& s = *found;
    if (count == solutions->size() || s.chi2 > best + kGate * unit) break;
    const auto written = solutions->begin() + static_cast<std::ptrdiff_t>(count);
    if (std::none_of(solutions->begin(), written, [&s](const FocalSolution& other) {
          return std::abs(std::log(other.focal / s.focal)) < kSame;
        })) {
      (*solutions)[count++] = s;
    }
  }
  return static_cast<int>(count);
}

}  // namespace

int FocalFromPlane(const PlaneEvidence& evidence, double min_focal, double max_focal,
                   std::array<FocalSolution, 4>* solutions, FocalRefusal* why) {
  FocalRefusal reason = Check(evidence);
  if (reason != FocalRefusal::kNone) return RefuseFocal(reason, why);
  const double low = std::log(min_focal), high = std::log(max_focal);
  std::array<Branch, 2> branches;
  if (!FillBranches(evidence, low, high, &branches)) {
    return RefuseFocal(FocalRefusal::kNoEllipse, why);
  }
  reason = FocalRefusal::kOutOfRange;
  std::array<FocalSolution, 2 * kStarts> found;
  FocalSolution* end = found.data();
  for (const Branch& branch : branches) {
    for (std::size_t i = 0; i < kStarts; ++i) {
      PlaneState state = branch[i].state;
      PlaneEquations equations;
      if (!IsNearMinimum(branch, i) || !Polish(evidence, &state, &equations)) continue;
      if (state.log_focal < low || state.log_focal > high) continue;
      const Matrix4d covariance = equations.information.inverse();
      if (!(covariance(0, 0) >= 0.0 && covariance(0, 0) < kMaxLogFocalVariance)) {
        reason = FocalRefusal::kUndetermined;
        continue;
      }
      *end++ = {std::exp(state.log_focal), covariance(0, 0),
                -(covariance.row(0) * equations.shift).transpose(), equations.chi2};
    }
  }
  if (end == found.data()) return RefuseFocal(reason, why);
  return WriteDistinct(found.data(), end, Freedom(evidence), solutions);
}

}  // namespace circline
