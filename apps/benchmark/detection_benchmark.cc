// What detection finds on photographs with truth: prints one table a kind of truth.
//
//     circline_detection_benchmark --data=DIR [--set=NAME]
//
// DIR holds folders with a groundtruth.yml (camera, and per photo what is true of it) or, for
// renderings, a truth.csv; each is measured by what its truth offers.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "apps/benchmark/baseline_detectors.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/line.h"
#include "circline/estimators/line_pose.h"
#include "circline/estimators/pose.h"
#include "circline/ransac/detect_ellipses.h"
#include "circline/ransac/detect_lines.h"
#include "circline/ransac/detect_observations.h"
#include "circline/ransac/edges.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr double kDegrees = 57.29577951308232;

// Processor time, which other work on the machine does not lengthen; there is one thread only.
double Milliseconds(std::clock_t since) {
  return 1e3 * static_cast<double>(std::clock() - since) / CLOCKS_PER_SEC;
}

// Of a list that is sorted here; NaN where it is empty.
double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

// -------------------------------------------------------------------------------------- ellipses

using PolygonPoints = std::vector<cv::Point2f>;

PolygonPoints EllipsePolygon(const Ellipse& e) {
  PolygonPoints polygon;
  for (int k = 0; k < 128; ++k) {
    const Vector2d p = EllipsePoint(e, 2.0 * 3.14159265358979 * k / 128);
    polygon.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  return polygon;
}

// Contour of a calibrated ellipse on the photo.
PolygonPoints ContourPolygon(const Camera& camera, const Matrix3d& conic) {
  PolygonPoints polygon;
  Ellipse e;
  if (!ConicToEllipse(conic, &e)) return polygon;
  for (int k = 0; k < 128; ++k) {
    const Vector2d x = EllipsePoint(e, 2.0 * 3.14159265358979 * k / 128);
    Vector2d p;
    if (!CameraToPixel(camera, Vector3d(x.x(), x.y(), 1.0), &p)) return {};
    polygon.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  return polygon;
}

double IntersectionOverUnion(const PolygonPoints& a, const PolygonPoints& b) {
  if (a.empty() || b.empty()) return 0.0;
  PolygonPoints common;
  const double both = static_cast<double>(cv::intersectConvexConvex(a, b, common));
  return both / (cv::contourArea(a) + cv::contourArea(b) - both);
}

// Best partner of each truth, each detection used once, nearest first.
std::vector<int> Match(const std::vector<PolygonPoints>& truth,
                       const std::vector<PolygonPoints>& found, std::vector<double>* overlap) {
  struct Pair {
    double overlap;
    int truth, found;
  };
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < truth.size(); ++t) {
    for (std::size_t f = 0; f < found.size(); ++f) {
      const double o = IntersectionOverUnion(truth[t], found[f]);
      if (o > 0.5) pairs.push_back({o, static_cast<int>(t), static_cast<int>(f)});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.overlap > b.overlap; });
  std::vector<int> partner(truth.size(), -1), used(found.size(), 0);
  overlap->assign(truth.size(), 0.0);
  for (const Pair& p : pairs) {
    const auto t = static_cast<std::size_t>(p.truth), f = static_cast<std::size_t>(p.found);
    if (partner[t] >= 0 || used[f]) continue;
    partner[t] = p.found;
    used[f] = 1;
    (*overlap)[t] = p.overlap;
  }
  return partner;
}

struct Score {
  int truth = 0, found = 0, hit80 = 0, hit95 = 0;

  void Add(const std::vector<double>& overlap, std::size_t num_found) {
    truth += static_cast<int>(overlap.size());
    found += static_cast<int>(num_found);
    for (const double o : overlap) {
      hit80 += o >= 0.8 ? 1 : 0;
      hit95 += o >= 0.95 ? 1 : 0;
    }
  }
  double F(int hits) const { return truth + found > 0 ? 2.0 * hits / (truth + found) : 0.0; }
};

// Semi-minor axis of the contour of an ellipse on the photo, pixels.
double SemiMinorPx(const PolygonPoints& polygon) {
  if (polygon.size() < 5) return 0.0;
  const cv::RotatedRect box = cv::fitEllipse(polygon);
  return 0.5 * static_cast<double>(std::min(box.size.width, box.size.height));
}

struct Timed {
  std::vector<DetectedEllipse> ellipses;
  std::vector<PolygonPoints> polygons;
  double edges_ms = 0.0, ellipses_ms = 0.0;
};

Timed RunEllipses(const cv::Mat& image, const Camera& camera) {
  Timed t;
  cv::Mat gray;
  if (!ToGray(image, &gray).ok()) return t;
  EdgeMap edges;
  std::clock_t start = std::clock();
  DetectEdges(gray, EdgeOptions(), &edges);
  t.edges_ms = Milliseconds(start);
  start = std::clock();
  EllipseOptions options;
  options.max_ellipses = 1000;
  DetectEllipses(edges, camera, options, &t.ellipses);
  t.ellipses_ms = Milliseconds(start);
  for (const DetectedEllipse& e : t.ellipses)
    t.polygons.push_back(ContourPolygon(camera, e.fit.conic));
  return t;
}

double BetterNormalDeg(const Matrix3d& conic, const Vector3d& normal) {
  std::array<CirclePose, 2> poses;
  const int n = CirclePoses(conic, &poses);
  double best = 180.0;
  for (int k = 0; k < n; ++k) {
    const double c = std::abs(poses[static_cast<std::size_t>(k)].normal.dot(normal));
    best = std::min(best, kDegrees * std::acos(std::min(1.0, c)));
  }
  return best;
}

struct RenderedImage {
  int group = 0;
  std::vector<PolygonPoints> polygons;
  std::vector<Vector3d> normals;
};

std::map<std::string, RenderedImage> ReadRenderings(const std::string& path) {
  std::map<std::string, RenderedImage> images;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream row(line);
    std::string name, cell;
    std::getline(row, name, ',');
    std::vector<double> v;
    while (std::getline(row, cell, ',')) v.push_back(std::atof(cell.c_str()));
    if (v.size() < 9) continue;
    RenderedImage& image = images[name];
    image.group = static_cast<int>(v[0]);
    Ellipse e;
    e.center = {v[1], v[2]};
    e.a = v[3];
    e.b = v[4];
    e.angle = v[5];
    image.polygons.push_back(EllipsePolygon(e));
    image.normals.emplace_back(v[6], v[7], v[8]);
  }
  return images;
}

