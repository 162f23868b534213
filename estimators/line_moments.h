// What points say about their line, summed up. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_LINE_MOMENTS_H_
#define CIRCLINE_ESTIMATORS_LINE_MOMENTS_H_

#include <Eigen/Core>
#include <cmath>

namespace circline {

// Weighted sums of points, about one near them so that nothing cancels.
class LineMoments {
 public:
  explicit LineMoments(const Eigen::Vector2d& about = Eigen::Vector2d::Zero()) : about_(about) {}

  void Add(const Eigen::Vector2d& point, double weight = 1.0) {
    const Eigen::Vector2d p = point - about_;
    ++count_;
    weight_ += weight;
    sum_ += weight * p;
    xx_ += weight * p.x() * p.x();
    xy_ += weight * p.x() * p.y();
    yy_ += weight * p.y() * p.y();
  }

  int count() const { return count_; }
  // Whether the points lie farther from their mean than this, root mean square.
  bool SpreadBeyond(double distance) const {
    const double mean_square = (xx_ + yy_ - sum_.squaredNorm() / weight_) / weight_;
    return weight_ > 0.0 && mean_square > distance * distance;
  }

  // Total least squares line, unit normal.
  Eigen::Vector3d Line() const {
    const Eigen::Vector2d mean = sum_ / weight_;
    const double xx = xx_ / weight_ - mean.x() * mean.x();
    const double xy = xy_ / weight_ - mean.x() * mean.y();
    const double yy = yy_ / weight_ - mean.y() * mean.y();
    const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);  // Of the direction.
    const Eigen::Vector2d normal(-std::sin(angle), std::cos(angle));
    return {normal.x(), normal.y(), -normal.dot(mean + about_)};
  }

 private:
  Eigen::Vector2d about_;
  int count_ = 0;
  double weight_ = 0.0;
  Eigen::Vector2d sum_ = Eigen::Vector2d::Zero();
  double xx_ = 0.0, xy_ = 0.0, yy_ = 0.0;
};

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_LINE_MOMENTS_H_
