// How good an estimate is: against the truth, the bound, and what it says of itself.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_SCORE_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_SCORE_H_

#include <Eigen/Core>
#include <string>
#include <vector>

#include "apps/benchmark/scenes_bound.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// Of one hypothesis: of its rotation or, where the spin about the normal is free, of its normal.
struct PoseError {
  double angle = 0.0;        // Radians.
  Eigen::VectorXd error;     // Components: 3 of the rotation, 2 of the normal.
  Eigen::VectorXd sigma;     // Their standard deviations, as stated.
  Eigen::VectorXd whitened;  // By the stated covariance; all NaN where that is not positive.
};

// Directions have no sense: up to half turns about the axes of the world.
PoseError ComparePose(const Eigen::Matrix3d& truth, bool spin_is_free,
                      const PoseHypothesis& hypothesis);

// The hypothesis nearest the truth; null if there is none.
const PoseHypothesis* Nearest(const Eigen::Matrix3d& truth, bool spin_is_free,
                              const PoseEstimate& estimate, PoseError* error);

// More than 5 sigma of the bound and 2 degrees from the truth.
bool IsWrong(const PoseError& error, const Bound& bound);

// Sums over trials.
class Tally {
 public:
  void AddRefused() { ++trials_, ++refused_; }
  void Add(const PoseError& error, const Bound& bound);

  int trials() const { return trials_; }
  static std::string Header();
  // Trials, share refused, share wrong, rms error over the bound (of all; of those not wrong), NEES
  // over its dimension (the same), 2-sigma coverage of whitened and of raw components.
  std::string Row() const;

 private:
  struct Sums {
    int count = 0;
    double squared_error = 0.0, nees = 0.0;
  };
  int trials_ = 0, refused_ = 0, wrong_ = 0;
  Sums all_, right_;
  int components_ = 0, whitened_covered_ = 0, raw_covered_ = 0;
};

// Whether probabilities come true: of the first hypotheses, by what they state.
class Calibration {
 public:
  void Add(double probability, bool right);
  void Print() const;  // One line a bin.
  // Wrong ones; how many their probabilities allow, and three standard deviations more.
  double NumWrong() const;
  double NumExpected() const;
  double NumAllowed() const;
  int NumWrongAbove(double probability) const;
  int NumAbove(double probability) const;
  int size() const { return static_cast<int>(said_.size()); }

 private:
  struct Said {
    double probability;
    bool right;
  };
  std::vector<Said> said_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_SCORE_H_
