#include "circline/ransac/edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace circline {
namespace {

// Two points are neighbours on one edge only if their gradients agree within 50 degrees; a sharper
// turn over one or two pixels is a corner.
constexpr float kMinNeighbourCosine = 0.64f;
// A neighbour lies along the edge rather than beside it: its offset across the edge, pixels.
constexpr float kMaxNeighbourOffset = 1.0f;
// Neighbours are looked for in a window of radius 1, then of this: 2 bridges one missing pixel.
constexpr int kLinkRadius = 2;
// Rounding to grey levels is noise too: 1 / sqrt(12) of a level.
constexpr double kRoundingNoise = 0.29;
// Noise raises the thresholds by no more than this factor, lest a photo full of texture count as
// noise.
constexpr double kMaxThresholdRaise = 3.0;
// Localisation is never better than this, whatever the noise says: pixels are not points.
constexpr float kMinSigmaPx = 0.03f;

// Samples of a Gaussian and of its derivative; scaled so that a constant stays, and a ramp of slope
// one yields one.
void GaussianKernels(double sigma, cv::Mat* smooth, cv::Mat* derivative) {
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  smooth->create(1, 2 * radius + 1, CV_32F);
  derivative->create(1, 2 * radius + 1, CV_32F);
  double sum = 0.0, moment = 0.0;
  for (int i = -radius; i <= radius; ++i) {
    const double g = std::exp(-0.5 * i * i / (sigma * sigma));
    sum += g;
    moment += i * i * g;
  }
  for (int i = -radius; i <= radius; ++i) {
    const double g = std::exp(-0.5 * i * i / (sigma * sigma));
    smooth->at<float>(0, i + radius) = static_cast<float>(g / sum);
    derivative->at<float>(0, i + radius) = static_cast<float>(i * g / moment);
  }
}

// Standard deviation of the pixels' noise: the mask (1 -2 1; -2 4 -2; 1 -2 1) cancels whatever is
// locally quadratic and has norm 6 (Immerkaer, Fast noise variance estimation, CVIU 1996); the
// median of its response, 0.6745 standard deviations, is blind to edges.
double EstimateNoise(const cv::Mat& gray) {
  constexpr int kStep = 4;
  std::vector<int> sample;
  sample.reserve(gray.total() / (kStep * kStep) + 1);
  for (int y = 1; y + 1 < gray.rows; y += kStep) {
    const std::uint8_t* a = gray.ptr<std::uint8_t>(y - 1);
    const std::uint8_t* b = gray.ptr<std::uint8_t>(y);
    const std::uint8_t* c = gray.ptr<std::uint8_t>(y + 1);
    for (int x = 1; x + 1 < gray.cols; x += kStep) {
      const int corners = a[x - 1] + a[x + 1] + c[x - 1] + c[x + 1];
      const int sides = a[x] + c[x] + b[x - 1] + b[x + 1];
      sample.push_back(std::abs(corners - 2 * sides + 4 * b[x]));
    }
  }
  if (sample.empty()) return 0.0;
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  return std::max(kRoundingNoise, *middle / (0.6745 * 6.0));
}

// Of one component of the gradient, for white noise seen through the derivative of a Gaussian.
double GradientNoise(double pixel_noise, double smoothing) {
  return pixel_noise / (std::sqrt(8.0 * 3.14159265358979323846) * smoothing * smoothing);
}

double Threshold(double value, double factor, double noise) {
  return std::min(std::max(value, factor * noise), kMaxThresholdRaise * value);
}

// The vertex of the parabola through the logarithms of three samples of a squared gradient, in
// samples from the middle one, and the variance of the Gaussian that it stands for.
bool LocatePeak(float before, float middle, float after, float* offset, float* variance) {
  constexpr float kTiny = 1e-6f;  // The logarithm of zero, for a step between two pixels exactly.
  const float a = std::max(before, kTiny), c = std::max(after, kTiny);
  const float curvature = std::log(a * c / (middle * middle));
  if (!(curvature < 0.0f)) return false;
  *offset = 0.5f * std::log(a / c) / curvature;
  *variance = -2.0f / curvature;  // The squared gradient halves the variance of the gradient.
  return std::abs(*offset) <= 0.5f + 1e-6f;
}

// The maxima of the gradient across itself, one a pixel at most, row by row.
class PointFinder {
 public:
  PointFinder(const cv::Mat& gray, double smoothing, double low, double noise)
      : gray_(gray),
        low_squared_(static_cast<float>(low * low)),
        // Noise of the gradient's slope at its peak, from that of the gradient, for white noise
        // seen through a Gaussian: sqrt(3/2) / sigma.
        slope_noise_(static_cast<float>(noise * std::sqrt(1.5) / smoothing)) {
    GaussianKernels(smoothing, &smooth_, &derivative_);
    for (std::vector<float>& row : squared_) row.resize(static_cast<std::size_t>(gray.cols));
  }

