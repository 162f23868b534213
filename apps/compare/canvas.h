// Anti-aliased drawing on an enlarged copy of a photo, in pixels of the photo.
#ifndef CIRCLINE_APPS_COMPARE_CANVAS_H_
#define CIRCLINE_APPS_COMPARE_CANVAS_H_

#include <Eigen/Core>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace circline::apps {

// Positions are pixels of the photo; widths, radii and letter sizes are pixels of the picture.
// Positions that are not finite are left out, and lines break there.
class Canvas {
 public:
  explicit Canvas(const cv::Mat& photo);

  int height() const { return image_.rows; }
  // Length in photo pixels of so many pixels of the picture.
  double PhotoPixels(double picture_pixels) const { return picture_pixels / scale_; }
  // At least `margin` picture pixels from the border.
  bool IsInside(const Eigen::Vector2d& pixel, double margin) const;

  void Polyline(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color, int thickness);
  void Dashes(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color, int thickness);
  void Arrow(const std::vector<Eigen::Vector2d>& pixels, const cv::Scalar& color, int thickness);
  void Dot(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color);
  void Ring(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color);
  void Cross(const Eigen::Vector2d& pixel, double radius, const cv::Scalar& color);
  // Text with a dark rim, moved inside the picture; begins at the pixel, or is centred there.
  void Label(const Eigen::Vector2d& pixel, const std::string& text, const cv::Scalar& color,
             double size, bool centered = false);

  // What `draw` draws shows with this opacity.
  void Blend(double opacity, const std::function<void()>& draw);

  // The picture with lines of text on a dark strip below; the first is the title.
  cv::Mat WithCaption(const std::vector<std::string>& lines) const;

 private:
  cv::Point2d ToPicture(const Eigen::Vector2d& pixel) const;
  bool IsNear(const cv::Point2d& point) const;
  void Line(const cv::Point2d& a, const cv::Point2d& b, const cv::Scalar& color, int thickness);

  cv::Mat image_;
  double scale_ = 1.0;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_CANVAS_H_
