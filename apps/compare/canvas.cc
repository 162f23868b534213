#include "apps/compare/canvas.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace circline::apps {
namespace {

constexpr int kShift = 4;  // Positions are drawn to 1/16 of a pixel.
constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
constexpr int kMinWidth = 960;
const cv::Scalar kRim(25, 25, 25);

cv::Point Fixed(const cv::Point2d& point) {
  return {static_cast<int>(std::lround(point.x * (1 << kShift))),
          static_cast<int>(std::lround(point.y * (1 << kShift)))};
}

cv::Mat ToColor(const cv::Mat& photo) {
  cv::Mat color;
  if (photo.channels() == 1) {
    cv::cvtColor(photo, color, cv::COLOR_GRAY2BGR);
  } else if (photo.channels() == 4) {
    cv::cvtColor(photo, color, cv::COLOR_BGRA2BGR);
  } else {
    photo.copyTo(color);
  }
  return color;
}

// As much of the text as fits, with dots where it was cut.
std::string Shorten(std::string text, double size, int thickness, int width) {
  const auto fits = [&](const std::string& t) {
    return cv::getTextSize(t, kFont, size, thickness, nullptr).width <= width;
  };
  if (fits(text)) return text;
  while (!text.empty() && !fits(text + "...")) text.pop_back();
  return text + "...";
}

}  // namespace

Canvas::Canvas(const cv::Mat& photo) {
  const cv::Mat color = ToColor(photo);
  scale_ = std::max(1.0, static_cast<double>(kMinWidth) / color.cols);
  if (scale_ > 1.0) {
    const cv::Size size(kMinWidth, static_cast<int>(std::lround(color.rows * scale_)));
    cv::resize(color, image_, size, 0.0, 0.0, cv::INTER_CUBIC);
  } else {
    image_ = color;
  }
}

cv::Point2d Canvas::ToPicture(const Eigen::Vector2d& pixel) const {
  return {(pixel.x() + 0.5) * scale_ - 0.5, (pixel.y() + 0.5) * scale_ - 0.5};
}

bool Canvas::IsInside(const Eigen::Vector2d& pixel, double margin) const {
  const cv::Point2d p = ToPicture(pixel);
  return p.x >= margin && p.y >= margin && p.x <= image_.cols - 1 - margin &&
         p.y <= image_.rows - 1 - margin;
}

bool Canvas::IsNear(const cv::Point2d& point) const {
  const double limit = 4.0 * std::max(image_.cols, image_.rows);
  return std::isfinite(point.x) && std::isfinite(point.y) && std::abs(point.x) < limit &&
         std::abs(point.y) < limit;
}

void Canvas::Line(const cv::Point2d& a, const cv::Point2d& b, const cv::Scalar& color,
                  int thickness) {
  if (!IsNear(a) || !IsNear(b)) return;
  cv::line(image_, Fixed(a), Fixed(b), color, thickness, cv::LINE_AA, kShift);
}

void Canvas::Polyline(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
                      int thickness) {
  for (std::size_t i = 0; i + 1 < pixels.size(); ++i) {
    Line(ToPicture(pixels[i]), ToPicture(pixels[i + 1]), color, thickness);
  }
}

void Canvas::Dashes(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
                    int thickness) {
  constexpr double kDash = 14.0;
  double travelled = 0.0;
  for (std::size_t i = 0; i + 1 < pixels.size(); ++i) {
    const cv::Point2d a = ToPicture(pixels[i]), b = ToPicture(pixels[i + 1]);
    if (!IsNear(a) || !IsNear(b)) continue;
    const double length = cv::norm(b - a);
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / (kDash / 4))));
    for (int k = 0; k < pieces; ++k) {
      const bool drawn = std::fmod(travelled, 2.0 * kDash) < kDash;
      const cv::Point2d from = a + (b - a) * (static_cast<double>(k) / pieces);
      if (drawn) Line(from, a + (b - a) * (static_cast<double>(k + 1) / pieces), color, thickness);
      travelled += length / pieces;
    }
  }
}