  // The gradient is worked off in bands of rows, which stay in the processor's cache.
  void Find(std::vector<EdgePoint>* points, std::vector<std::int32_t>* index) {
    constexpr int kBandRows = 48;
    index->assign(gray_.total(), -1);
    points->reserve(gray_.total() / 8);  // A busy photo's.
    for (int y = 1; y + 1 < gray_.rows; y += kBandRows) {
      FindInBand(y, std::min(y + kBandRows, gray_.rows - 1), points, index);
    }
  }

 private:
  // Rows [begin, end). (Filters see the pixels beyond a range of rows.)
  void FindInBand(int begin, int end, std::vector<EdgePoint>* points,
                  std::vector<std::int32_t>* index) {
    top_ = begin - 1;
    const cv::Mat band = gray_.rowRange(top_, end + 1);
    cv::sepFilter2D(band, x_, CV_32F, derivative_, smooth_, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    cv::sepFilter2D(band, y_, CV_32F, smooth_, derivative_, {-1, -1}, 0.0, cv::BORDER_REPLICATE);
    Square(begin - 1);
    Square(begin);
    for (int y = begin; y < end; ++y) {
      Square(y + 1);
      FindInRow(y, index->data() + static_cast<std::ptrdiff_t>(y) * gray_.cols, points);
    }
  }

  // Rows of the gradient's components, and of its squared length: the last three squared.
  const float* X(int y) const { return x_.ptr<float>(y - top_); }
  const float* Y(int y) const { return y_.ptr<float>(y - top_); }
  float* Squared(int y) { return squared_[static_cast<std::size_t>(y % 3)].data(); }

  void Square(int y) {
    const float* gx = X(y);
    const float* gy = Y(y);
    float* out = Squared(y);
    for (int x = 0; x < gray_.cols; ++x) out[x] = gx[x] * gx[x] + gy[x] * gy[x];
  }

  void FindInRow(int y, std::int32_t* index, std::vector<EdgePoint>* points) {
    const float* gx = X(y);
    const float* gy = Y(y);
    const float* above = Squared(y - 1);
    const float* s = Squared(y);
    const float* below = Squared(y + 1);
    for (int x = 1; x + 1 < gray_.cols; ++x) {
      if (s[x] < low_squared_) continue;
      const bool horizontal = std::abs(gx[x]) >= std::abs(gy[x]);
      const float before = horizontal ? s[x - 1] : above[x];
      const float after = horizontal ? s[x + 1] : below[x];
      if (!(s[x] > before && s[x] >= after)) continue;
      float offset, variance;
      if (!LocatePeak(before, s[x], after, &offset, &variance)) continue;
      index[x] = static_cast<std::int32_t>(points->size());
      points->push_back(MakePoint(x, y, horizontal, offset, variance, std::sqrt(s[x])));
    }
  }

  EdgePoint MakePoint(int x, int y, bool horizontal, float offset, float variance,
                      float length) const {
    EdgePoint point;
    point.x = static_cast<float>(x) + (horizontal ? offset : 0.0f);
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
    point.sigma_px = std::max(kMinSigmaPx, slope_noise_ * variance / length);
    return point;
  }

  const cv::Mat& gray_;
  const float low_squared_;
  const float slope_noise_;
  cv::Mat smooth_, derivative_;
  cv::Mat x_, y_;  // Of a band, 32-bit float, grey levels per pixel.
  int top_ = 0;    // The photo's row that is the band's first.
  std::array<std::vector<float>, 3> squared_;
};

// For each point the next and the previous one along its edge, or -1.
struct Links {
  std::vector<std::int32_t> next, previous;
};

// The nearest point ahead of `i` in the window of `radius`, walking with the brighter side on the
// left, or -1.
std::int32_t NearestAhead(const EdgeMap& map, std::int32_t i, int radius, float* distance) {
  const EdgePoint& p = map.points[static_cast<std::size_t>(i)];
  const float tx = -p.ny, ty = p.nx;
  const int px = static_cast<int>(p.x + 0.5f), py = static_cast<int>(p.y + 0.5f);
  std::int32_t best = -1;
  float best_distance = 1e9f;
  for (int y = std::max(py - radius, 0); y <= std::min(py + radius, map.height - 1); ++y) {
    const std::int32_t* row = map.index.data() + static_cast<std::ptrdiff_t>(y) * map.width;
    for (int x = std::max(px - radius, 0); x <= std::min(px + radius, map.width - 1); ++x) {
      const std::int32_t j = row[x];
      if (j < 0 || j == i) continue;
      const EdgePoint& q = map.points[static_cast<std::size_t>(j)];
      const float dx = q.x - p.x, dy = q.y - p.y;
      const float ahead = dx * tx + dy * ty;
      const float d = dx * dx + dy * dy;
      if (ahead <= 0.0f || d >= best_distance) continue;
      if (p.nx * q.nx + p.ny * q.ny < kMinNeighbourCosine) continue;
      if (std::abs(dx * p.nx + dy * p.ny) > kMaxNeighbourOffset + 0.5f * ahead) continue;
      // Seen from the other side it must lie behind.
      if (dx * -q.ny + dy * q.nx <= 0.0f) continue;
      best = j;
      best_distance = d;
    }
  }
  *distance = best_distance;
  return best;
}

std::int32_t NearestAhead(const EdgeMap& map, std::int32_t i, float* distance) {
  const std::int32_t adjacent = NearestAhead(map, i, 1, distance);
  return adjacent >= 0 ? adjacent : NearestAhead(map, i, kLinkRadius, distance);
}

// Every point points to the nearest ahead; of several that point to the same, the nearest keeps it.
Links LinkPoints(const EdgeMap& map) {
  const std::size_t n = map.points.size();
  Links links{std::vector<std::int32_t>(n, -1), std::vector<std::int32_t>(n, -1)};
  std::vector<float> distance_to_previous(n, 1e9f);
  for (std::size_t i = 0; i < n; ++i) {
    float d;
    const std::int32_t j = NearestAhead(map, static_cast<std::int32_t>(i), &d);
    if (j < 0) continue;
    const auto target = static_cast<std::size_t>(j);
    if (d >= distance_to_previous[target]) continue;
    if (links.previous[target] >= 0)
      links.next[static_cast<std::size_t>(links.previous[target])] = -1;
    links.previous[target] = static_cast<std::int32_t>(i);
    links.next[i] = j;
    distance_to_previous[target] = d;
  }
  return links;
}

// Walks the links and keeps the chains that are long and strong enough, renumbering the points.
class ChainBuilder {
 public:
  ChainBuilder(const Links& links, float high, int min_points, EdgeMap* map)
      : links_(links), high_(high), min_points_(min_points), map_(map) {}

