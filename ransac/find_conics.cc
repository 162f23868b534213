#include "circline/ransac/find_conics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "circline/estimators/conic.h"
#include "circline/ransac/false_alarms.h"
#include "circline/ransac/robust_conic.h"

namespace circline {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Points chosen from the caller's.
struct Subset {
  std::vector<int> indices;
  std::vector<CalibratedPoint> points;
  EdgeDirections directions;
  bool has_directions = false;

  const EdgeDirections* Directions() const { return has_directions ? &directions : nullptr; }
};

class Finder {
 public:
  Finder(const std::vector<CalibratedPoint>& points, const EdgeDirections* directions,
         const FindConicsOptions& options)
      : points_(points), directions_(directions), options_(options) {}

  void Run(std::vector<FoundConic>* conics) const {
    Collect(conics);
    Assign(conics);
    std::vector<FoundConic> kept;
    for (std::size_t k = 0; k < conics->size(); ++k) {
      if (Refit(*conics, k, &(*conics)[k])) kept.push_back((*conics)[k]);
    }
    std::stable_sort(kept.begin(), kept.end(), [](const FoundConic& a, const FoundConic& b) {
      return a.log_false_alarms < b.log_false_alarms;
    });
    *conics = std::move(kept);
  }

 private:
  Subset Select(std::vector<int> indices) const {
    Subset subset;
    subset.indices = std::move(indices);
    subset.has_directions = directions_ != nullptr;
    if (directions_ != nullptr) subset.directions.sigma_rad = directions_->sigma_rad;
    for (const int i : subset.indices) {
      subset.points.push_back(points_[static_cast<std::size_t>(i)]);
      if (directions_ != nullptr) {
        subset.directions.normals.push_back(directions_->normals[static_cast<std::size_t>(i)]);
      }
    }
    return subset;
  }

  // One ellipse after the other, each from the points that are left.
  void Collect(std::vector<FoundConic>* conics) const {
    std::vector<int> left(points_.size());
    std::iota(left.begin(), left.end(), 0);
    int num_blobs = 0;
    while (static_cast<int>(conics->size()) < options_.max_conics &&
           num_blobs <= options_.max_conics) {
      const Subset subset = Select(left);
      FoundConic found;
      std::vector<std::uint8_t> mask;
      const Status status = FitConicRobust(subset.points, options_.fit, &found.fit, &mask,
                                           options_.limits, subset.Directions());
      if (!status.ok()) break;
      bool is_blob = false;
      const bool stands = Judge(subset, mask, &found, &is_blob);
      if (!stands && !is_blob) break;
      left.clear();
      for (std::size_t i = 0; i < mask.size(); ++i) {
        if (mask[i] == 0) left.push_back(subset.indices[i]);
      }
      if (is_blob) {
        ++num_blobs;
      } else {
        conics->push_back(std::move(found));
      }
    }
  }

  // Lists the points of the mask; true if the ellipse stands on them.
  bool Judge(const Subset& subset, const std::vector<std::uint8_t>& mask, FoundConic* found,
             bool* is_blob) const {
    found->points.clear();
    for (std::size_t i = 0; i < mask.size(); ++i) {
      if (mask[i] != 0) found->points.push_back(subset.indices[i]);
    }
    const double threshold = options_.fit.ransac.threshold;
    const ConicModel model(subset.points, options_.limits);
    ConicModel::Value value;
    if (!model.FromConic(found->fit.conic, &value)) return false;
    *is_blob = model.IsBlob(value, threshold);
    const double n = static_cast<double>(subset.points.size());
    double expected =
        (n - static_cast<double>(found->points.size())) * model.BandShare(value, threshold);
    // Clutter may be denser here than elsewhere; the sides are twice as wide as the band.
    double beside = 0.0;
    for (int i = 0; i < model.NumData(); ++i) {
      const double distance = std::abs(model.Distance(value, i));
      beside += distance > threshold && distance <= 3.0 * threshold ? 1.0 : 0.0;
    }
    expected = std::max(expected, 0.5 * beside);
    const int sample = directions_ != nullptr ? 3 : 5;
    if (directions_ != nullptr) {
      expected *= std::min(1.0, 2.0 * kInlierSigmas * directions_->sigma_rad / kPi);
    }
    found->log_false_alarms =
        LogFalseAlarms(subset.points.size(), sample, expected, found->points.size());
    return !*is_blob && static_cast<int>(found->points.size()) >= options_.min_points &&
           found->log_false_alarms <= std::log(options_.max_false_alarms);
  }

