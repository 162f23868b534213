#include "circline/ransac/detection/contour_support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// An edge point supports a contour if its gradient is within 25 degrees of the contour's normal.
constexpr double kMinNormalCosine = 0.906;
// Support must come in runs of this length, pixels (a tenth of the contour for small ellipses);
// holes of up to kMaxHolePx do not interrupt a run.
constexpr double kMinRunPx = 6.0;
constexpr double kMaxHolePx = 2.5;
constexpr double kFarPx = 1e6;

// To the nearest integer, for values within 2 kFarPx of 0; a tenth of the time of std::lround.
int Round(double x) { return static_cast<int>(x + (2e6 + 0.5)) - 2000000; }

}  // namespace

bool Contour::Project(const Matrix3d& conic, double min_axis_px, double max_axis_px) {
  Ellipse ellipse;
  if (!ConicToEllipse(conic, &ellipse)) return false;
  const double cosine = std::cos(ellipse.angle), sine = std::sin(ellipse.angle);
  center_ = ellipse.center;
  major_ = ellipse.a * Vector2d(cosine, sine);
  minor_ = ellipse.b * Vector2d(-sine, cosine);
  // Axes on the photo, from four points: good enough to bound sizes and to choose a spacing.
  std::array<Vector2d, 4> ends;
  if (!ToPixel(center_ + major_, &ends[0]) || !ToPixel(center_ + minor_, &ends[1]) ||
      !ToPixel(center_ - major_, &ends[2]) || !ToPixel(center_ - minor_, &ends[3])) {
    return false;
  }
  const double a = 0.5 * (ends[0] - ends[2]).norm(), b = 0.5 * (ends[1] - ends[3]).norm();
  major_px_ = std::max(a, b);
  minor_px_ = std::min(a, b);
  return minor_px_ >= min_axis_px && major_px_ <= max_axis_px;
}

bool Contour::SampleEvery(double spacing_px, std::vector<ContourSample>* samples,
                          int max_samples) const {
  const double h = (major_px_ - minor_px_) / (major_px_ + minor_px_);
  const double perimeter = kPi * (major_px_ + minor_px_) * (1.0 + 0.25 * h * h);  // Ramanujan, cut.
  return SampleCount(std::clamp(static_cast<int>(perimeter / spacing_px), 16, max_samples),
                     samples);
}

bool Contour::SampleCount(int n, std::vector<ContourSample>* samples) const {
  samples->resize(static_cast<std::size_t>(n));
  // The anomaly advances by rotation: its rounding error is far below a pixel for any n here.
  const double step_c = std::cos(2.0 * kPi / n), step_s = std::sin(2.0 * kPi / n);
  Vector2d anomaly(1.0, 0.0);
  for (ContourSample& s : *samples) {
    if (!ToPixel(center_ + anomaly.x() * major_ + anomaly.y() * minor_, &s.pixel)) return false;
    // Beyond what Round() takes: no part of a photo.
    if (!s.pixel.allFinite() || s.pixel.cwiseAbs().maxCoeff() >= kFarPx)
      s.pixel = Vector2d(-kFarPx, -kFarPx);
    anomaly = Vector2d(step_c * anomaly.x() - step_s * anomaly.y(),
                       step_s * anomaly.x() + step_c * anomaly.y());
  }
  ContourSample* before = &samples->back();
  for (std::size_t k = 0; k < samples->size(); ++k) {
    ContourSample* s = &(*samples)[k];
    const ContourSample& after = k + 1 < samples->size() ? s[1] : samples->front();
    const Vector2d along = after.pixel - before->pixel;
    const double length = along.norm();
    const double inverse = length > 0.0 ? 1.0 / length : 0.0;
    s->length = 0.5 * length;
    // The anomaly runs from +x towards +y, so that outward is on its right (y down).
    s->normal =
        length > 0.0 ? Vector2d(along.y() * inverse, -along.x() * inverse) : Vector2d(1.0, 0.0);
    before = s;
  }
  before = &samples->back();
  for (std::size_t k = 0; k < samples->size(); ++k) {
    ContourSample* s = &(*samples)[k];
    const ContourSample& after = k + 1 < samples->size() ? s[1] : samples->front();
    // Twice the sine is close enough to the angle for steps of a few degrees.
    s->turn = 0.5 * std::abs(Cross(before->normal, after.normal));
    before = s;
  }
  return true;
}

