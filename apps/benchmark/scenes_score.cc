#include "apps/benchmark/scenes_score.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "apps/common/text.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

Eigen::VectorXd Whiten(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& error) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (!covariance.allFinite() || factor.info() != Eigen::Success) {
    return Eigen::VectorXd::Constant(error.size(), std::numeric_limits<double>::quiet_NaN());
  }
  return factor.matrixL().solve(error);
}

// True rotation = exp([delta]x) estimate; of the half turns of the world the one that fits best.
Eigen::Vector3d RotationError(const Eigen::Matrix3d& truth, const Eigen::Matrix3d& estimate) {
  Eigen::Vector3d smallest = Eigen::Vector3d::Constant(10.0);
  for (int turn = 0; turn < 4; ++turn) {
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    if (turn > 0) {
      signs = -signs;
      signs[turn - 1] = 1.0;
    }
    const Eigen::Matrix3d turned = truth * signs.asDiagonal();
    const Eigen::Vector3d delta = LogRotation(turned * estimate.transpose());
    if (delta.norm() < smallest.norm()) smallest = delta;
  }
  return smallest;
}

std::string Percent(double part, double whole, int decimals = 1) {
  return FormatFixed(100.0 * part / whole, decimals);
}

}  // namespace

PoseError ComparePose(const Eigen::Matrix3d& truth, bool spin_is_free,
                      const PoseHypothesis& hypothesis) {
  const Eigen::Matrix3d& estimate = hypothesis.cam_from_world.rotation;
  const Eigen::Matrix3d stated = hypothesis.Covariance().topLeftCorner<3, 3>();
  PoseError result;
  if (spin_is_free || hypothesis.RotationIsFree()) {
    const Eigen::Vector3d from = estimate.col(2);
    const Eigen::Vector3d to = (truth.col(2).dot(from) < 0.0 ? -1.0 : 1.0) * truth.col(2);
    const Eigen::Vector3d turn = from.cross(to);
    result.angle = std::atan2(turn.norm(), from.dot(to));
    const Eigen::Vector3d delta = turn.norm() > 0.0
                                      ? Eigen::Vector3d(turn.normalized() * result.angle)
                                      : Eigen::Vector3d(Eigen::Vector3d::Zero());
    Eigen::Matrix<double, 2, 3> across;
    across.row(0) = from.unitOrthogonal().transpose();
    across.row(1) = from.cross(across.row(0).transpose()).transpose();
    result.error = across * delta;
    const Eigen::Matrix2d covariance = across * stated * across.transpose();
    result.sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    result.whitened = Whiten(covariance, result.error);
    return result;
  }
  result.error = RotationError(truth, estimate);
  result.angle = result.error.norm();
  result.sigma = stated.diagonal().cwiseMax(0.0).cwiseSqrt();
  result.whitened = Whiten(stated, result.error);
  return result;
}

const PoseHypothesis* Nearest(const Eigen::Matrix3d& truth, bool spin_is_free,
                              const PoseEstimate& estimate, PoseError* error) {
  const PoseHypothesis* nearest = nullptr;
  for (const PoseHypothesis& hypothesis : estimate.hypotheses) {
    const PoseError candidate = ComparePose(truth, spin_is_free, hypothesis);
    if (nearest != nullptr && candidate.angle >= error->angle) continue;
    nearest = &hypothesis;
    *error = candidate;
  }
  return nearest;
}

bool IsWrong(const PoseError& error, const Bound& bound) {
  constexpr double kSigmas = 5.0, kLeast = 2.0 * kDegree;
  return error.angle > std::max(kLeast, kSigmas * bound.rotation_rad);
}

void Tally::Add(const PoseError& error, const Bound& bound) {
  ++trials_;
  const double ratio = error.angle / bound.rotation_rad;
  const double nees = error.whitened.squaredNorm() / static_cast<double>(error.whitened.size());
  const bool wrong = IsWrong(error, bound);
  if (wrong) ++wrong_;
  for (Sums* sums : {&all_, &right_}) {
    if (sums == &right_ && wrong) continue;
    ++sums->count;
    sums->squared_error += ratio * ratio;
    if (std::isfinite(nees)) sums->nees += nees;  // Else a covariance that does not cover anything.
  }
  for (Eigen::Index i = 0; i < error.error.size(); ++i) {
    ++components_;
    if (std::abs(error.whitened[i]) <= 2.0) ++whitened_covered_;
    if (std::abs(error.error[i]) <= 2.0 * error.sigma[i]) ++raw_covered_;
  }
}

std::string Tally::Header() {
  return "   n   refused%  wrong%  rms/bound (right)  NEES/dim (right)  cover%  raw%";
}

std::string Tally::Row() const {
  const auto rms = [](const Sums& sums) {
    return FormatFixed(std::sqrt(sums.squared_error / sums.count), 2);
  };
  const auto nees = [](const Sums& sums) {
    const double mean = sums.nees / sums.count;
    return mean < 1e4 ? FormatFixed(mean, 2) : FormatPlain(mean);
  };
  char line[160];
  std::snprintf(line, sizeof(line), "%5d  %7s  %6s  %9s (%5s)  %8s (%5s)  %6s %6s", trials_,
                Percent(refused_, trials_).c_str(), Percent(wrong_, trials_).c_str(),
                rms(all_).c_str(), rms(right_).c_str(), nees(all_).c_str(), nees(right_).c_str(),
                Percent(whitened_covered_, components_).c_str(),
                Percent(raw_covered_, components_).c_str());
  return line;
}

void Calibration::Add(double probability, bool right) { said_.push_back({probability, right}); }

void Calibration::Print() const {
  const double edges[] = {0.0, 0.5, 0.9, 0.99, 0.9999, 2.0};
  std::printf("  %-16s %6s %8s %10s\n", "probability", "n", "right%", "expected%");
  for (int bin = 4; bin >= 0; --bin) {
    int count = 0, right = 0;
    double expected = 0.0;
    for (const Said& said : said_) {
      if (said.probability < edges[bin] || said.probability >= edges[bin + 1]) continue;
      ++count;
      right += said.right ? 1 : 0;
      expected += said.probability;
    }
    if (count == 0) continue;
    const std::string name =
        FormatPlain(edges[bin]) + " - " + FormatPlain(std::min(1.0, edges[bin + 1]));
    std::printf("  %-16s %6d %8s %10s\n", name.c_str(), count, Percent(right, count, 2).c_str(),
                Percent(expected, count, 2).c_str());
  }
}

double Calibration::NumWrong() const { return NumWrongAbove(0.0); }

double Calibration::NumExpected() const {
  double expected = 0.0;
  for (const Said& said : said_) expected += 1.0 - said.probability;
  return expected;
}

double Calibration::NumAllowed() const {
  double variance = 0.0;
  for (const Said& said : said_) variance += said.probability * (1.0 - said.probability);
  return NumExpected() + 3.0 * std::sqrt(std::max(0.0, variance));
}

int Calibration::NumWrongAbove(double probability) const {
  return static_cast<int>(std::count_if(said_.begin(), said_.end(), [&](const Said& said) {
    return !said.right && said.probability >= probability;
  }));
}

int Calibration::NumAbove(double probability) const {
  return static_cast<int>(std::count_if(said_.begin(), said_.end(), [&](const Said& said) {
    return said.probability >= probability;
  }));
}

}  // namespace circline::apps
