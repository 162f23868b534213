#include "circline/ransac/detection/ellipses/contour_support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/statistics.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Support must come in runs of this length, pixels (a tenth of the contour for small ellipses);
// holes of up to kMaxHolePx do not interrupt a run.
constexpr double kMinRunPx = 6.0;
constexpr double kMaxHolePx = 2.5;
constexpr double kFarPx = 1e6;

// To the nearest integer, for values within 2 kFarPx of 0; a tenth of the time of std::lround.
int Round(double x) { return static_cast<int>(x + (2e6 + 0.5)) - 2000000; }

// Inverts those runs of `value` around the contour that are no longer than `longest` pixels.
void FlipShortRuns(const std::vector<ContourSample>& samples, std::uint8_t value, double longest,
                   std::vector<std::uint8_t>* flags) {
  const std::size_t n = flags->size();
  const auto flag = [&](std::size_t k) -> std::uint8_t& { return (*flags)[k % n]; };
  std::size_t start = 0;  // Of a run, so that none is cut.
  while (start < n && !(flag(start) == value && flag(start + n - 1) != value)) ++start;
  if (start == n) return;  // One run all around, or none.
  for (std::size_t begin = start; begin < start + n;) {
    double length = 0.0;
    std::size_t end = begin;
    for (; flag(end) == value; ++end) length += samples[end % n].length;
    for (std::size_t k = begin; k < end && length <= longest; ++k) flag(k) = value == 0 ? 1 : 0;
    for (begin = end; begin < start + n && flag(begin) != value;) ++begin;
  }
}

// Angle between the gradient at an edge point and the contour's normal beside it, which has turned
// since the sample by curvature times distance.
double NormalDeviation(const ContourSample& s, const EdgePoint& p) {
  const Vector2d tangent(-s.normal.y(), s.normal.x());
  const double curvature = s.turn / std::max(s.length, 1e-9);
  const double side = s.normal.dot(p.Normal()) < 0.0 ? -1.0 : 1.0;
  const double turned = curvature * tangent.dot(p.Position() - s.pixel);
  return std::abs(side * Cross(s.normal, p.Normal()) - turned);
}

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
  const auto neighbour = [samples, n](int k) -> ContourSample& {
    return (*samples)[static_cast<std::size_t>(k < 0 ? k + n : k < n ? k : k - n)];
  };
  for (int k = 0; k < n; ++k) {
    const Vector2d along = neighbour(k + 1).pixel - neighbour(k - 1).pixel;
    const double length = along.norm();
    ContourSample& s = neighbour(k);
    s.length = 0.5 * length;
    // The anomaly runs from +x towards +y, so that outward is on its right (y down).
    s.normal =
        length > 0.0 ? Vector2d(along.y() / length, -along.x() / length) : Vector2d(1.0, 0.0);
  }
  for (int k = 0; k < n; ++k) {
    // Twice the sine is close enough to the angle for steps of a few degrees.
    neighbour(k).turn = 0.5 * std::abs(Cross(neighbour(k - 1).normal, neighbour(k + 1).normal));
  }
  return true;
}

bool Contour::ToPixel(const Vector2d& x, Vector2d* pixel) const {
  return CameraToPixel(camera_, Vector3d(x.x(), x.y(), 1.0), pixel);
}

void EdgeCollector::Take(const std::vector<int>& points) {
  for (const int i : points) taken_[static_cast<std::size_t>(i)] = 1;
}

void EdgeCollector::Release(const std::vector<int>& points) {
  for (const int i : points) taken_[static_cast<std::size_t>(i)] = 0;
}

double EdgeCollector::QuickLook(const std::vector<ContourSample>& samples, BrightSide bright,
                                double reach) const {
  const auto hits = std::count_if(samples.begin(), samples.end(), [&](const ContourSample& s) {
    return Strongest(s, bright, reach) >= 0;
  });
  return static_cast<double>(hits) / static_cast<double>(samples.size());
}

void EdgeCollector::Collect(const std::vector<ContourSample>& samples, BrightSide bright,
                            double reach, Support* support) {
  const std::size_t n = samples.size();
  nearest_.resize(n);
  in_run_.resize(n);
  support->perimeter_px = support->length_px = support->turn = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    nearest_[k] = Strongest(samples[k], bright, reach);
    in_run_[k] = nearest_[k] >= 0 ? 1 : 0;
    support->perimeter_px += samples[k].length;
  }
  FlipShortRuns(samples, 0, kMaxHolePx, &in_run_);
  FlipShortRuns(samples, 1, std::min(kMinRunPx, 0.1 * support->perimeter_px), &in_run_);
  support->points.clear();
  std::vector<double> deviations;
  int last = -1;
  for (std::size_t k = 0; k < n; ++k) {
    if (!in_run_[k]) continue;
    support->length_px += samples[k].length;
    support->turn += samples[k].turn;
    const int i = nearest_[k];
    if (i < 0 || i == last) continue;
    last = i;
    deviations.push_back(NormalDeviation(samples[k], map_.points[static_cast<std::size_t>(i)]));
    std::uint8_t& is_in = in_support_[static_cast<std::size_t>(i)];
    if (is_in == 0) support->points.push_back(i);
    is_in = 1;
  }
  std::vector<double> sigmas;
  support->gradient = 0.0;
  for (const int i : support->points) {
    in_support_[static_cast<std::size_t>(i)] = 0;
    const EdgePoint& p = map_.points[static_cast<std::size_t>(i)];
    support->gradient += static_cast<double>(p.gradient);
    sigmas.push_back(static_cast<double>(p.sigma_px));
  }
  support->gradient /= std::max(1.0, static_cast<double>(support->points.size()));
  support->sigma_px = Median(std::move(sigmas));
  support->normal_median = Median(std::move(deviations));
}

// The free edge point near the contour at a sample with the right direction: of several the
// strongest, with allowance for distance, as shadows and fringes run beside rims; or -1. Points are
// gathered before they are looked at: the photo is large, and so all its pixels are fetched at
// once.
int EdgeCollector::Strongest(const ContourSample& s, BrightSide bright, double reach) const {
  constexpr int kMaxSteps = 7;
  const int steps = std::min(static_cast<int>(std::ceil(reach)), kMaxSteps);
  std::array<int, 2 * kMaxSteps + 2> points;
  std::size_t count = 0;
  for (int step = -steps; step <= steps; ++step) {
    const Vector2d p = s.pixel + step * s.normal;
    points[count] = map_.PointAt(Round(p.x()), Round(p.y()));
    count += points[count] >= 0 ? 1U : 0U;
  }
  int best = -1;
  double best_weight = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const int i = points[k];
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

}  // namespace circline
