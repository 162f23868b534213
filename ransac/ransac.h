// One robust estimator for every model: random sample consensus with a truncated loss, local
// optimisation, early rejection and an exact stopping rule.
//
// In:  a Model (below) that holds the data, RansacOptions.
// Out: a RansacReport: the best model, its score and inliers - all three computed after the last
//      refinement, so that they agree - and why the search stopped.
//
//     struct Model {
//       using Value = ...;                     // What is estimated; cheap to copy, no heap.
//       static constexpr int kMinSamples = 2;  // Data that determine a Value.
//       int NumData() const;
//       // Fits the kMinSamples data `sample`; false where they are degenerate.
//       bool Fit(const int* sample, Value* value) const;
//       // Squared residuals of the data begin..end-1, to r2[0..]. At most kRansacBlock at a time.
//       void SquaredResiduals(const Value& value, int begin, int end, float* r2) const;
//       // One step (Gauss-Newton or a reweighted fit) towards the minimum of the sum of weight
//       // times squared residual, one weight per datum; false, with `value` untouched, if there
//       // is none.
//       bool Refine(const float* weights, Value* value) const;
//       // A last look at a candidate that would become the best: false rejects it.
//       bool Accept(const Value& value, double threshold) const;
//     };
//
// A Model keeps its data in random order (see RandomOrder), so that a prefix stands for the whole:
// a candidate whose loss on the first blocks is beyond what chance allows the current best is
// rejected there (the bail-out test of Capel, BMVC 2005, on the loss).
//
// Same input, options and seed: same bits out. Nothing is allocated after the set-up of a run, and
// nothing at all when an engine is used again on no more data. An engine serves one thread.
//
// M. Fischler, R. Bolles, CACM 1981; P. Torr, A. Zisserman, MLESAC, CVIU 2000 (the truncated loss);
// O. Chum, J. Matas, J. Kittler, Locally optimized RANSAC, DAGM 2003; K. Lebeda, J. Matas, O. Chum,
// Fixing the locally optimized RANSAC, BMVC 2012.
#ifndef CIRCLINE_RANSAC_RANSAC_H_
#define CIRCLINE_RANSAC_RANSAC_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/random.h"
#include "circline/estimators/status.h"
#include "circline/ransac/sampler.h"

namespace CIRCLINE_EXPORT circline {

// Data whose residuals are asked for at a time.
constexpr int kRansacBlock = 32;

// When a search stops, and how thorough it is.
struct RansacOptions {
  double threshold = 1.0;       // Largest residual of an inlier, in the model's unit; > 0.
  double confidence = 0.999;    // That one all-inlier sample was drawn; in (0, 1).
  int min_iterations = 1;       // Draws that are made whatever the confidence; 0 or more.
  int max_iterations = 200000;  // Draws; 1 or more.
  std::uint64_t seed = 1;       // Same seed, same bits.
  int local_start = 30;   // Draws before the first local optimisation (Lebeda 2012); 0 or more.
  int local_samples = 1;  // Inner samples of each local optimisation; 0 = refine the best only.
  int local_steps = 3;    // Reweighted steps from each inner sample; 0 = no local optimisation.

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// What the plain functions of the models (FitConicRobust, ...) take.
struct RobustFitOptions {
  RansacOptions ransac;   // Its threshold in the unit that the function states.
  double sigma_px = 1.0;  // Standard deviation of a point, for the covariance; > 0.

  RobustFitOptions() { ransac.threshold = kInlierSigmas; }
  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// Why a search stopped.
enum class StopReason { kConfident, kMaxIterations, kTooFewData };

// What a search found.
template <typename Value>
struct RansacReport {
  bool success = false;  // A model was found; else the fields below are those of no inliers.
  Value model{};         // The best.
  double score = 0.0;    // Sum of losses, each in [0, 1]: the smaller the better.
  int num_inliers = 0;   // Ones of the mask.
  std::vector<std::uint8_t> inlier_mask;             // One per datum, in the model's order.
  int num_iterations = 0;                            // Draws.
  int num_degenerate = 0;                            // Draws that gave no model.
  int num_local_optimizations = 0;                   // Each of several steps.
  StopReason stop_reason = StopReason::kTooFewData;  // See StopReason.
};

// Draws of `num_samples` of `num_data` without replacement after which, with probability
// `confidence`, one held inliers only: log(1 - confidence) / log(1 - p), where p is the exact
// (hypergeometric) probability of an all-inlier sample. At least 1; INT_MAX where it is never.
int RequiredIterations(int num_data, int num_inliers, int num_samples, double confidence);

// The engine, for one kind of model.
template <typename Model>
class Ransac {
 public:
  using Value = typename Model::Value;  // What is estimated.
  using Report = RansacReport<Value>;   // What Run fills.