void Canvas::Arrow(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
                   int thickness) {
  if (pixels.size() < 2) return;
  const cv::Point2d tip = ToPicture(pixels.back()), start = ToPicture(pixels.front());
  for (const bool rim : {true, false}) {
    const cv::Scalar& c = rim ? kRim : color;
    const int width = rim ? thickness + 3 : thickness;
    Polyline(pixels, c, width);
    const double length = cv::norm(tip - start);
    if (!IsNear(tip) || !IsNear(start) || !(length > 4.0)) continue;
    const cv::Point2d back = (start - tip) * (std::min(15.0, 0.4 * length) / length);
    const cv::Point2d side(-0.42 * back.y, 0.42 * back.x);
    Line(tip, tip + back + side, c, width);
    Line(tip, tip + back - side, c, width);
  }
}

void Canvas::Dot(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color) {
  const cv::Point2d center = ToPicture(pixel);
  if (!IsNear(center)) return;
  const int fixed_radius = static_cast<int>(std::lround(radius * (1 << kShift)));
  cv::circle(image_, Fixed(center), fixed_radius, color, cv::FILLED, cv::LINE_AA, kShift);
}

void Canvas::Ring(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color) {
  const cv::Point2d center = ToPicture(pixel);
  if (!IsNear(center)) return;
  const int fixed_radius = static_cast<int>(std::lround(radius * (1 << kShift)));
  cv::circle(image_, Fixed(center), fixed_radius, kRim, 3, cv::LINE_AA, kShift);
  cv::circle(image_, Fixed(center), fixed_radius, color, 1, cv::LINE_AA, kShift);
}

void Canvas::Cross(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color) {
  const cv::Point2d center = ToPicture(pixel);
  for (const bool rim : {true, false}) {
    const cv::Scalar& c = rim ? kRim : color;
    const int width = rim ? 5 : 2;
    Line(center - cv::Point2d(radius, 0.0), center + cv::Point2d(radius, 0.0), c, width);
    Line(center - cv::Point2d(0.0, radius), center + cv::Point2d(0.0, radius), c, width);
  }
}

void Canvas::Label(const Eigen::Vector2d& pixel, const std::string& text, const cv::Scalar& color,
                   double size, bool centered) {
  const cv::Point2d p = ToPicture(pixel);
  if (!IsNear(p)) return;
  const cv::Size box = cv::getTextSize(text, kFont, size, 2, nullptr);
  double x = p.x, y = p.y;
  if (centered) {
    x -= box.width / 2.0;
    y += box.height / 2.0;
  }
  x = std::clamp(x, 4.0, std::max(4.0, image_.cols - box.width - 4.0));
  y = std::clamp(y, box.height + 4.0, std::max(box.height + 4.0, image_.rows - 6.0));
  const cv::Point at(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)));
  cv::putText(image_, text, at, kFont, size, kRim, 5, cv::LINE_AA);
  cv::putText(image_, text, at, kFont, size, color, 2, cv::LINE_AA);
}

void Canvas::Blend(double opacity, const std::function<void()>& draw) {
  const cv::Mat before = image_.clone();
  draw();
  cv::addWeighted(image_, opacity, before, 1.0 - opacity, 0.0, image_);
}

cv::Mat Canvas::WithCaption(const std::vector<std::string>& lines) const {
  constexpr int kMargin = 12;
  const double size = std::clamp(image_.cols / 1500.0, 0.6, 1.2);
  const int line_height = static_cast<int>(std::lround(40.0 * size));
  const int strip = line_height * static_cast<int>(lines.size()) + kMargin;
  cv::Mat picture(image_.rows + strip, image_.cols, CV_8UC3, cv::Scalar(32, 28, 26));
  image_.copyTo(picture.rowRange(0, image_.rows));
  int baseline = image_.rows + line_height - kMargin / 2;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const int thickness = 1;
    const cv::Scalar color = i == 0 ? cv::Scalar(255, 255, 255) : cv::Scalar(215, 210, 205);
    const std::string text = Shorten(lines[i], size, thickness, picture.cols - 2 * kMargin);
    cv::putText(picture, text, {kMargin, baseline}, kFont, size, color, thickness, cv::LINE_AA);
    baseline += line_height;
  }
  return picture;
}

}  // namespace circline::apps
