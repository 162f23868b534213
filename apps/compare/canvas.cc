#include "apps/compare/canvas.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace circline::apps {
namespace {

constexpr int kShift = 4;  // Positions are drawn to 1/16 of a pixel.
constexpr int kFont = cv::FONT_HERSHEY_DUPLEX;
// Photos of this width are drawn on with the widths given; strokes on others grow with the photo,
// within what can still be told apart.
constexpr double kUsualWidth = 960.0, kMinStroke = 0.5, kMaxStroke = 4.0;
constexpr double kMinLetters = 0.4;  // Letters of OpenCV's font below that cannot be read.
const cv::Scalar kRim(25, 25, 25);

cv::Point Fixed(const Eigen::Vector2d& pixel) {
  return {static_cast<int>(std::lround(pixel.x() * (1 << kShift))),
          static_cast<int>(std::lround(pixel.y() * (1 << kShift)))};
}

cv::Mat ToColor(const cv::Mat& photo) {
  cv::Mat color;
  if (photo.channels() == 1) {
    cv::cvtColor(photo, color, cv::COLOR_GRAY2BGR);
  } else {
    photo.copyTo(color);
  }
  return color;
}

int TextWidth(const std::string& text, double size) {
  return cv::getTextSize(text, kFont, size, 1, nullptr).width;
}

// As much of the text as fits, with dots where it was cut.
std::string Shorten(std::string text, double size, int width) {
  if (TextWidth(text, size) <= width) return text;
  while (!text.empty() && TextWidth(text + "...", size) > width) text.pop_back();
  return text + "...";
}

// The text in rows that fit, broken between its parts, which stand kGap apart.
std::vector<std::string> Wrap(const std::vector<std::string>& parts, double size, int width) {
  constexpr const char* kGap = "    ";
  std::vector<std::string> rows;
  for (const std::string& part : parts) {
    const bool fits = !rows.empty() && TextWidth(rows.back() + kGap + part, size) <= width;
    if (fits) {
      rows.back() += kGap + part;
    } else {
      rows.push_back(Shorten(part, size, width));
    }
  }
  return rows;
}

}  // namespace

Canvas::Canvas(const cv::Mat& photo)
    : image_(ToColor(photo)),
      stroke_(std::clamp(image_.cols / kUsualWidth, kMinStroke, kMaxStroke)) {}

bool Canvas::IsInside(const Eigen::Vector2d& pixel, double margin) const {
  margin *= stroke_;
  return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= image_.cols - 1 - margin &&
         pixel.y() <= image_.rows - 1 - margin;
}

bool Canvas::IsNear(const Eigen::Vector2d& pixel) const {
  const double limit = 4.0 * std::max(image_.cols, image_.rows);
  return pixel.allFinite() && pixel.cwiseAbs().maxCoeff() < limit;
}

int Canvas::Thickness(double thickness) const {
  return std::max(1, static_cast<int>(std::lround(thickness * stroke_)));
}

int Canvas::FixedLength(double length) const {
  return static_cast<int>(std::lround(length * stroke_ * (1 << kShift)));
}

double Canvas::LetterSize(double size) const { return std::max(kMinLetters, size * stroke_); }

void Canvas::Run(const std::vector<cv::Point>& points, const cv::Scalar& color, int thickness) {
  if (points.size() < 2) return;
  const cv::Rect box = cv::boundingRect(points);
  const int margin = thickness << kShift;
  const cv::Rect picture(-margin, -margin, (image_.cols << kShift) + 2 * margin,
                         (image_.rows << kShift) + 2 * margin);
  // A straight run's box has no area.
  if ((cv::Rect(box.x, box.y, box.width + 1, box.height + 1) & picture).empty()) return;
  cv::polylines(image_, points, false, color, thickness, cv::LINE_AA, kShift);
}

void Canvas::Polyline(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
                      double thickness) {
  std::vector<cv::Point> points;
  for (const Eigen::Vector2d& pixel : pixels) {
    if (IsNear(pixel)) {
      points.push_back(Fixed(pixel));
    } else {
      Run(points, color, Thickness(thickness));
      points.clear();
    }
  }
  Run(points, color, Thickness(thickness));
}