  void Build() {
    const std::size_t n = map_->points.size();
    renumbered_.assign(n, -1);
    seen_.assign(n, 0);
    kept_.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      if (links_.previous[i] < 0) Walk(static_cast<std::int32_t>(i), false);
    }
    for (std::size_t i = 0; i < n; ++i) Walk(static_cast<std::int32_t>(i), true);  // Loops remain.
    for (std::int32_t& i : map_->index) {
      if (i >= 0) i = renumbered_[static_cast<std::size_t>(i)];
    }
    map_->points = std::move(kept_);
  }

 private:
  void Walk(std::int32_t start, bool closed) {
    if (seen_[static_cast<std::size_t>(start)]) return;
    walk_.clear();
    float strongest = 0.0f;
    for (std::int32_t i = start; i >= 0 && !seen_[static_cast<std::size_t>(i)];
         i = links_.next[static_cast<std::size_t>(i)]) {
      seen_[static_cast<std::size_t>(i)] = 1;
      walk_.push_back(i);
      strongest = std::max(strongest, map_->points[static_cast<std::size_t>(i)].gradient);
    }
    if (strongest < high_ || static_cast<int>(walk_.size()) < min_points_) return;
    EdgeChain chain;
    chain.begin = static_cast<int>(kept_.size());
    chain.closed = closed;
    for (const std::int32_t i : walk_) {
      renumbered_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(kept_.size());
      kept_.push_back(map_->points[static_cast<std::size_t>(i)]);
    }
    chain.end = static_cast<int>(kept_.size());
    map_->chains.push_back(chain);
  }

