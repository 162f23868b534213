#include "apps/benchmark/detection_render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/random.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSupersampling = 4;
// Inner over outer radius of a ring.
constexpr double kRingRatio = 0.6;
// Smallest difference in grey between a disc and the ground's mean, or an occluder and its disc.
constexpr double kContrast = 40.0;

// A circle of unit distance.
struct Disc {
  Vector3d center, normal;  // The normal faces the camera.
  double radius = 0.0;      // Over the centre's distance.
  bool is_ring = false;

  Ellipse Rim(const Camera& camera, double share) const {
    Matrix3d ray_from_pixel;
    ray_from_pixel << 1.0 / camera.fx, 0.0, -camera.cx / camera.fx, 0.0, 1.0 / camera.fy,
        -camera.cy / camera.fy, 0.0, 0.0, 1.0;
    Ellipse rim;
    ConicToEllipse(
        TransformConic(ProjectCircle({normal, center / (share * radius)}), ray_from_pixel), &rim);
    return rim;
  }
};

Disc DrawDisc(const Camera& camera, Random* random) {
  Disc disc;
  const double y = random->Uniform(0.0, camera.height), x = random->Uniform(0.0, camera.width);
  disc.center =
      Vector3d((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0).normalized();
  disc.radius = random->Uniform(16.0, 100.0) / camera.fx;
  disc.is_ring = random->Uniform() < 0.45;
  const double tilt = random->Uniform(0.0, 75.0) * kDegree;
  const double azimuth = random->Uniform(0.0, 2.0 * kPi);
  disc.normal = {std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                 -std::cos(tilt)};
  return disc;
}

double DrawGrey(double apart_from, Random* random) {
  double grey = 0.0;
  do {
    grey = random->Uniform(15.0, 250.0);
  } while (std::abs(grey - apart_from) < kContrast);
  return grey;
}

// Of the supersampled rendering, in 1/256 of its pixels.
constexpr int kShift = 8;
cv::Point FixedPoint(const Vector2d& pixel) {
  const Vector2d p =
      (kSupersampling * (pixel.array() + 0.5) - 0.5).matrix() * static_cast<double>(1 << kShift);
  return {static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))};
}

void Fill(const std::vector<Vector2d>& polygon, double grey, cv::Mat* image) {
  std::vector<cv::Point> points;
  points.reserve(polygon.size());
  for (const Vector2d& p : polygon) points.push_back(FixedPoint(p));
  cv::fillConvexPoly(*image, points, cv::Scalar::all(grey), cv::LINE_AA, kShift);
}

// Each pixel of the supersampled rendering by its share inside, that of a straight edge at the
// ellipse's distance. (fillConvexPoly fills what its outline touches: 0.15 px of the photo more.)
void FillRim(const Ellipse& rim, double grey, cv::Mat* image) {
  const Vector2d half(rim.a + 1.0, rim.a + 1.0);
  const auto pixel = [](double x) { return static_cast<int>(kSupersampling * (x + 0.5)); };
  const Vector2d low = rim.center - half, high = rim.center + half;
  const cv::Rect box = cv::Rect(cv::Point(pixel(low.x()), pixel(low.y())),
                                cv::Point(pixel(high.x()), pixel(high.y()))) &
                       cv::Rect({}, image->size());
  const double cosine = std::cos(rim.angle), sine = std::sin(rim.angle);
  for (int y = box.y; y < box.y + box.height; ++y) {
    auto* row = image->ptr<std::uint8_t>(y);
    for (int x = box.x; x < box.x + box.width; ++x) {
      const Vector2d p = (Vector2d(x, y).array() + 0.5) / kSupersampling - 0.5;
      const Vector2d d = p - rim.center;
      const Vector2d unit((cosine * d.x() + sine * d.y()) / rim.a,
                          (cosine * d.y() - sine * d.x()) / rim.b);
      // Sampson's distance, negative inside.
      const double slope = 2.0 * std::hypot(unit.x() / rim.a, unit.y() / rim.b);
      const double distance = (unit.squaredNorm() - 1.0) / std::max(slope, 1e-12);
      const double share = std::clamp(0.5 - kSupersampling * distance, 0.0, 1.0);
      row[x] = cv::saturate_cast<std::uint8_t>(share * grey + (1.0 - share) * row[x]);
    }
  }
}

// Hides a piece of 10 to 40 % of the contour and the segment inside of it, and sticks out a little:
// straight, or in an arc beside the contour that may pass for a rim of its own.
void Occlude(const Ellipse& rim, double grey, Random* random, cv::Mat* image) {
  constexpr int kCorners = 180;
  const double half = kPi * random->Uniform(0.1, 0.4), middle = random->Uniform(0.0, 2.0 * kPi);
  const Vector2d a = EllipsePoint(rim, middle - half), b = EllipsePoint(rim, middle + half);
  std::vector<Vector2d> polygon = {b, a};
  if (random->Uniform() < 0.5) {
    const double height = (1.0 - std::cos(half)) * random->Uniform(1.1, 1.6);
    const Vector2d out = height * (EllipsePoint(rim, middle) - rim.center);
    polygon.push_back(a + out);
    polygon.push_back(b + out);
  } else {
    const double scale = random->Uniform(1.02, 1.15);
    for (int k = 0; k <= kCorners; ++k) {
      const Vector2d p = EllipsePoint(rim, middle - half + 2.0 * half * k / kCorners);
      polygon.emplace_back(rim.center + scale * (p - rim.center));
    }
  }
  Fill(polygon, grey, image);
}