void Canvas::Dashes(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
                    double thickness) {
  const double dash = 14.0 * stroke_;
  double travelled = 0.0;
  std::vector<cv::Point> points;
  for (std::size_t i = 0; i + 1 < pixels.size(); ++i) {
    const Eigen::Vector2d &a = pixels[i], &b = pixels[i + 1];
    if (!IsNear(a) || !IsNear(b)) continue;
    const double length = (b - a).norm();
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / (dash / 4.0))));
    for (int k = 0; k < pieces; ++k, travelled += length / pieces) {
      if (std::fmod(travelled, 2.0 * dash) < dash) {
        points.push_back(Fixed(a + (b - a) * (static_cast<double>(k) / pieces)));
      } else {
        Run(points, color, Thickness(thickness));
        points.clear();
      }
    }
  }
  Run(points, color, Thickness(thickness));
}

void Canvas::Arrow(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
                   double thickness) {
  if (pixels.size() < 2) return;
  const Eigen::Vector2d &tip = pixels.back(), &start = pixels.front();
  const double length = (tip - start).norm();
  const Eigen::Vector2d back =
      (start - tip) * (std::min(15.0 * stroke_, 0.4 * length) / std::max(length, 1e-9));
  const Eigen::Vector2d side(-0.42 * back.y(), 0.42 * back.x());
  for (const bool rim : {true, false}) {
    const cv::Scalar& c = rim ? kRim : color;
    const double width = rim ? thickness + 3.0 : thickness;
    Polyline(pixels, c, width);
    if (length > 4.0) Polyline({tip + back + side, tip, tip + back - side}, c, width);
  }
}

void Canvas::Dot(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color) {
  if (!IsNear(pixel)) return;
  cv::circle(image_, Fixed(pixel), FixedLength(radius), color, cv::FILLED, cv::LINE_AA, kShift);
}

void Canvas::Ring(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color) {
  if (!IsNear(pixel)) return;
  const int length = FixedLength(radius);
  cv::circle(image_, Fixed(pixel), length, kRim, Thickness(3.0), cv::LINE_AA, kShift);
  cv::circle(image_, Fixed(pixel), length, color, Thickness(1.0), cv::LINE_AA, kShift);
}

void Canvas::Cross(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color) {
  const Eigen::Vector2d along(radius * stroke_, 0.0), down(0.0, radius * stroke_);
  for (const bool rim : {true, false}) {
    const cv::Scalar& c = rim ? kRim : color;
    const double width = rim ? 5.0 : 2.0;
    Polyline({pixel - along, pixel + along}, c, width);
    Polyline({pixel - down, pixel + down}, c, width);
  }
}

void Canvas::Label(const Eigen::Vector2d& pixel, const std::string& text, const cv::Scalar& color,
                   double size, bool centered) {
  if (!IsNear(pixel)) return;
  size = LetterSize(size);
  const int thickness = Thickness(2.0);
  const cv::Size box = cv::getTextSize(text, kFont, size, thickness, nullptr);
  double x = pixel.x(), y = pixel.y();
  if (centered) {
    x -= box.width / 2.0;
    y += box.height / 2.0;
  }
  x = std::clamp(x, 4.0, std::max(4.0, image_.cols - box.width - 4.0));
  y = std::clamp(y, box.height + 4.0, std::max(box.height + 4.0, image_.rows - 6.0));
  const cv::Point at(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)));
  cv::putText(image_, text, at, kFont, size, kRim, thickness + 2, cv::LINE_AA);
  cv::putText(image_, text, at, kFont, size, color, thickness, cv::LINE_AA);
}

void Canvas::Blend(double opacity, const std::function<void()>& draw) {
  const cv::Mat before = image_.clone();
  draw();
  cv::addWeighted(image_, opacity, before, 1.0 - opacity, 0.0, image_);
}

cv::Mat Canvas::WithCaption(const std::string& title, const std::vector<std::string>& parts) const {
  const double size = LetterSize(0.6);
  const int margin = static_cast<int>(std::lround(18.0 * size));
  const int line_height = static_cast<int>(std::lround(36.0 * size));
  const int width = image_.cols - 2 * margin;
  std::vector<std::string> rows = Wrap(parts, size, width);
  rows.insert(rows.begin(), Shorten(title, size, width));
  const int strip = line_height * static_cast<int>(rows.size()) + margin;
  cv::Mat picture(image_.rows + strip, image_.cols, CV_8UC3, cv::Scalar(32, 28, 26));
  image_.copyTo(picture.rowRange(0, image_.rows));
  int baseline = image_.rows + line_height;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const cv::Scalar color = i == 0 ? cv::Scalar(255, 255, 255) : cv::Scalar(215, 210, 205);
    const int thickness = std::max(1, static_cast<int>(std::lround(size)));
    cv::putText(picture, rows[i], {margin, baseline}, kFont, size, color, thickness, cv::LINE_AA);
    baseline += line_height;
  }
  return picture;
}

}  // namespace circline::apps
