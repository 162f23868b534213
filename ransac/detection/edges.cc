#include "circline/ransac/detection/edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

// Weakest gradient of an edge point, and the one that at least one point of a chain must reach,
// grey levels (of 255) per pixel; a step of 100 levels in a sharp photo has about 35. Both are
// raised to multiples of the gradient's noise where the photo is noisy.
constexpr double kLowGradient = 2.5, kHighGradient = 5.0;
constexpr double kLowNoiseFactor = 3.0, kHighNoiseFactor = 5.0;
constexpr int kMinChainPoints = 6;  // Shorter chains are dropped.
// Rounding to grey levels is noise too: 1 / sqrt(12) of a level.
constexpr double kRoundingNoise = 0.29;
// Noise raises the thresholds by no more than this factor, lest a photo full of texture count as
// noise.
constexpr double kMaxThresholdRaise = 3.0;

// Standard deviation of the pixels' noise: the mask (1 -2 1; -2 4 -2; 1 -2 1) cancels whatever is
// locally quadratic and has norm 6 (Immerkaer, Fast noise variance estimation, CVIU 1996); the
// median of its response, 0.6745 standard deviations, is blind to edges.
double EstimateNoise(const cv::Mat& gray) {
  constexpr int kStep = 4;
  constexpr std::size_t kLargest = 8 * 255;
  std::array<int, kLargest + 1> histogram{};
  int count = 0;
  for (int y = 1; y + 1 < gray.rows; y += kStep) {
    const std::uint8_t* a = gray.ptr<std::uint8_t>(y - 1);
    const std::uint8_t* b = gray.ptr<std::uint8_t>(y);
    const std::uint8_t* c = gray.ptr<std::uint8_t>(y + 1);
    for (int x = 1; x + 1 < gray.cols; x += kStep, ++count) {
      const int corners = a[x - 1] + a[x + 1] + c[x - 1] + c[x + 1];
      const int sides = a[x] + c[x] + b[x - 1] + b[x + 1];
      ++histogram[static_cast<std::size_t>(std::abs(corners - 2 * sides + 4 * b[x]))];
    }
  }
  if (count == 0) return 0.0;
  int median = 0;
  for (int below = histogram[0]; below <= count / 2;) {
    below += histogram[static_cast<std::size_t>(++median)];
  }
  return std::max(kRoundingNoise, median / (0.6745 * 6.0));
}

// Of one component of the gradient, for white noise seen through the derivative of a Gaussian.
double GradientNoise(double pixel_noise, double smoothing) {
  return pixel_noise / (std::sqrt(8.0 * kPi) * smoothing * smoothing);
}

double RaiseToNoise(double value, double factor, double noise) {
  return std::min(std::max(value, factor * noise), kMaxThresholdRaise * value);
}

// Two points are neighbours on one edge only if their gradients agree within 50 degrees; a sharper
// turn over one or two pixels is a corner.
constexpr float kMinNeighbourCosine = 0.64f;
// A neighbour lies along the edge rather than beside it: its offset across the edge, pixels.
constexpr float kMaxNeighbourOffset = 1.0f;

// For each point the next and the previous one along its edge, or -1.
struct Links {
  std::vector<std::int32_t> next, previous;
};

// The pixels of the square frame at `radius` around a pixel, as steps through the index.
std::vector<std::int32_t> FrameSteps(int radius, int width) {
  std::vector<std::int32_t> steps;
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      if (std::max(std::abs(dx), std::abs(dy)) == radius) steps.push_back(dy * width + dx);
    }
  }
  return steps;
}

float SquaredDistance(const EdgePoint& p, const EdgePoint& q) {
  const float dx = q.x - p.x, dy = q.y - p.y;
  return dx * dx + dy * dy;
}

// Whether q follows p along one edge.
bool IsAhead(const EdgePoint& p, const EdgePoint& q) {
  const float dx = q.x - p.x, dy = q.y - p.y;
  const float ahead = dy * p.nx - dx * p.ny;
  const float ahead_of_q = dy * q.nx - dx * q.ny;  // Seen from there p must lie behind.
  const float offset = std::abs(dx * p.nx + dy * p.ny);
  const float cosine = p.nx * q.nx + p.ny * q.ny;
  return ahead > 0.0f && ahead_of_q > 0.0f && cosine >= kMinNeighbourCosine &&
         offset <= kMaxNeighbourOffset + 0.5f * ahead;
}

// The nearest point ahead of p in the pixels `steps` from its own; -1 if there is none.
std::int32_t NearestAhead(const EdgeMap& map, const EdgePoint& p, std::int32_t pixel,
                          const std::vector<std::int32_t>& steps) {
  std::int32_t nearest = -1;
  float smallest = std::numeric_limits<float>::infinity();
  for (const std::int32_t step : steps) {
    const std::int32_t j = map.index[static_cast<std::size_t>(pixel + step)];
    if (j < 0) continue;
    const EdgePoint& q = map.points[static_cast<std::size_t>(j)];
    const float distance = SquaredDistance(p, q);
    if (distance >= smallest || !IsAhead(p, q)) continue;
    nearest = j;
    smallest = distance;
  }
  return nearest;
}

