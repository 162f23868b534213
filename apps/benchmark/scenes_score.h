// How good estimates are: against the truth, the bound, and what they say of themselves.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_SCORE_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_SCORE_H_

#include <string>

#include "apps/benchmark/scenes_experiments.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// Sums over the trials of a row. The error is that of the rotation or, where nothing fixes the
// rotation about the plane's normal, of the normal; it is wrong where it is more than 5 sigma of
// the bound and more than 2 degrees. Where the focal length is not known its logarithm counts
// among the components, and more than 5 sigma and 0.1 is wrong.
class Tally {
 public:
  void Add(const Scene& scene, const PoseEstimate& estimate);

  static std::string Header();
  std::string Row() const;

 private:
  int trials_ = 0, refused_ = 0;
  // Of the hypothesis nearest the truth; sums where it is not wrong.
  int missing_ = 0, right_ = 0, components_ = 0, covered_ = 0;
  double squared_error_ = 0.0, squared_focal_error_ = 0.0, nees_ = 0.0;
  // Of the first hypothesis; how many wrong ones the probabilities expect.
  int wrong_ = 0, sure_ = 0, sure_wrong_ = 0;
  double expected_wrong_ = 0.0;
  // Trials whose first hypothesis leaves out all that is odd; anything else.
  int odd_left_out_ = 0, others_left_out_ = 0;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_SCORE_H_