  // `options` must be valid.
  explicit Ransac(const RansacOptions& options) : options_(options) {}

  // Searches; `report` is overwritten, its memory used again.
  void Run(const Model& model, Report* report) {
    constexpr int m = Model::kMinSamples;
    SetUp(model, report);
    if (num_data_ < m) return;
    std::array<int, static_cast<std::size_t>(m)> sample{};
    int needed = options_.max_iterations;
    bool optimized = true;  // Whether `best_` has been through local optimisation.
    report->stop_reason = StopReason::kMaxIterations;
    while (report->num_iterations < needed) {
      ++report->num_iterations;
      DrawSample(num_data_, m, &random_, sample.data());
      Candidate candidate;
      if (!model.Fit(sample.data(), &candidate.value)) {
        ++report->num_degenerate;
      } else if (Beats(model, drawn_score_, &candidate)) {
        // The best draw so far, though perhaps not as good as an earlier one after refinement.
        drawn_score_ = candidate.score;
        SetLimits();
        if (candidate.score < best_.score) {
          best_ = candidate;
          optimized = false;
        }
        if (report->num_iterations > options_.local_start) {
          Optimize(model, candidate.value, report);
          optimized = true;
        }
        needed = Needed();
      }
      if (report->num_iterations >= needed && !optimized) {
        Optimize(model, best_.value, report);
        optimized = true;
        needed = Needed();
      }
    }
    if (needed < options_.max_iterations) report->stop_reason = StopReason::kConfident;
    Finish(model, report);
  }

 private:
  struct Candidate {
    Value value{};
    double score = 0.0;
    int num_inliers = 0;
  };

  void SetUp(const Model& model, Report* report) {
    num_data_ = model.NumData();
    const std::size_t n = static_cast<std::size_t>(num_data_);
    weights_.assign(n, 0.0f);
    inliers_.assign(n, 0);
    limits_.assign(n / kRansacBlock + 1, 0.0);
    report->inlier_mask.assign(n, 0);
    report->success = false;
    report->model = typename Model::Value{};
    report->num_inliers = report->num_iterations = 0;
    report->num_degenerate = report->num_local_optimizations = 0;
    report->stop_reason = StopReason::kTooFewData;
    report->score = num_data_;
    random_ = Random{options_.seed};
    inverse_t2_ = static_cast<float>(1.0 / (options_.threshold * options_.threshold));
    best_ = Candidate();
    best_.score = drawn_score_ = num_data_;  // What a model without inliers has.
    SetLimits();
  }

  // Losses beyond which a candidate is rejected after each block: what a model as good as the best
  // draw exceeds in one case of 740 (three standard deviations).
  void SetLimits() {
    const double mean = drawn_score_ / num_data_;
    for (std::size_t block = 0; block < limits_.size(); ++block) {
      const double seen =
          std::min<double>(num_data_, static_cast<double>((block + 1) * kRansacBlock));
      const double variance = seen * mean * (1.0 - mean) * (1.0 - seen / num_data_);
      limits_[block] = seen * mean + 3.0 * std::sqrt(std::max(0.0, variance));
    }
  }

  // Scores the candidate; false as soon as it is clear that it beats neither the best draw nor
  // `score_to_beat`.
  bool Beats(const Model& model, double score_to_beat, Candidate* candidate) const {
    std::array<float, kRansacBlock> r2;
    double score = 0.0;
    int inliers = 0;
    for (int begin = 0, block = 0; begin < num_data_; begin += kRansacBlock, ++block) {
      const int size = std::min(kRansacBlock, num_data_ - begin);
      model.SquaredResiduals(candidate->value, begin, begin + size, r2.data());
      score += ScoreBlock(r2.data(), size, &inliers);
      if (!(score <= limits_[static_cast<std::size_t>(block)])) return false;
    }
    if (!(score < score_to_beat)) return false;
    candidate->score = score;
    candidate->num_inliers = inliers;
    return inliers >= Model::kMinSamples && model.Accept(candidate->value, options_.threshold);
  }