// The truth of the renderings lists no rim with a shorter semi-minor axis than this, though some
// are drawn and their photographs of textures hold blobs of that size.
constexpr double kSmallestListedPx = 8.0;

// OpenCV's detectors on the renderings.
void MeasureEllipseBaselines(const std::string& folder,
                             const std::map<std::string, RenderedImage>& images) {
  for (const benchmark::EllipseBaseline& baseline : benchmark::EllipseBaselines()) {
    Score score;
    std::vector<double> ms;
    for (const auto& [name, truth] : images) {
      const cv::Mat image = cv::imread(folder + "/" + name, cv::IMREAD_GRAYSCALE);
      if (image.empty()) continue;
      const std::clock_t start = std::clock();
      const std::vector<Ellipse> found = baseline.detect(image);
      ms.push_back(Milliseconds(start));
      std::vector<PolygonPoints> polygons;
      for (const Ellipse& e : found) {
        if (e.b >= kSmallestListedPx) polygons.push_back(EllipsePolygon(e));
      }
      std::vector<double> overlap;
      Match(truth.polygons, polygons, &overlap);
      score.Add(overlap, polygons.size());
    }
    std::printf("  %-24s %4d %5d   %.3f   %.3f   ms median %.1f worst %.1f\n",
                baseline.name.c_str(), score.truth, score.found, score.F(score.hit80),
                score.F(score.hit95), Quantile(ms, 0.5), Quantile(ms, 1.0));
  }
}