  // Every point to the ellipse that it misses least, within the threshold.
  void Assign(std::vector<FoundConic>* conics) const {
    for (FoundConic& conic : *conics) conic.points.clear();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      double smallest = options_.fit.ransac.threshold;
      FoundConic* nearest = nullptr;
      for (FoundConic& conic : *conics) {
        const double distance = std::abs(ConicDistancePx(points_[i], conic.fit.conic));
        if (distance > smallest || !DirectionFits(i, conic.fit.conic)) continue;
        smallest = distance;
        nearest = &conic;
      }
      if (nearest != nullptr) nearest->points.push_back(static_cast<int>(i));
    }
  }

  bool DirectionFits(std::size_t i, const Eigen::Matrix3d& conic) const {
    if (directions_ == nullptr) return true;
    const Eigen::Vector2d& normal = directions_->normals[i];
    const Eigen::Vector3d gradient = conic * points_[i].Homogeneous();
    const Eigen::Vector2d across = points_[i].GradientPerPixel(gradient.head<2>());
    const double sine = across.x() * normal.y() - across.y() * normal.x();
    const double largest = kInlierSigmas * directions_->sigma_rad * across.norm() * normal.norm();
    return std::abs(sine) <= largest;
  }

  // Fits ellipse k to all points but those of the others; true if it stands on what it then has.
  bool Refit(const std::vector<FoundConic>& conics, std::size_t k, FoundConic* found) const {
    std::vector<std::uint8_t> taken(points_.size(), 0);
    for (std::size_t j = 0; j < conics.size(); ++j) {
      if (j == k) continue;
      for (const int i : conics[j].points) taken[static_cast<std::size_t>(i)] = 1;
    }
    std::vector<int> own;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (taken[i] == 0) own.push_back(static_cast<int>(i));
    }
    const Subset subset = Select(std::move(own));
    std::vector<std::uint8_t> mask;
    const Status status =
        RefitConicRobust(subset.points, options_.fit, found->fit.conic, &found->fit, &mask,
                         options_.limits, subset.Directions());
    bool is_blob = false;
    const bool stands = status.ok() && Judge(subset, mask, found, &is_blob);
    if (!stands) found->points.clear();  // They are free for the next ones.
    return stands;
  }

  const std::vector<CalibratedPoint>& points_;
  const EdgeDirections* directions_;
  const FindConicsOptions& options_;
};

}  // namespace

Status FindConicsOptions::Validate() const {
  if (max_conics < 0) return Status::Invalid("max_conics must not be negative");
  if (min_points < 6) return Status::Invalid("min_points must be 6 or more");
  if (!(max_false_alarms > 0.0)) return Status::Invalid("max_false_alarms must be positive");
  const Status status = fit.Validate();
  return status.ok() ? limits.Validate() : status;
}

Status FindConics(const std::vector<CalibratedPoint>& points, const FindConicsOptions& options,
                  std::vector<FoundConic>* conics, const EdgeDirections* directions) {
  conics->clear();
  Status status = options.Validate();
  if (status.ok() && directions != nullptr) status = directions->Validate(points.size());
  if (!status.ok()) return status;
  Finder(points, directions, options).Run(conics);
  return Status::Ok();
}

}  // namespace circline
