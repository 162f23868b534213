// The table of times: photographs at the sizes that times are quoted for, and targets of many
// rings. Times are of DetectObservations, everything in it; the best of some runs, so that other
// work on the machine does not count.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/detection_tables.h"
#include "apps/benchmark/detection_truth.h"
#include "apps/benchmark/timing.h"
#include "circline/estimators/basics.h"
#include "circline/ransac/detection/detect_observations.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {
namespace {

constexpr double kSmallPixels = 640.0 * 480.0, kLargePixels = 12e6;
constexpr int kRings = 84;

// Milliseconds, the least of some runs.
double TimeDetection(const cv::Mat& image, const Camera& camera, Observations* found) {
  constexpr int kRuns = 3;
  double least = std::nan("");
  for (int run = 0; run < kRuns; ++run) {
    Status status;
    const double ms = Milliseconds(
        [&] { status = DetectObservations(image, camera, DetectionOptions(), found); });
    if (status.ok() && !(least <= ms)) least = ms;
  }
  return least;
}

// The photo with so many pixels, and its camera: pixel centres lie at integers.
void ScaleTo(double pixels, cv::Mat* image, Camera* camera) {
  const double scale = std::sqrt(pixels / static_cast<double>(image->total()));
  cv::resize(*image, *image, {}, scale, scale, scale > 1.0 ? cv::INTER_CUBIC : cv::INTER_AREA);
  camera->width = image->cols;
  camera->height = image->rows;
  camera->fx *= scale;
  camera->fy *= scale;
  camera->cx = (camera->cx + 0.5) * scale - 0.5;
  camera->cy = (camera->cy + 0.5) * scale - 0.5;
}

// So many pixels of the photo and its mirror images side by side: as busy as the photo, where an
// enlarged one is smooth. Its camera is of no world, but takes as long.
void TileTo(double pixels, cv::Mat* image, Camera* camera) {
  cv::Mat wide, block;
  cv::flip(*image, wide, 1);
  cv::hconcat(*image, wide, wide);
  cv::flip(wide, block, 0);
  cv::vconcat(wide, block, block);
  const double scale = std::sqrt(pixels / static_cast<double>(image->total()));
  const cv::Size size(static_cast<int>(scale * image->cols), static_cast<int>(scale * image->rows));
  const int times = static_cast<int>(std::ceil(scale / 2.0));
  *image = cv::repeat(block, times, times)(cv::Rect({}, size)).clone();
  *camera = CenteredCamera(size.width, size.width, size.height);
}

// A plane 4 units ahead that leans by 35 degrees, seen by a camera of 65 degrees, 1600 x 1200:
// black rings on white paper, drawn four times as large, blurred like a lens and with noise.
class RingSheet {
 public:
  RingSheet() : large_(4800, 6400, CV_8U, cv::Scalar(235)) {}

  void Disc(const cv::Point2d& center, double radius, int gray) {
    std::vector<cv::Point> contour;
    for (int i = 0; i < 720; ++i) {
      const double t = i * kPi / 360.0;
      contour.push_back(Project(center.x + radius * std::cos(t), center.y + radius * std::sin(t)));
    }
    cv::fillPoly(large_, std::vector<std::vector<cv::Point>>{contour}, cv::Scalar(gray), cv::LINE_8,
                 kShift);
  }

  const Camera& camera() const { return camera_; }
  cv::Mat Photo() const {
    cv::Mat photo, noise(1200, 1600, CV_16S);
    cv::resize(large_, photo, {1600, 1200}, 0.0, 0.0, cv::INTER_AREA);
    cv::GaussianBlur(photo, photo, {}, 0.7);
    cv::RNG random(84);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
    cv::add(photo, noise, photo, cv::noArray(), CV_8U);
    return photo;
  }

 private:
  static constexpr int kShift = 6, kEnlarged = 4;
  cv::Point Project(double x, double y) const {
    constexpr double kCosine = 0.8191520443, kSine = 0.5735764364;  // Of 35 degrees.
    const double depth = 4.0 + kSine * y;
    const double u = camera_.fx * x / depth + camera_.cx;
    const double v = camera_.fy * kCosine * y / depth + camera_.cy;
    const double unit = kEnlarged * (1 << kShift);
    return {static_cast<int>(std::lround((u + 0.5) * unit)),
            static_cast<int>(std::lround((v + 0.5) * unit))};
  }

  Camera camera_ = CenteredCamera(1250.0, 1600, 1200);
  cv::Mat large_;
};

void PrintRings(const char* name, const RingSheet& sheet) {
  Observations found;
  const double ms = TimeDetection(sheet.Photo(), sheet.camera(), &found);
  std::printf("  %-26s  %8.0f   %d circles  %s\n", name, ms, static_cast<int>(found.circles.size()),
              found.message.c_str());
}

}  // namespace

void MeasureRingSpeed() {
  std::printf("%d rings, 1600 x 1200         ms\n", kRings);
  RingSheet lattice, concentric;  // Side by side, and about one centre.
  for (int i = 0; i < kRings; ++i) {
    const int column = i % 12, row = i / 12;
    const cv::Point2d center(0.36 * (column - 5.5), 0.36 * (row - 3.0));
    lattice.Disc(center, 0.14, 20);
    lattice.Disc(center, 0.08, 235);
    const double outer = 0.017 * (kRings - i);
    concentric.Disc({0.0, 0.0}, outer, 20);
    concentric.Disc({0.0, 0.0}, outer - 0.0085, 235);
  }
  PrintRings("side by side", lattice);
  PrintRings("about one centre", concentric);
}

void MeasureSpeed(const std::string& folder, const cv::FileNode& root) {
  std::vector<double> small;
  double enlarged = std::nan(""), tiled = std::nan("");
  for (const cv::FileNode& node : root["images"]) {
    const cv::Mat photo = cv::imread(folder + "/" + ReadText(node, "file"), cv::IMREAD_COLOR);
    Camera camera;
    if (photo.empty() || !CameraOf(root, node, photo.size(), &camera)) continue;
    const auto time = [&](const auto& change, double pixels) {
      cv::Mat changed = photo;
      Camera changed_camera = camera;
      change(pixels, &changed, &changed_camera);
      Observations found;
      return TimeDetection(changed, changed_camera, &found);
    };
    small.push_back(time(ScaleTo, kSmallPixels));
    if (small.size() > 1) continue;
    enlarged = time(ScaleTo, kLargePixels);
    tiled = time(TileTo, kLargePixels);
  }
  if (small.empty()) return;
  std::printf("  %-26s  %8.1f  %8.1f  %8.0f  %8.0f\n",
              folder.substr(folder.find_last_of('/') + 1).c_str(), Quantile(small, 0.5),
              Quantile(small, 1.0), enlarged, tiled);
}

}  // namespace circline::apps
