// Renderings of circles and rings in perspective with exact truth: as many fresh sets as there are
// seeds, of the kind that a folder of renderings with a truth.csv holds.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_RENDER_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_RENDER_H_

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/detection_truth.h"
#include "circline/estimators/camera.h"

namespace circline::benchmark {

// 640x480, f = 800 px, no distortion: that of all renderings.
Camera RenderingCamera();

// The smallest rim that the truth of a rendering lists, semi-minor axis, pixels. Smaller ones are
// drawn, and photographs of textures hold blobs of that size.
constexpr double kSmallestListedPx = 8.0;

// Discs and rings (the inner radius is 0.6 of the outer one) at tilts of 0 to 75 degrees, which do
// not touch. Groups, image number modulo 4: a plain ground; a photograph; a photograph, and
// occluders that hide 10 to 40 % of most contours; the same with noise of sigma 10 grey levels (2
// otherwise). Supersampled 4x, blurred by 0.5 to 1.2 px.
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

}  // namespace circline::benchmark

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_RENDER_H_
