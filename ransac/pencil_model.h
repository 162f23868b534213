// Robust vanishing points: the direction that most of a set of lines share, and the several
// directions that one set of lines shares out among them.
//
// A line misses a direction by l . v radians. Its residual is that in standard deviations,
//   r = l . v / sqrt(v^T Cov(l) v + model_sigma_rad^2),
// so that long, well-measured segments are held to account more strictly than short ones, and
// directions at infinity in the image are nothing special.
#ifndef CIRCLINE_RANSAC_PENCIL_MODEL_H_
#define CIRCLINE_RANSAC_PENCIL_MODEL_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "circline/estimators/line.h"
#include "circline/estimators/status.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/ransac.h"

namespace circline {

struct PencilOptions {
  // A line farther than `ransac.threshold` standard deviations from the direction is an outlier.
  RansacOptions ransac;
  // What a line that is truly parallel may miss the direction by beyond its own noise (lens,
  // edges that bend, walls not quite parallel), radians; 0 or more. 0.4 px at a focal length of
  // 800 px is 5e-4.
  double model_sigma_rad = 5e-4;
  // FindPencils: directions to look for; 0 or more.
  int max_pencils = 3;
  // FindPencils: fewest lines of a pencil; 3 or more (two lines always meet).
  int min_lines = 3;
  // FindPencils: a pencil is kept if fewer than this many as good are expected among as many
  // unrelated lines (number of false alarms; Desolneux, Moisan, Morel, IJCV 2000); > 0.
  double max_false_alarms = 0.01;

  PencilOptions() { ransac.threshold = 3.03; }
  Status Validate() const;
};

struct FoundPencil {
  VanishingPointFit fit;
  std::vector<int> lines;  // Indices of its members, ascending.
  // Natural logarithm of the number of pencils this good expected by chance; very negative = sure.
  double log_false_alarms = 0.0;
};

// The direction with the most support and its covariance, fitted to the inliers (which `mask`,
// optional, receives, one per line). Refuses fewer than two usable lines, and lines that all
// coincide. Two lines are fitted as they are. Lines with a zero or non-finite normal are outliers.
// `fit` and `mask` are written only if the status is ok.
Status FitVanishingPointRobust(const std::vector<LineFit>& lines, const PencilOptions& options,
                               VanishingPointFit* fit, std::vector<std::uint8_t>* mask = nullptr);

// Several pencils from one set of lines, the best supported first. One direction after the other is
// found among the lines that are left; the search stops at max_pencils, or when the best direction
// left has fewer than min_lines lines or more than max_false_alarms. Then every line goes to the
// pencil that it misses least (within the threshold), each direction is fitted again, and pencils
// that no longer meet the conditions are dropped. No line is in two pencils. An empty answer is ok.
Status FindPencils(const std::vector<LineFit>& lines, const PencilOptions& options,
                   std::vector<FoundPencil>* pencils);

// Indices of the lines with a finite, unit normal.
std::vector<int> UsableLines(const std::vector<LineFit>& lines);

// The line with the model's error in its covariance, so that the fits of estimators/ weigh it as
// the search does.
LineFit WithModelError(const LineFit& line, double model_sigma_rad);

// Gauss-Newton for a direction in the tangent plane of the sphere, the variances of the lines held
// at the current direction.
class DirectionStep {
 public:
  explicit DirectionStep(const Eigen::Vector3d& direction);
  void Add(const Eigen::Vector3d& line, double variance, double weight);
  // False, with `direction` untouched, where the lines do not fix it.
  bool Move(Eigen::Vector3d* direction) const;

 private:
  Eigen::Vector3d v_, e1_, e2_;
  double a_ = 0.0, b_ = 0.0, c_ = 0.0, g1_ = 0.0, g2_ = 0.0;
};

// The model for the engine: directions from two lines.
class PencilModel {
 public:
  using Value = std::array<double, 3>;  // Unit direction.
  static constexpr int kMinSamples = 2;

  // Takes lines[indices[k]] for all k, in an order of its own.
  PencilModel(const std::vector<LineFit>& lines, const std::vector<int>& indices,
              double model_sigma_rad);

  int NumData() const { return static_cast<int>(index_.size()); }
  // Index into `lines` of the datum at position i.
  int LineIndex(int i) const { return index_[static_cast<std::size_t>(i)]; }

  // Unit line at position i, and the variance of its product with a direction (model's error too).
  const Eigen::Vector3d& Line(int i) const { return lines_[static_cast<std::size_t>(i)]; }
  double Variance(const Eigen::Vector3d& direction, int i) const;

  bool Fit(const int* sample, Value* direction) const;
  void SquaredResiduals(const Value& direction, int begin, int end, float* r2) const;
  bool Refine(const float* weights, Value* direction) const;
  bool Accept(const Value& /*direction*/, double /*threshold*/) const { return true; }

 private:
  std::vector<int> index_;
  // Lines, and covariance as p p^T + q q^T: nine flat arrays of num_data each.
  std::vector<float> data_;
  std::vector<Eigen::Vector3d> lines_;
  float model_variance_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_PENCIL_MODEL_H_
