// Where the gradient of the smoothed photo is largest across itself, to a fraction of a pixel.

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/hal/hal.hpp>
#include <opencv2/imgproc.hpp>

#include "circline/ransac/detection/edges.h"

namespace circline {
namespace {

// Localisation is never better than this, whatever the noise says: pixels are not points.
constexpr float kMinPointSigmaPx = 0.03f;

// Samples of a Gaussian and of its derivative; scaled so that a constant stays, and a ramp of slope
// one yields one.
void GaussianKernels(double sigma, cv::Mat* smooth, cv::Mat* derivative) {
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  *smooth = cv::getGaussianKernel(2 * radius + 1, sigma, CV_32F);
  *derivative = smooth->clone();
  double moment = 0.0;
  for (int i = -radius; i <= radius; ++i) {
    float& value = derivative->at<float>(i + radius);
    value *= static_cast<float>(i);
    moment += static_cast<double>(value) * i;
  }
  *derivative /= moment;
}

// The maxima of the gradient across itself, one a pixel at most, row by row.
class PointFinder {
 public:
  PointFinder(double smoothing, double low, EdgeMap* map)
      : map_(*map),
        low_squared_(static_cast<float>(low * low)),
        // Noise of the gradient's slope at its peak, from that of the gradient, for white noise
        // seen through a Gaussian: sqrt(3/2) / sigma.
        slope_noise_(static_cast<float>(map->gradient_noise * std::sqrt(1.5) / smoothing)) {
    GaussianKernels(smoothing, &smooth_, &derivative_);
    for (std::vector<float>& row : squared_) row.resize(static_cast<std::size_t>(map_.width));
  }

  // The gradient is worked off in bands of rows, which stay in the processor's cache.
  std::vector<std::int32_t> Find(const std::vector<cv::Rect>& within) {
    constexpr int kBandRows = 48;
    map_.index.assign(map_.gray.total(), -1);
    int area = 0;
    for (const cv::Rect& box : within) area += box.area();
    const auto room = static_cast<std::size_t>(area / 4);  // More than a busy photo's.
    map_.points.reserve(room);
    pixels_.reserve(room);
    for (const cv::Rect& box : within) {
      const cv::Rect inside = box & cv::Rect(1, 1, map_.width - 2, map_.height - 2);
      if (inside.empty()) continue;
      left_ = inside.x - 1;
      cols_ = inside.width + 2;
      const int bottom = inside.y + inside.height;
      for (int y = inside.y; y < bottom; y += kBandRows) {
        FindInBand(y, std::min(y + kBandRows, bottom));
      }
    }
    return std::move(pixels_);
  }