// A pinhole's projection is spelt out: sampling contours is what the detection of ellipses does
// most.
bool Contour::ToPixel(const Vector2d& x, Vector2d* pixel) const {
  if (camera_.model != CameraModel::kPinhole) {
    return CameraToPixel(camera_, Vector3d(x.x(), x.y(), 1.0), pixel);
  }
  *pixel = Vector2d(camera_.fx * x.x() + camera_.cx, camera_.fy * x.y() + camera_.cy);
  return true;
}

void EdgeCollector::Take(const std::vector<int>& points) {
  for (const int i : points) taken_[static_cast<std::size_t>(i)] = 1;
}

// The edge points in the pixels within `steps` of a sample along its normal, in order. Gathered
// before they are looked at: the photo is large, and so all its pixels are fetched at once.
int EdgeCollector::PointsAcross(const ContourSample& s, int steps,
                                std::array<int, 16>* points) const {
  std::size_t count = 0;
  double x = s.pixel.x() - steps * s.normal.x(), y = s.pixel.y() - steps * s.normal.y();
  for (int step = -steps; step <= steps; ++step) {
    const int i = map_.PointAt(Round(x), Round(y));
    (*points)[count] = i;
    count += i >= 0 ? 1U : 0U;
    x += s.normal.x();
    y += s.normal.y();
  }
  return static_cast<int>(count);
}

QuickSupport EdgeCollector::QuickLook(const std::vector<ContourSample>& samples,
                                      double reach) const {
  const int steps = std::min(static_cast<int>(reach + 0.5), kMaxSteps);
  std::array<int, 3> across{};
  int any = 0;
  std::array<int, 16> points;
  for (const ContourSample& s : samples) {
    bool outside = false, inside = false, found = false;
    const int count = PointsAcross(s, steps, &points);
    for (int k = 0; k < count; ++k) {
      const auto i = static_cast<std::size_t>(points[static_cast<std::size_t>(k)]);
      if (taken_[i]) continue;
      const double cosine = s.normal.dot(map_.points[i].Normal());
      found = true;
      outside = outside || cosine > kMinNormalCosine;
      inside = inside || cosine < -kMinNormalCosine;
    }
    across[0] += outside ? 1 : 0;
    across[1] += inside ? 1 : 0;
    across[2] += outside || inside ? 1 : 0;
    any += found ? 1 : 0;
  }
  const double n = static_cast<double>(samples.size());
  return {{across[0] / n, across[1] / n, across[2] / n}, any / n};
}

void EdgeCollector::Collect(const std::vector<ContourSample>& samples, BrightSide bright,
                            double reach, Support* support) {
  const std::size_t n = samples.size();
  nearest_.resize(n);
  for (std::size_t k = 0; k < n; ++k) nearest_[k] = Strongest(samples[k], bright, reach);
  FindRuns(samples);
  support->points.clear();
  support->perimeter_px = support->length_px = support->turn = 0.0;
  int last = -1;
  sines_.clear();
  for (std::size_t k = 0; k < n; ++k) {
    support->perimeter_px += samples[k].length;
    if (!in_run_[k]) continue;
    support->length_px += samples[k].length;
    support->turn += samples[k].turn;
    const int i = nearest_[k];
    if (i < 0 || i == last) continue;
    sines_.push_back(NormalMiss(samples[k], map_.points[static_cast<std::size_t>(i)]));
    support->points.push_back(i);
    last = i;
  }
  support->normal_median = Median(&sines_);
  Unique(&support->points);
}

// Angle between the gradient at an edge point and the contour's normal beside it, which has turned
// since the sample by curvature times distance.
double EdgeCollector::NormalMiss(const ContourSample& s, const EdgePoint& p) {
  const Vector2d tangent(-s.normal.y(), s.normal.x());
  const double curvature = s.turn / std::max(s.length, 1e-9);
  const double side = s.normal.dot(p.Normal()) < 0.0 ? -1.0 : 1.0;
  const double turned = curvature * tangent.dot(p.Position() - s.pixel);
  return std::abs(side * Cross(s.normal, p.Normal()) - turned);
}