// Every point points to the nearest ahead, walking with the brighter side on the left; of several
// that point to the same, the nearest keeps it.
Links LinkPoints(const EdgeMap& map, const std::vector<std::int32_t>& pixels) {
  const std::vector<std::int32_t> adjacent = FrameSteps(1, map.width);
  const std::vector<std::int32_t> around = FrameSteps(2, map.width);
  const std::size_t n = map.points.size();
  Links links{std::vector<std::int32_t>(n, -1), std::vector<std::int32_t>(n, -1)};
  for (std::size_t i = 0; i < n; ++i) {
    const EdgePoint& p = map.points[i];
    const std::int32_t pixel = pixels[i];
    std::int32_t ahead = NearestAhead(map, p, pixel, adjacent);
    // The pixels around the adjacent ones bridge one missing pixel. (To the left and right, a step
    // beyond the end of a row leads to another's outermost pixel, which holds no point.)
    const bool has_rows = pixel >= 3 * map.width && pixel < (map.height - 3) * map.width;
    if (ahead < 0 && has_rows) ahead = NearestAhead(map, p, pixel, around);
    if (ahead < 0) continue;
    const EdgePoint& q = map.points[static_cast<std::size_t>(ahead)];
    std::int32_t& previous = links.previous[static_cast<std::size_t>(ahead)];
    if (previous >= 0) {
      const auto rival = static_cast<std::size_t>(previous);
      if (SquaredDistance(p, q) >= SquaredDistance(map.points[rival], q)) continue;
      links.next[rival] = -1;
    }
    previous = static_cast<std::int32_t>(i);
    links.next[i] = ahead;
  }
  return links;
}

constexpr std::int32_t kNone = -1;

// Walks the links and appends the chains of at least kMinChainPoints with at least one gradient of
// `high`. Returns the new place of each of their points; kNone for the others.
std::vector<std::int32_t> ListChains(const Links& links, float high, EdgeMap* map) {
  constexpr std::int32_t kNotSeen = -2;
  const auto n = static_cast<std::int32_t>(map->points.size());
  std::vector<std::int32_t> places(map->points.size(), kNotSeen);
  const auto place = [&](std::int32_t i) -> std::int32_t& {
    return places[static_cast<std::size_t>(i)];
  };
  const auto next = [&](std::int32_t i) { return links.next[static_cast<std::size_t>(i)]; };
  std::int32_t kept = 0;
  const auto walk = [&](std::int32_t start) {
    int length = 0;
    float strongest = 0.0f;
    for (std::int32_t i = start; i >= 0 && place(i) == kNotSeen; i = next(i), ++length) {
      place(i) = kNone;
      strongest = std::max(strongest, map->points[static_cast<std::size_t>(i)].gradient);
    }
    if (length < kMinChainPoints || strongest < high) return;
    map->chains.push_back({kept, kept + length});
    for (std::int32_t i = start; length > 0; i = next(i), --length) place(i) = kept++;
  };
  for (std::int32_t i = 0; i < n; ++i) {
    if (links.previous[static_cast<std::size_t>(i)] < 0) walk(i);
  }
  for (std::int32_t i = 0; i < n; ++i) walk(i);  // Loops remain.
  return places;
}

// Links the points of `map`, which are in any order, point i in pixel `pixels[i]` of its index and
// none in the outermost pixels, into chains; then points are in order chain by chain, and those of
// none are gone.
void ChainEdgePoints(const std::vector<std::int32_t>& pixels, double high, EdgeMap* map) {
  const std::vector<std::int32_t> places =
      ListChains(LinkPoints(*map, pixels), static_cast<float>(high), map);
  std::vector<EdgePoint> ordered(
      map->chains.empty() ? 0U : static_cast<std::size_t>(map->chains.back().end));
  for (std::size_t i = 0; i < places.size(); ++i) {
    map->index[static_cast<std::size_t>(pixels[i])] = places[i];
    if (places[i] >= 0) ordered[static_cast<std::size_t>(places[i])] = map->points[i];
  }
  map->points = std::move(ordered);
}

}  // namespace

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

EdgeMap DetectEdges(const cv::Mat& gray, double smoothing_px, const std::vector<cv::Rect>* within,
                    double faintness) {
  EdgeMap edges;
  edges.width = gray.cols;
  edges.height = gray.rows;
  edges.gray = gray;
  edges.gradient_noise = GradientNoise(EstimateNoise(gray), smoothing_px);
  const double low = RaiseToNoise(faintness * kLowGradient, kLowNoiseFactor, edges.gradient_noise);
  const double high =
      RaiseToNoise(faintness * kHighGradient, kHighNoiseFactor, edges.gradient_noise);
  const std::vector<std::int32_t> pixels = FindEdgePoints(smoothing_px, low, within, &edges);
  ChainEdgePoints(pixels, high, &edges);
  return edges;
}

}  // namespace circline