void MeasureRenderings(const std::string& folder) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 800.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  std::array<Score, 5> scores;
  Score listed;
  std::array<std::vector<double>, 5> errors;
  std::vector<double> edges_ms, ellipses_ms;
  const std::map<std::string, RenderedImage> images = ReadRenderings(folder + "/truth.csv");
  for (const auto& [name, truth] : images) {
    const cv::Mat image = cv::imread(folder + "/" + name, cv::IMREAD_GRAYSCALE);
    if (image.empty()) continue;
    const Timed t = RunEllipses(image, camera);
    edges_ms.push_back(t.edges_ms);
    ellipses_ms.push_back(t.ellipses_ms);
    std::vector<double> overlap;
    const std::vector<int> partner = Match(truth.polygons, t.polygons, &overlap);
    std::vector<PolygonPoints> large;
    for (const PolygonPoints& polygon : t.polygons) {
      if (SemiMinorPx(polygon) >= kSmallestListedPx) large.push_back(polygon);
    }
    std::vector<double> overlap_large;
    Match(truth.polygons, large, &overlap_large);
    listed.Add(overlap_large, large.size());
    for (const int group : {truth.group, 4}) {
      const auto g = static_cast<std::size_t>(group);
      scores[g].Add(overlap, t.polygons.size());
      for (std::size_t k = 0; k < partner.size(); ++k) {
        if (overlap[k] < 0.8) continue;
        const auto f = static_cast<std::size_t>(partner[k]);
        errors[g].push_back(BetterNormalDeg(t.ellipses[f].fit.conic, truth.normals[k]));
      }
    }
  }
  std::printf("renderings %s\n  group  truth found  F(0.8) F(0.95)  normal deg: median  90%%\n",
              folder.c_str());
  const std::array<const char*, 5> names = {"plain", "textured", "occluded", "noisy", "all"};
  for (std::size_t g = 0; g < 5; ++g) {
    const Score& s = scores[g];
    std::printf("  %-9s %4d %5d   %.3f   %.3f   %17.3f %5.3f\n", names[g], s.truth, s.found,
                s.F(s.hit80), s.F(s.hit95), Quantile(errors[g], 0.5), Quantile(errors[g], 0.9));
  }
  std::printf("  of %.0f px and more, as the truth lists them:\n", kSmallestListedPx);
  std::printf("  %-24s %4d %5d   %.3f   %.3f\n", "circline", listed.truth, listed.found,
              listed.F(listed.hit80), listed.F(listed.hit95));
  MeasureEllipseBaselines(folder, images);
  std::printf("  ms: edges median %.1f worst %.1f, ellipses median %.1f worst %.1f\n",
              Quantile(edges_ms, 0.5), Quantile(edges_ms, 1.0), Quantile(ellipses_ms, 0.5),
              Quantile(ellipses_ms, 1.0));
}

// ------------------------------------------------------------------------- groundtruth.yml of a
// set

cv::Mat ReadMatrix(const cv::FileNode& node, const char* key) {
  cv::Mat m;
  if (!node[key].empty()) node[key] >> m;
  return m;
}

std::string ReadText(const cv::FileNode& node, const char* key) {
  return node[key].empty() ? std::string() : static_cast<std::string>(node[key]);
}

bool ReadCamera(const cv::FileNode& node, const cv::Size& size, Camera* camera) {
  const cv::Mat k = ReadMatrix(node, "camera_matrix");
  if (k.empty()) return false;
  camera->width = size.width;
  camera->height = size.height;
  camera->fx = k.at<double>(0, 0);
  camera->fy = k.at<double>(1, 1);
  camera->cx = k.at<double>(0, 2);
  camera->cy = k.at<double>(1, 2);
  cv::Mat d = ReadMatrix(node, "distortion_coefficients");
  camera->distortion.fill(0.0);
  camera->model = CameraModel::kPinhole;
  for (int i = 0; i < std::min(8, static_cast<int>(d.total())); ++i) {
    camera->distortion[static_cast<std::size_t>(i)] = d.at<double>(i);
    if (d.at<double>(i) != 0.0) camera->model = CameraModel::kOpenCV;
  }
  return true;
}

bool CameraOf(const cv::FileNode& root, const cv::FileNode& image, const cv::Size& size,
              Camera* camera) {
  if (root["cameras"].empty()) return ReadCamera(root, size, camera);
  for (const cv::FileNode& node : root["cameras"]) {
    if (ReadText(node, "name") == ReadText(image, "camera")) return ReadCamera(node, size, camera);
  }
  return false;
}

Matrix3d ToEigen(const cv::Mat& m) {
  Matrix3d r;
  for (int i = 0; i < 9; ++i) r(i / 3, i % 3) = m.at<double>(i / 3, i % 3);
  return r;
}

Vector3d ToVector(const cv::Mat& m) { return {m.at<double>(0), m.at<double>(1), m.at<double>(2)}; }