 private:
  // Rows [begin, end) of the columns at hand. (Filters see the pixels beyond.)
  void FindInBand(int begin, int end) {
    top_ = begin - 1;
    const cv::Mat band = map_.gray(cv::Rect(left_, top_, cols_, end + 1 - top_));
    cv::sepFilter2D(band, x_, CV_32F, derivative_, smooth_, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    cv::sepFilter2D(band, y_, CV_32F, smooth_, derivative_, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    Square(begin - 1);
    Square(begin);
    for (int y = begin; y < end; ++y) {
      Square(y + 1);
      FindInRow(y);
    }
  }

  // Rows of the gradient's components, and of its squared length: the last three squared. Columns
  // are counted from left_.
  const float* X(int y) const { return x_.ptr<float>(y - top_); }
  const float* Y(int y) const { return y_.ptr<float>(y - top_); }
  float* Squared(int y) { return squared_[static_cast<std::size_t>(y % 3)].data(); }

  void Square(int y) {
    const float* gx = X(y);
    const float* gy = Y(y);
    float* out = Squared(y);
    for (int x = 0; x < cols_; ++x) out[x] = gx[x] * gx[x] + gy[x] * gy[x];
  }

  bool IsHorizontal(int x, int y) const { return std::abs(X(y)[x]) >= std::abs(Y(y)[x]); }

  void FindInRow(int y) {
    constexpr float kTiny = 1e-6f;  // The logarithm of zero, for a step between two pixels exactly.
    const float* s = Squared(y);
    const float* above = Squared(y - 1);
    const float* below = Squared(y + 1);
    columns_.clear();
    before_.clear();
    after_.clear();
    for (int x = 1; x + 1 < cols_; ++x) {
      if (s[x] < low_squared_) continue;
      const bool horizontal = IsHorizontal(x, y);
      const float before = horizontal ? s[x - 1] : above[x];
      const float after = horizontal ? s[x + 1] : below[x];
      if (s[x] <= before || s[x] < after) continue;
      const float inverse = 1.0f / s[x];
      columns_.push_back(x);
      before_.push_back(inverse * std::max(before, kTiny));
      after_.push_back(inverse * std::max(after, kTiny));
    }
    const int count = static_cast<int>(columns_.size());
    cv::hal::log32f(before_.data(), before_.data(), count);
    cv::hal::log32f(after_.data(), after_.data(), count);
    const std::int32_t row = y * map_.width + left_;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      float offset, variance;
      if (!LocatePeak(before_[i], after_[i], &offset, &variance)) continue;
      const int x = columns_[i];
      map_.index[static_cast<std::size_t>(row + x)] = static_cast<std::int32_t>(map_.points.size());
      pixels_.push_back(row + x);
      map_.points.push_back(MakePoint(x, y, offset, variance, std::sqrt(s[x])));
    }
  }

  // The vertex of the parabola through the logarithms of three samples of a squared gradient, those
  // before and after relative to the middle one: its place in samples from there, and the variance
  // of the Gaussian that it stands for.
  static bool LocatePeak(float before, float after, float* offset, float* variance) {
    const float curvature = before + after;
    if (!(curvature < 0.0f)) return false;
    *offset = 0.5f * (before - after) / curvature;
    *variance = -2.0f / curvature;  // The squared gradient halves the variance of the gradient.
    return std::abs(*offset) <= 0.5f + 1e-6f;
  }

  EdgePoint MakePoint(int x, int y, float offset, float variance, float length) const {
    const bool horizontal = IsHorizontal(x, y);
    EdgePoint point;
    point.x = static_cast<float>(left_ + x) + (horizontal ? offset : 0.0f);
    point.y = static_cast<float>(y) + (horizontal ? 0.0f : offset);
    const float gx = X(y)[x], gy = Y(y)[x];
    // The gradient at the point, between the pixel and its neighbour.
    const int side = offset < 0.0f ? -1 : 1;
    const int x1 = horizontal ? x + side : x, y1 = horizontal ? y : y + side;
    const float t = std::abs(offset);
    const float nx = (1.0f - t) * gx + t * X(y1)[x1];
    const float ny = (1.0f - t) * gy + t * Y(y1)[x1];
    const float norm = std::sqrt(nx * nx + ny * ny);
    if (norm > 0.0f) {
      point.nx = nx / norm;
      point.ny = ny / norm;
    }
    point.gradient = length;
    // Across the edge rather than along the axis.
    const float cosine = std::max(std::abs(gx), std::abs(gy)) / length;
    variance *= cosine * cosine;
    point.blur_px = std::sqrt(variance);
    point.sigma_px = std::max(kMinPointSigmaPx, slope_noise_ * variance / length);
    return point;
  }

  EdgeMap& map_;
  const float low_squared_;
  const float slope_noise_;
  cv::Mat smooth_, derivative_;
  cv::Mat x_, y_;            // Of a band, 32-bit float, grey levels per pixel.
  int top_ = 0;              // The photo's row that is the band's first.
  int left_ = 0, cols_ = 0;  // The photo's column that is the band's first, and its columns.
  std::array<std::vector<float>, 3> squared_;
  // Of a row: columns of maxima, and the squared gradients (then their logarithms) before and after
  // each, relative to its own.
  std::vector<int> columns_;
  std::vector<float> before_, after_;
  std::vector<std::int32_t> pixels_;
};

}  // namespace

std::vector<std::int32_t> FindEdgePoints(double smoothing_px, double low,
                                         const std::vector<cv::Rect>* within, EdgeMap* map) {
  const std::vector<cv::Rect> all = {cv::Rect({}, map->gray.size())};
  return PointFinder(smoothing_px, low, map).Find(within != nullptr ? *within : all);
}

}  // namespace circline