// The free edge point near the contour at a sample with the right direction: of several the
// strongest, with allowance for distance, as shadows and fringes run beside rims; or -1.
int EdgeCollector::Strongest(const ContourSample& s, BrightSide bright, double reach) const {
  std::array<int, 16> points;
  const int count =
      PointsAcross(s, std::min(static_cast<int>(std::ceil(reach)), kMaxSteps), &points);
  int best = -1;
  double best_weight = 0.0;
  for (int k = 0; k < count; ++k) {
    const int i = points[static_cast<std::size_t>(k)];
    if (taken_[static_cast<std::size_t>(i)]) continue;
    const EdgePoint& p = map_.points[static_cast<std::size_t>(i)];
    const double cosine = s.normal.dot(p.Normal());  // 1: bright outside, -1: inside.
    if (std::abs(cosine) < kMinNormalCosine) continue;
    if (bright != BrightSide::kEither && (cosine < 0.0) != (bright == BrightSide::kInside))
      continue;
    const double d = s.normal.dot(p.Position() - s.pixel) / reach;
    const double weight = static_cast<double>(p.gradient) * (1.0 - d * d);
    if (weight > best_weight) {
      best_weight = weight;
      best = i;
    }
  }
  return best;
}

void EdgeCollector::AverageStrength(Support* support) {
  support->gradient = 0.0;
  sigmas_.clear();
  for (const int i : support->points) {
    const EdgePoint& p = map_.points[static_cast<std::size_t>(i)];
    support->gradient += static_cast<double>(p.gradient);
    sigmas_.push_back(static_cast<double>(p.sigma_px));
  }
  support->gradient /= std::max(1.0, static_cast<double>(support->points.size()));
  support->sigma_px = Median(&sigmas_);
}

// in_run_[k]: sample k lies in a supported run that is long enough, small holes closed.
void EdgeCollector::FindRuns(const std::vector<ContourSample>& samples) {
  const std::size_t n = samples.size();
  in_run_.assign(n, 0);
  double perimeter = 0.0;
  for (const ContourSample& s : samples) perimeter += s.length;
  const double min_run = std::min(kMinRunPx, 0.1 * perimeter);
  const std::size_t start = BehindHole(samples);
  if (start == n) {
    in_run_.assign(n, 1);
    return;
  }
  std::size_t run_begin = 0, run_end = 0;  // Offsets from start; the run found so far.
  double run = 0.0;
  double hole = std::numeric_limits<double>::infinity();
  const auto close = [&] {
    for (std::size_t j = run_begin; run >= min_run && j < run_end; ++j)
      in_run_[(start + j) % n] = 1;
  };
  for (std::size_t j = 0; j < n; ++j) {
    const ContourSample& s = samples[(start + j) % n];
    if (nearest_[(start + j) % n] < 0) {
      hole += s.length;
      continue;
    }
    if (hole > kMaxHolePx) {
      close();
      run_begin = j;
      run = 0.0;
    } else {
      run += hole;
    }
    run += s.length;
    run_end = j + 1;
    hole = 0.0;
  }
  close();
}

// Where to start, so that no run is cut by the start of the contour; n if there is no hole.
std::size_t EdgeCollector::BehindHole(const std::vector<ContourSample>& samples) const {
  const std::size_t n = samples.size();
  double hole = 0.0;
  for (std::size_t k = 0; k < 2 * n; ++k) {
    hole = nearest_[k % n] >= 0 ? 0.0 : hole + samples[k % n].length;
    if (hole > kMaxHolePx) return k % n;
  }
  return n;
}

// Removes repetitions, keeps the order.
void EdgeCollector::Unique(std::vector<int>* points) {
  stamp_.resize(map_.points.size(), 0);
  ++now_;
  const auto seen = [this](int i) {
    std::uint32_t& stamp = stamp_[static_cast<std::size_t>(i)];
    if (stamp == now_) return true;
    stamp = now_;
    return false;
  };
  points->erase(std::remove_if(points->begin(), points->end(), seen), points->end());
}

double Median(std::vector<double>* values) {
  if (values->empty()) return 0.0;
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

}  // namespace circline