void MeasureLabels(const std::string& folder, const cv::FileNode& root) {
  Score all;
  std::vector<double> ms;
  std::printf("labelled ellipses %s\n  photo            labels found  recall(0.8) (0.95)\n",
              folder.c_str());
  for (const cv::FileNode& node : root["images"]) {
    const std::string file = ReadText(node, "file");
    const cv::Mat image = cv::imread(folder + "/" + file, cv::IMREAD_COLOR);
    if (image.empty()) continue;
    Camera camera;  // Not calibrated: any pinhole does for finding ellipses.
    camera.width = image.cols;
    camera.height = image.rows;
    camera.fx = camera.fy = image.cols;
    camera.cx = 0.5 * (image.cols - 1);
    camera.cy = 0.5 * (image.rows - 1);
    const Timed t = RunEllipses(image, camera);
    ms.push_back(t.edges_ms + t.ellipses_ms);
    std::vector<PolygonPoints> truth;
    for (const cv::FileNode& label : node["ellipses"]) {
      const cv::Mat e = ReadMatrix(label, "ellipse");
      Ellipse ellipse;
      ellipse.center = {e.at<double>(0), e.at<double>(1)};
      ellipse.a = e.at<double>(2);
      ellipse.b = e.at<double>(3);
      ellipse.angle = e.at<double>(4) / kDegrees;
      if (2.0 * ellipse.a >= 20.0) truth.push_back(EllipsePolygon(ellipse));
    }
    std::vector<double> overlap;
    Match(truth, t.polygons, &overlap);
    Score s;
    s.Add(overlap, t.polygons.size());
    all.Add(overlap, t.polygons.size());
    std::printf("  %-16s %5d %5d   %8.3f  %8.3f\n", file.c_str(), s.truth, s.found,
                static_cast<double>(s.hit80) / std::max(1, s.truth),
                static_cast<double>(s.hit95) / std::max(1, s.truth));
  }
  std::printf("  all %18d %5d   %8.3f  %8.3f   ms median %.1f worst %.1f\n", all.truth, all.found,
              static_cast<double>(all.hit80) / std::max(1, all.truth),
              static_cast<double>(all.hit95) / std::max(1, all.truth), Quantile(ms, 0.5),
              Quantile(ms, 1.0));
}

// ------------------------------------------------------------------------------ whole photographs

// What is true of one photo, and how far the observations are from it; NaN = not to be had.
struct PhotoErrors {
  int circles = 0, circles_found = 0;
  double normal_deg = std::nan("");    // Median over the circles found, better of two.
  double rotation_deg = std::nan("");  // From the two in-plane pencils, up to the board's symmetry.
  std::vector<double> directions_deg;
};

double DirectionDeg(const Vector3d& a, const Vector3d& b) {
  return kDegrees * std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
}

// Angle between rotations up to the symmetry of a square board.
double BoardRotationDeg(const Matrix3d& a, const Matrix3d& b) {
  double best = 1e9;
  for (int axis = 0; axis < 2; ++axis) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      Matrix3d s = Matrix3d::Identity();
      const double half_turn = axis == 0 ? 1.0 : -1.0;
      s << 1, 0, 0, 0, half_turn, 0, 0, 0, half_turn;
      const double c = std::cos(quarter * 1.5707963267948966);
      const double d = std::sin(quarter * 1.5707963267948966);
      Matrix3d z;
      z << c, -d, 0, d, c, 0, 0, 0, 1;
      best = std::min(best, kDegrees * RotationAngle(a * z * s, b));
    }
  }
  return best;
}

