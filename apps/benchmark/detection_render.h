// Renderings of circles and rings in perspective with exact truth: a set for each seed.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_RENDER_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_RENDER_H_

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/conic.h"

namespace circline::apps {

struct RenderedImage {
  int group = 0;
  std::vector<Ellipse> ellipses;
  std::vector<Eigen::Vector3d> normals;
  std::vector<Eigen::Vector2d> centers;  // Of the circle; the two rims of a ring share theirs.
};

// The smallest rim that the truth of a rendering lists, semi-minor axis, pixels. Smaller ones are
// drawn, and photographs of textures hold blobs of that size.
constexpr double kSmallestListedPx = 8.0;

// Seen by PinholeCamera(): discs and rings (the inner radius is 0.6 of the outer one) at tilts of 0
// to 75 degrees, which do not touch. Groups, image number modulo 4: a plain ground; a photograph; a
// photograph, and occluders that hide 10 to 40 % of most contours; the same with noise of sigma 10
// grey levels (2 otherwise). Supersampled 4x, blurred by 0.5 to 1.2 px.
class Renderer {
 public:
  // `textures`: a folder with the sample photographs of OpenCV.
  explicit Renderer(const std::string& textures);

  // False where the folder has none of the photographs that are used.
  bool ok() const { return !textures_.empty(); }

  // Image `number` of the set with this seed: the same bits wherever OpenCV's filters give them.
  cv::Mat Render(std::uint64_t seed, int number, RenderedImage* truth) const;

 private:
  std::vector<cv::Mat> textures_;  // Grey, as large as the supersampled rendering.
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_RENDER_H_