  const Links& links_;
  const float high_;
  const int min_points_;
  EdgeMap* map_;
  std::vector<std::int32_t> renumbered_, walk_;
  std::vector<std::uint8_t> seen_;
  std::vector<EdgePoint> kept_;
};

}  // namespace

Status EdgeOptions::Validate() const {
  if (!(smoothing_px >= 0.5 && smoothing_px <= 5.0)) {
    return Status::Invalid("smoothing_px must be in [0.5, 5]");
  }
  if (!(low_gradient > 0.0)) return Status::Invalid("low_gradient must be positive");
  if (!(high_gradient >= low_gradient)) {
    return Status::Invalid("high_gradient must be low_gradient or more");
  }
  if (!(low_noise_factor >= 0.0)) return Status::Invalid("low_noise_factor must not be negative");
  if (!(high_noise_factor >= 0.0)) return Status::Invalid("high_noise_factor must not be negative");
  if (min_chain_points < 2) return Status::Invalid("min_chain_points must be 2 or more");
  return Status::Ok();
}

Status ToGray(const cv::Mat& image, cv::Mat* gray) {
  if (image.empty()) return Status::Invalid("the image is empty");
  if (image.dims != 2 || image.depth() != CV_8U) {
    return Status::Invalid("the image must have 8 bits a channel");
  }
  switch (image.channels()) {
    case 1:
      *gray = image;
      return Status::Ok();
    case 3:
      cv::cvtColor(image, *gray, cv::COLOR_BGR2GRAY);
      return Status::Ok();
    case 4:
      cv::cvtColor(image, *gray, cv::COLOR_BGRA2GRAY);
      return Status::Ok();
    default:
      return Status::Invalid("the image must have 1, 3 or 4 channels, not " +
                             std::to_string(image.channels()));
  }
}

double CurvatureBias(const EdgePoint& point, double blur_px, double curvature) {
  const double cosine = static_cast<double>(std::max(std::abs(point.nx), std::abs(point.ny)));
  const double along =
      static_cast<double>(std::abs(point.nx) >= std::abs(point.ny) ? point.x : point.y);
  const double offset = along - std::round(along);
  // The profile across a bent edge is wider than the Gaussian by 1 + k^2 s^2 / 2.
  const double width = blur_px * blur_px;
  const double variance = width / (1.0 + 0.5 * curvature * curvature * width);
  return 0.5 * curvature * (variance + (1.0 - cosine * cosine) * (1.0 - 3.0 * offset * offset));
}

Status DetectEdges(const cv::Mat& gray, const EdgeOptions& options, EdgeMap* edges) {
  *edges = EdgeMap();
  const Status status = options.Validate();
  if (!status.ok()) return status;
  if (gray.empty()) return Status::Invalid("the image is empty");
  if (gray.type() != CV_8UC1) return Status::Invalid("edges need an 8-bit grey image");
  edges->width = gray.cols;
  edges->height = gray.rows;
  edges->gray = gray;
  const double noise = GradientNoise(EstimateNoise(gray), options.smoothing_px);
  edges->gradient_noise = noise;
  const double low = Threshold(options.low_gradient, options.low_noise_factor, noise);
  const double high =
      std::max(low, Threshold(options.high_gradient, options.high_noise_factor, noise));
  PointFinder(gray, options.smoothing_px, low, noise).Find(&edges->points, &edges->index);
  ChainBuilder(LinkPoints(*edges), static_cast<float>(high), options.min_chain_points, edges)
      .Build();
  return Status::Ok();
}

}  // namespace circline
