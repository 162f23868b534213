// Anti-aliased drawing on a copy of a photo, in its pixels.
#ifndef CIRCLINE_APPS_COMPARE_CANVAS_H_
#define CIRCLINE_APPS_COMPARE_CANVAS_H_

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace circline::apps {

// Positions are pixels of the photo. Widths, radii, margins and letter sizes are those on a photo
// 960 pixels wide; they are scaled with the photo, so that strokes look alike on small and large
// ones. Positions that are not finite are left out, and lines break there.
class Canvas {
 public:
  explicit Canvas(const cv::Mat& photo);

  int width() const { return image_.cols; }
  int height() const { return image_.rows; }
  // A width given for a photo 960 pixels wide, on this one.
  double Scaled(double width) const { return width * stroke_; }
  // At least `margin` from the border.
  bool IsInside(const Eigen::Vector2d& pixel, double margin) const;

  void Polyline(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
                double thickness);
  void Dashes(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color,
              double thickness);
  void Arrow(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color, double thickness);
  void Dot(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color);
  void Ring(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color);
  void Cross(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color);
  // Text with a dark rim, moved inside the picture; begins at the pixel, or is centred there.
  void Label(const Eigen::Vector2d& pixel, const std::string& text, const cv::Scalar& color,
             double size, bool centered = false);

  // What `draw` draws shows with this opacity.
  void Blend(double opacity, const std::function<void()>& draw);

  const cv::Mat& Image() const { return image_; }
  // The picture with text on a dark strip below: a title, then parts in as many rows as they need.
  cv::Mat WithCaption(const std::string& title, const std::vector<std::string>& parts) const;

 private:
  bool IsNear(const Eigen::Vector2d& pixel) const;
  int Thickness(double thickness) const;
  int FixedLength(double length) const;
  double LetterSize(double size) const;
  void Run(const std::vector<cv::Point>& points, const cv::Scalar& color, int thickness);

  cv::Mat image_;
  double stroke_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_CANVAS_H_