PhotoErrors MeasurePhoto(const cv::FileNode& node, const Camera& camera,
                         const Observations& found) {
  PhotoErrors errors;
  std::vector<PolygonPoints> truth, polygons;
  std::vector<Vector3d> normals;
  for (const char* key : {"circles", "ellipses"}) {
    for (const cv::FileNode& circle : node[key]) {
      const cv::Mat e = ReadMatrix(circle, "fitted_ellipse_raw");
      const cv::Mat n = ReadMatrix(circle, "normal_cam");
      if (e.empty()) continue;
      Ellipse ellipse;
      ellipse.center = {e.at<double>(0), e.at<double>(1)};
      ellipse.a = e.at<double>(2);
      ellipse.b = e.at<double>(3);
      ellipse.angle = e.at<double>(4) / kDegrees;
      truth.push_back(EllipsePolygon(ellipse));
      normals.push_back(n.empty() ? Vector3d::Zero() : ToVector(n));
    }
  }
  for (const CircleObservation& circle : found.circles) {
    polygons.push_back(circle.fit ? ContourPolygon(camera, circle.fit->conic) : PolygonPoints());
  }
  std::vector<double> overlap, normal_errors;
  const std::vector<int> partner = Match(truth, polygons, &overlap);
  errors.circles = static_cast<int>(truth.size());
  for (std::size_t k = 0; k < partner.size(); ++k) {
    if (overlap[k] < 0.8) continue;
    ++errors.circles_found;
    const CircleObservation& circle = found.circles[static_cast<std::size_t>(partner[k])];
    if (!normals[k].isZero())
      normal_errors.push_back(BetterNormalDeg(circle.fit->conic, normals[k]));
  }
  if (!normal_errors.empty()) errors.normal_deg = Quantile(normal_errors, 0.5);
  const cv::Mat rotation = ReadMatrix(node, "R");
  std::vector<Vector3d> in_plane;
  for (const PencilObservation& pencil : found.pencils) {
    if (!pencil.plane.empty() && pencil.fit) in_plane.push_back(pencil.fit->direction);
  }
  Matrix3d estimate;
  if (!rotation.empty() && in_plane.size() >= 2 &&
      RotationFromOrthogonalDirections(in_plane[0], 1.0, in_plane[1], 1.0, &estimate)) {
    errors.rotation_deg = BoardRotationDeg(estimate, ToEigen(rotation));
  }
  for (const cv::FileNode& direction : node["directions"]) {
    const Vector3d d = ToVector(ReadMatrix(direction, "direction_cam"));
    double best = 90.0;
    for (const PencilObservation& pencil : found.pencils) {
      if (pencil.fit) best = std::min(best, DirectionDeg(pencil.fit->direction, d));
    }
    errors.directions_deg.push_back(best);
  }
  return errors;
}

// Root mean square distances of the points of the circles found to the true conics, and what the
// set records of its own edge points.
struct ContourRms {
  std::vector<double> found, recorded;
};

void MeasureContours(const cv::FileNode& node, const Camera& camera, const Observations& found,
                     ContourRms* rms) {
  for (const cv::FileNode& circle : node["circles"]) {
    const cv::Mat center = ReadMatrix(circle, "centre_cam"),
                  normal = ReadMatrix(circle, "normal_cam");
    const cv::FileNode recorded = circle["contour_rms_to_ground_truth_px"];
    if (center.empty() || normal.empty() || recorded.empty() || circle["radius"].empty()) continue;
    CirclePose pose;
    pose.normal = ToVector(normal);
    pose.center = ToVector(center) / static_cast<double>(circle["radius"]);
    const Matrix3d conic = ProjectCircle(pose);
    const PolygonPoints truth = ContourPolygon(camera, conic);
    for (const CircleObservation& observation : found.circles) {
      if (!observation.fit ||
          IntersectionOverUnion(truth, ContourPolygon(camera, observation.fit->conic)) < 0.8) {
        continue;
      }
      double sum = 0.0, n = 0.0;
      for (const Vector2d& pixel : observation.points) {
        CalibratedPoint p;
        if (!PixelToCalibrated(camera, pixel, &p)) continue;
        const double d = ConicDistancePx(p, conic);
        sum += d * d;
        n += 1.0;
      }
      rms->found.push_back(std::sqrt(sum / n));
      rms->recorded.push_back(static_cast<double>(recorded));
      break;
    }
  }
}

// A row or column of a chessboard's corners: its line, and how far it reaches.
struct BoardLine {
  Vector3d line;
  Segment ends;
};

// Of a board of 9 x 6 corners, given row by row.
std::vector<BoardLine> BoardLines(const cv::FileNode& node, const Camera& camera) {
  constexpr int kColumns = 9, kRows = 6;
  std::vector<BoardLine> lines;
  const cv::Mat corners = ReadMatrix(node, "corners");
  if (corners.rows != kColumns * kRows || !node["corner_ids"].empty()) return lines;
  const auto add = [&](int first, int step, int count) {
    std::vector<CalibratedPoint> points;
    BoardLine line;
    for (int k = 0; k < count; ++k) {
      const int i = first + k * step;
      const Vector2d pixel(corners.at<double>(i, 0), corners.at<double>(i, 1));
      CalibratedPoint p;
      if (!PixelToCalibrated(camera, pixel, &p)) continue;
      points.push_back(p);
      if (k == 0) line.ends[0] = pixel;
      line.ends[1] = pixel;
    }
    LineFit fit;
    if (!FitLine(points, 1.0, &fit).ok()) return;
    line.line = fit.line;
    lines.push_back(line);
  };
  for (int row = 0; row < kRows; ++row) add(row * kColumns, 1, kColumns);
  for (int column = 0; column < kColumns; ++column) add(column, kColumns, kRows);
  return lines;
}