bool Touch(const std::vector<Ellipse>& rims, const Ellipse& rim) {
  constexpr double kApartPx = 4.0;
  for (const Ellipse& other : rims) {
    if ((other.center - rim.center).norm() < other.a + rim.a + kApartPx) return true;
  }
  return false;
}

void List(const Disc& disc, const Ellipse& rim, RenderedImage* truth) {
  if (rim.b < kSmallestListedPx) return;
  const Camera camera = PinholeCamera();
  truth->ellipses.push_back(rim);
  truth->normals.push_back(disc.normal);
  truth->centers.emplace_back(camera.fx * disc.center.x() / disc.center.z() + camera.cx,
                              camera.fy * disc.center.y() / disc.center.z() + camera.cy);
}

// One rim, what fills it, and perhaps what hides a part of it.
double DrawRim(const Disc& disc, double share, double around, int group, Random* random,
               cv::Mat* image, RenderedImage* truth) {
  const Ellipse rim = disc.Rim(PinholeCamera(), share);
  const double grey = DrawGrey(around, random);
  FillRim(rim, grey, image);
  if (group >= 2 && random->Uniform() < 0.7) Occlude(rim, DrawGrey(grey, random), random, image);
  List(disc, rim, truth);
  return grey;
}

void DrawCircles(int group, Random* random, cv::Mat* image, RenderedImage* truth) {
  constexpr int kMostTries = 100;
  const Camera camera = PinholeCamera();
  const double ground = cv::mean(*image)[0];
  std::vector<Ellipse> rims;
  const int wanted = 1 + random->UniformInt(5);
  for (int k = 0; k < kMostTries && static_cast<int>(rims.size()) < wanted; ++k) {
    const Disc disc = DrawDisc(camera, random);
    if (disc.normal.dot(disc.center) > -0.2) continue;  // Seen edge on.
    const Ellipse rim = disc.Rim(camera, 1.0);
    const Vector2d low = rim.center.array() - 0.8 * rim.a, high = rim.center.array() + 0.8 * rim.a;
    const bool outside =
        low.minCoeff() < 0.0 || high.x() > camera.width || high.y() > camera.height;
    if (outside || rim.b < kSmallestListedPx || Touch(rims, rim)) continue;
    rims.push_back(rim);
    const double grey = DrawRim(disc, 1.0, ground, group, random, image, truth);
    if (disc.is_ring) DrawRim(disc, kRingRatio, grey, group, random, image, truth);
  }
}

// A copy of a photograph, mirrored or not.
cv::Mat DrawTexture(const std::vector<cv::Mat>& textures, Random* random) {
  cv::Mat image;
  const int k = random->UniformInt(static_cast<int>(textures.size()));
  textures[static_cast<std::size_t>(k)].copyTo(image);
  if (random->Uniform() < 0.5) cv::flip(image, image, 1);
  return image;
}

void AddNoise(double sigma, Random* random, cv::Mat* image) {
  for (int y = 0; y < image->rows; ++y) {
    auto* row = image->ptr<std::uint8_t>(y);
    for (int x = 0; x < image->cols; ++x)
      row[x] = cv::saturate_cast<std::uint8_t>(row[x] + sigma * random->Normal());
  }
}

}  // namespace

Renderer::Renderer(const std::string& textures) {
  // Those of the sample photographs that show no ellipses.
  constexpr std::array<const char*, 6> kFiles = {"building.jpg", "home.jpg",  "leuvenA.jpg",
                                                 "leuvenB.jpg",  "aloeL.jpg", "box_in_scene.png"};
  constexpr double kBlurPx = 1.5;
  const Camera camera = PinholeCamera();
  for (const char* file : kFiles) {
    cv::Mat texture = cv::imread(textures + "/" + file, cv::IMREAD_GRAYSCALE);
    if (texture.empty()) continue;
    cv::resize(texture, texture, {camera.width, camera.height}, 0.0, 0.0, cv::INTER_AREA);
    cv::GaussianBlur(texture, texture, {}, kBlurPx);
    cv::resize(texture, texture, {}, kSupersampling, kSupersampling, cv::INTER_CUBIC);
    textures_.push_back(texture);
  }
}

cv::Mat Renderer::Render(std::uint64_t seed, int number, RenderedImage* truth) const {
  const Camera camera = PinholeCamera();
  Random random(Random(seed * 1000003ULL + static_cast<std::uint64_t>(number)).Next());
  *truth = RenderedImage();
  truth->group = number % 4;
  cv::Mat large = truth->group > 0
                      ? DrawTexture(textures_, &random)
                      : cv::Mat(kSupersampling * camera.height, kSupersampling * camera.width,
                                CV_8U, cv::Scalar::all(random.Uniform(40.0, 220.0)));
  DrawCircles(truth->group, &random, &large, truth);
  cv::GaussianBlur(large, large, {}, kSupersampling * random.Uniform(0.5, 1.2));
  cv::Mat image;
  cv::resize(large, image, {camera.width, camera.height}, 0.0, 0.0, cv::INTER_AREA);
  AddNoise(truth->group == 3 ? 10.0 : 2.0, &random, &image);
  return image;
}

}  // namespace circline::apps