  double ScoreBlock(const float* r2, int size, int* inliers) const {
    // Four sums side by side: they vectorise without permission to reorder.
    std::array<float, 4> sums{};
    std::array<int, 4> counts{};
    int i = 0;
    for (; i + 4 <= size; i += 4) {
      for (std::size_t k = 0; k < 4; ++k) {
        const float u = r2[static_cast<std::size_t>(i) + k] * inverse_t2_;
        sums[k] += u < 1.0f ? u : 1.0f;
        counts[k] += u < 1.0f ? 1 : 0;
      }
    }
    for (; i < size; ++i) {
      const float u = r2[i] * inverse_t2_;
      sums[0] += u < 1.0f ? u : 1.0f;
      counts[0] += u < 1.0f ? 1 : 0;
    }
    *inliers += counts[0] + counts[1] + counts[2] + counts[3];
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
  }

  // Sets weights_ for threshold `scale` T and lists the inliers; returns how many there are.
  int Weigh(const Model& model, const Value& value, double scale) {
    std::array<float, kRansacBlock> r2;
    const float inverse = inverse_t2_ / static_cast<float>(scale * scale);
    int count = 0;
    for (int begin = 0; begin < num_data_; begin += kRansacBlock) {
      const int end = std::min(begin + kRansacBlock, num_data_);
      model.SquaredResiduals(value, begin, end, r2.data());
      for (int i = begin; i < end; ++i) {
        const float u = r2[static_cast<std::size_t>(i - begin)] * inverse;
        // Tukey's, not the truncated square's own step: a datum that crosses the threshold must not
        // make the iteration jump. 0 for NaN.
        weights_[static_cast<std::size_t>(i)] = u < 1.0f ? (1.0f - u) * (1.0f - u) : 0.0f;
        if (u < 1.0f) inliers_[static_cast<std::size_t>(count++)] = i;
      }
    }
    return count;
  }

  // Local optimisation: reweighted steps from `start`, and from inner samples, several times larger
  // than minimal, of the inliers of what that gave (Chum 2003). Thresholds shrink to T. Replaces
  // the best by the best of these, if that beats it.
  void Optimize(const Model& model, const Value& start, Report* report) {
    if (options_.local_steps == 0 || best_.num_inliers == 0) return;
    ++report->num_local_optimizations;
    Candidate local;
    local.value = start;
    local.score = num_data_;
    for (int k = 0; k <= options_.local_samples; ++k) {
      Candidate candidate;
      candidate.value = k % 2 == 1 ? start : local.value;
      if (k > 0 && !RefineOnSample(model, &candidate.value)) continue;
      for (int step = options_.local_steps; step > 0; --step) {
        const double scale = 1.0 + static_cast<double>(step - 1) / options_.local_steps;
        Weigh(model, candidate.value, scale);
        if (!model.Refine(weights_.data(), &candidate.value)) break;
      }
      if (Beats(model, local.score, &candidate)) local = candidate;
    }
    if (local.score < best_.score) best_ = local;
  }

  bool RefineOnSample(const Model& model, Value* value) {
    constexpr int kLargest = 4 * Model::kMinSamples;
    const int num_inliers = Weigh(model, *value, 1.0);
    const int size = std::min(num_inliers / 2, kLargest);
    if (size <= Model::kMinSamples) return false;
    std::array<int, static_cast<std::size_t>(kLargest)> sample{};
    DrawSample(num_inliers, size, &random_, sample.data());
    std::fill(weights_.begin(), weights_.end(), 0.0f);
    for (int i = 0; i < size; ++i) {
      const int datum = inliers_[static_cast<std::size_t>(sample[static_cast<std::size_t>(i)])];
      weights_[static_cast<std::size_t>(datum)] = 1.0f;
    }
    return model.Refine(weights_.data(), value);
  }

  // Draws after which the search may stop.
  int Needed() const {
    const int needed =
        RequiredIterations(num_data_, best_.num_inliers, Model::kMinSamples, options_.confidence);
    return std::min(std::max(needed, options_.min_iterations), options_.max_iterations);
  }

  void Finish(const Model& model, Report* report) {
    report->success = best_.num_inliers > 0;
    if (!report->success) return;
    report->model = best_.value;
    report->score = best_.score;
    report->num_inliers = Weigh(model, best_.value, 1.0);
    for (int k = 0; k < report->num_inliers; ++k) {
      const int datum = inliers_[static_cast<std::size_t>(k)];
      report->inlier_mask[static_cast<std::size_t>(datum)] = 1;
    }
  }

  RansacOptions options_;
  Random random_{0};
  int num_data_ = 0;
  float inverse_t2_ = 1.0f;
  Candidate best_;
  double drawn_score_ = 0.0;  // Of the best draw, before refinement.
  std::vector<float> weights_;
  std::vector<int> inliers_;
  std::vector<double> limits_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_RANSAC_H_