// Adds the squared distances of both ends of every segment that runs along one of the lines.
void AddEndResiduals(const std::vector<BoardLine>& lines, const Camera& camera,
                     const std::vector<Segment>& segments, std::vector<double>* squares) {
  constexpr double kAlongPx = 2.0, kMinLengthPx = 20.0;
  for (const Segment& segment : segments) {
    if ((segment[1] - segment[0]).norm() < kMinLengthPx) continue;
    for (const BoardLine& line : lines) {
      const Vector2d along = line.ends[1] - line.ends[0];
      std::array<double, 2> distance;
      bool belongs = true;
      for (std::size_t k = 0; k < 2; ++k) {
        CalibratedPoint p;
        const double t = along.dot(segment[k] - line.ends[0]) / along.squaredNorm();
        belongs = belongs && t > -0.2 && t < 1.2 && PixelToCalibrated(camera, segment[k], &p);
        if (!belongs) break;
        distance[k] = LineDistancePx(p, line.line);
        belongs = std::abs(distance[k]) < kAlongPx;
      }
      if (!belongs) continue;
      for (const double d : distance) squares->push_back(d * d);
      break;
    }
  }
}

// The ends of a detected line as its fit has them: moved across onto it.
Segment FittedEnds(const DetectedLine& line, const Camera& camera) {
  Segment ends = line.ends;
  for (Vector2d& end : ends) {
    CalibratedPoint p;
    if (!PixelToCalibrated(camera, end, &p)) continue;
    const Vector2d across = p.GradientPerPixel(line.fit.line.head<2>()).normalized();
    end -= LineDistancePx(p, line.fit.line) * across;
  }
  return ends;
}

void PrintResiduals(const std::string& name, const std::vector<double>& squares,
                    const std::vector<double>& ms) {
  double sum = 0.0;
  for (const double s : squares) sum += s;
  std::printf(
      "  segments, %-22s %6d ends, rms to the board's lines %.3f px, median %.3f; ms %.1f\n",
      name.c_str(), static_cast<int>(squares.size()),
      std::sqrt(sum / static_cast<double>(squares.size())), std::sqrt(Quantile(squares, 0.5)),
      Quantile(ms, 0.5));
}

// End points of segments on the edges of chessboards; ours and OpenCV's.
void MeasureSegments(const std::string& folder, const cv::FileNode& root) {
  std::vector<benchmark::SegmentBaseline> baselines = benchmark::SegmentBaselines();
  std::vector<std::vector<double>> squares(baselines.size() + 1), ms(baselines.size() + 1);
  for (const cv::FileNode& node : root["images"]) {
    const cv::Mat gray = cv::imread(folder + "/" + ReadText(node, "file"), cv::IMREAD_GRAYSCALE);
    Camera camera;
    if (gray.empty() || !CameraOf(root, node, gray.size(), &camera)) continue;
    const std::vector<BoardLine> lines = BoardLines(node, camera);
    if (lines.empty()) continue;
    std::clock_t start = std::clock();
    EdgeMap edges;
    std::vector<DetectedLine> found;
    DetectEdges(gray, EdgeOptions(), &edges);
    DetectLines(edges, camera, LineOptions(), &found);
    ms[0].push_back(Milliseconds(start));
    std::vector<Segment> segments;
    for (const DetectedLine& line : found) segments.push_back(FittedEnds(line, camera));
    AddEndResiduals(lines, camera, segments, &squares[0]);
    for (std::size_t k = 0; k < baselines.size(); ++k) {
      start = std::clock();
      segments = baselines[k].detect(gray);
      ms[k + 1].push_back(Milliseconds(start));
      AddEndResiduals(lines, camera, segments, &squares[k + 1]);
    }
  }
  if (squares[0].empty()) return;
  PrintResiduals("circline", squares[0], ms[0]);
  for (std::size_t k = 0; k < baselines.size(); ++k) {
    PrintResiduals(baselines[k].name, squares[k + 1], ms[k + 1]);
  }
}

