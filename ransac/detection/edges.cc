#include "circline/ransac/detection/edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "circline/estimators/basics.h"
#include "circline/ransac/detection/edge_chains.h"
#include "circline/ransac/detection/edge_points.h"

namespace circline {
namespace {

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

double Threshold(double value, double factor, double noise) {
  return std::min(std::max(value, factor * noise), kMaxThresholdRaise * value);
}

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

Status DetectEdges(const cv::Mat& gray, const EdgeOptions& options, EdgeMap* edges,
                   const std::vector<cv::Rect>* within) {
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
  std::vector<std::int32_t> pixels;
  FindEdgePoints(gray, options.smoothing_px, low, noise, edges, &pixels, within);
  ChainEdgePoints(pixels, high, options.min_chain_points, edges);
  return Status::Ok();
}

}  // namespace circline
