// DetectObservations on small photos of any size, kind and content.
#include <opencv2/imgproc.hpp>

#include "circline/ransac/detection/detect_observations.h"
#include "tests/fuzz/fuzz.h"

namespace circline::fuzz {
namespace {

// Shapes that a detector finds something in, and raw pixels between them.
cv::Mat ArbitraryPhoto(Bytes* bytes) {
  const int types[] = {CV_8UC1, CV_8UC3, CV_8UC4, CV_32FC1};
  const int width = 1 + bytes->Below(128), height = 1 + bytes->Below(128);
  const int type = types[bytes->OneIn(16) ? bytes->Below(4) : 0];
  cv::Mat photo(height, width, type, cv::Scalar::all(bytes->Byte()));
  const auto color = [&] { return cv::Scalar::all(bytes->Byte()); };
  const auto point = [&] {
    const int x = bytes->Below(160) - 16;
    return cv::Point(x, bytes->Below(160) - 16);
  };
  for (int i = 0; i < 12 && !bytes->empty(); ++i) {
    const int thickness = bytes->OneIn(2) ? cv::FILLED : 1 + bytes->Below(4);
    switch (bytes->Below(4)) {
      case 0: {
        const cv::Point center = point();
        const cv::Size axes{bytes->Below(64), bytes->Below(64)};
        const double angle = bytes->Below(180), arc = 36.0 * bytes->Below(11);
        cv::ellipse(photo, center, axes, angle, 0.0, arc, color(), thickness, cv::LINE_AA);
        break;
      }
      case 1: {
        const cv::Point from = point(), to = point();
        const cv::Scalar grey = color();
        cv::line(photo, from, to, grey, 1 + bytes->Below(4), cv::LINE_AA);
        break;
      }
      case 2: {
        const cv::Point corner = point(), opposite = point();
        cv::rectangle(photo, corner, opposite, color(), thickness);
        break;
      }
      default:
        for (int k = 0; k < 32; ++k) {
          const cv::Point at = point();
          if (at.inside({0, 0, width, height})) cv::circle(photo, at, 0, color());
        }
    }
  }
  return photo;
}

}  // namespace
}  // namespace circline::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  fuzz::Bytes bytes(data, size);
  Camera camera;
  camera.id = "camera";
  camera.fx = camera.fy = bytes.Number(50.0, 500.0);
  camera.cx = camera.cy = 64.0;
  DetectionOptions options;
  options.min_segment_length_px = 1.0 + bytes.Below(20);
  options.min_ellipse_axis_px = 0.5 + bytes.Below(4);
  options.seed = static_cast<std::uint64_t>(bytes.Byte());
  const cv::Mat photo = fuzz::ArbitraryPhoto(&bytes);
  Observations observations;
  const Status status = DetectObservations(photo, camera, options, &observations);
  if (status.ok()) {
    fuzz::Expect(observations.Validate().ok(), "what is detected is valid");
  } else {
    fuzz::Expect(!status.message.empty(), "what is refused says why");
  }
  return 0;
}