void MeasurePhotographs(const std::string& folder, const cv::FileNode& root) {
  std::printf(
      "photographs %s\n  photo                       circles pencils  normal deg  board deg"
      "  directions deg     ms\n",
      folder.c_str());
  std::vector<double> normals, rotations, ms;
  ContourRms contours;
  int circles = 0, circles_found = 0;
  for (const cv::FileNode& node : root["images"]) {
    const std::string file = ReadText(node, "file");
    const cv::Mat image = cv::imread(folder + "/" + file, cv::IMREAD_COLOR);
    Camera camera;
    if (image.empty() || !CameraOf(root, node, image.size(), &camera)) continue;
    Observations found;
    const std::clock_t start = std::clock();
    const Status status = DetectObservations(image, camera, DetectionOptions(), &found);
    ms.push_back(Milliseconds(start));
    if (!status.ok()) {
      std::printf("  %s: %s\n", file.c_str(), status.message.c_str());
      continue;
    }
    const PhotoErrors e = MeasurePhoto(node, camera, found);
    MeasureContours(node, camera, found, &contours);
    circles += e.circles;
    circles_found += e.circles_found;
    if (!std::isnan(e.normal_deg)) normals.push_back(e.normal_deg);
    if (!std::isnan(e.rotation_deg)) rotations.push_back(e.rotation_deg);
    std::printf("  %-26s %3d/%3d/%2d", file.c_str(), e.circles_found, e.circles,
                static_cast<int>(found.circles.size()));
    for (const PencilObservation& pencil : found.pencils) {
      std::printf(" %s%s%d", PencilDirectionName(pencil.direction), pencil.plane.c_str(),
                  static_cast<int>(pencil.lines.size()));
    }
    std::printf("  %.3f  %.3f ", e.normal_deg, e.rotation_deg);
    for (const double d : e.directions_deg) std::printf(" %.3f", d);
    std::printf("  %.1f  %s\n", ms.back(), found.message.c_str());
  }
  std::printf(
      "  circles %d of %d; median normal %.3f (90%% %.3f), board %.3f (90%% %.3f, %d photos)"
      "; ms median %.1f worst %.1f\n",
      circles_found, circles, Quantile(normals, 0.5), Quantile(normals, 0.9),
      Quantile(rotations, 0.5), Quantile(rotations, 0.9), static_cast<int>(rotations.size()),
      Quantile(ms, 0.5), Quantile(ms, 1.0));
  if (!contours.found.empty()) {
    std::printf("  contour rms to the truth: median %.3f px of %d, the set's own edges %.3f px\n",
                Quantile(contours.found, 0.5), static_cast<int>(contours.found.size()),
                Quantile(contours.recorded, 0.5));
  }
  MeasureSegments(folder, root);
}

void MeasureFolder(const std::string& folder) {
  if (std::ifstream(folder + "/truth.csv").good()) {
    MeasureRenderings(folder);
    return;
  }
  cv::FileStorage file;
  if (!std::ifstream(folder + "/groundtruth.yml").good() ||
      !file.open(folder + "/groundtruth.yml", cv::FileStorage::READ)) {
    return;
  }
  const cv::FileNode root = file.root();
  const bool calibrated = !root["camera_matrix"].empty() || !root["cameras"].empty();
  if (calibrated) {
    MeasurePhotographs(folder, root);
  } else {
    MeasureLabels(folder, root);
  }
}

std::string Flag(int argc, char** argv, const std::string& name) {
  const std::string prefix = "--" + name + "=";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind(prefix, 0) == 0) return argument.substr(prefix.size());
  }
  return std::string();
}

int Main(int argc, char** argv) {
  const std::string data = Flag(argc, argv, "data"), set = Flag(argc, argv, "set");
  if (data.empty()) {
    std::fprintf(stderr, "usage: %s --data=DIR [--set=NAME]\n", argv[0]);
    return 2;
  }
  cv::setNumThreads(1);
  if (!set.empty()) {
    MeasureFolder(data + "/" + set);
    return 0;
  }
  std::vector<cv::String> files;
  cv::glob(data + "/*", files, true);
  std::vector<std::string> folders;
  for (const std::string& f : files) {
    const std::string folder = f.substr(0, f.find_last_of('/'));
    if (folders.empty() || folders.back() != folder) folders.push_back(folder);
  }
  std::sort(folders.begin(), folders.end());
  folders.erase(std::unique(folders.begin(), folders.end()), folders.end());
  for (const std::string& folder : folders) MeasureFolder(folder);
  return 0;
}

}  // namespace
}  // namespace circline

int main(int argc, char** argv) { return circline::Main(argc, argv); }
