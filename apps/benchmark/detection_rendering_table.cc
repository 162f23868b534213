// Tables of ellipses on renderings.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "apps/benchmark/baseline_detectors.h"
#include "apps/benchmark/detection_ellipses_run.h"
#include "apps/benchmark/detection_render.h"
#include "apps/benchmark/detection_statistics.h"
#include "apps/benchmark/detection_tables.h"
#include "apps/benchmark/detection_truth.h"
#include "apps/benchmark/ellipse_overlap.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"

namespace circline::benchmark {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::array<const char*, 5> kGroups = {"plain", "textured", "occluded", "noisy", "all"};

std::vector<PolygonPoints> Polygons(const std::vector<Ellipse>& ellipses) {
  std::vector<PolygonPoints> polygons;
  for (const Ellipse& e : ellipses) polygons.push_back(EllipsePolygon(e));
  return polygons;
}

// What is found in a set of renderings. Groups as in kGroups.
class RenderingScores {
 public:
  void Add(const cv::Mat& image, const RenderedImage& truth) {
    const std::vector<PolygonPoints> polygons = Polygons(truth.ellipses);
    for (const Ellipse& e : truth.ellipses) smallest_px = std::min(smallest_px, e.b);
    const Timed t = RunEllipses(image, RenderingCamera());
    edges_ms.push_back(t.edges_ms);
    ellipses_ms.push_back(t.ellipses_ms);
    both_ms.push_back(t.edges_ms + t.ellipses_ms);
    std::vector<PolygonPoints> large;
    for (const PolygonPoints& polygon : t.polygons) {
      if (SemiMinorPx(polygon) >= kSmallestListedPx) large.push_back(polygon);
    }
    std::vector<double> overlap_large;
    Match(polygons, large, &overlap_large);
    listed.Add(overlap_large, large.size());
    std::vector<double> overlap;
    const std::vector<int> partner = Match(polygons, t.polygons, &overlap);
    AddRings(truth, overlap);
    for (const int group : {truth.group, 4}) {
      const auto g = static_cast<std::size_t>(group);
      groups[g].Add(overlap, t.polygons.size());
      for (std::size_t k = 0; k < partner.size(); ++k) {
        if (overlap[k] < 0.8) continue;
        const auto f = static_cast<std::size_t>(partner[k]);
        errors[g].push_back(BetterNormalDeg(t.ellipses[f].fit.conic, truth.normals[k]));
      }
    }
  }

  double BothRims() const { return rings > 0 ? static_cast<double>(both_rims) / rings : 1.0; }

  std::array<Score, 5> groups;
  std::array<std::vector<double>, 5> errors;  // Of normals, degrees.
  Score listed;                               // Of those of kSmallestListedPx and more.
  double smallest_px = 1e9;
  std::vector<double> edges_ms, ellipses_ms, both_ms;

 private:
  // The two rims of a ring follow each other in the truth.
  void AddRings(const RenderedImage& truth, const std::vector<double>& overlap) {
    for (std::size_t k = 0; k + 1 < overlap.size(); ++k) {
      if (truth.centers[k] != truth.centers[k + 1]) continue;
      ++rings;
      both_rims += overlap[k] >= 0.8 && overlap[k + 1] >= 0.8 ? 1 : 0;
    }
  }

  int rings = 0, both_rims = 0;
};

// OpenCV's detectors on the renderings.
void MeasureEllipseBaselines(const std::string& folder,
                             const std::map<std::string, RenderedImage>& images) {
  for (const EllipseBaseline& baseline : EllipseBaselines()) {
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
      Match(Polygons(truth.ellipses), polygons, &overlap);
      score.Add(overlap, polygons.size());
    }
    std::printf("  %-24s %4d %5d   %.3f   %.3f   ms median %.1f worst %.1f\n",
                baseline.name.c_str(), score.truth, score.found, score.F(score.hit80),
                score.F(score.hit95), Quantile(ms, 0.5), Quantile(ms, 1.0));
  }
}

void PrintFreshHeader() {
  std::printf(
      "fresh renderings, ellipses of %.0f px and more; a ring's rims both at 0.8; normals: median "
      "deg\n  seed  truth found  F(0.8) F(0.95)  both rims  plain textured occluded noisy   ms\n",
      kSmallestListedPx);
}

void PrintFreshRow(const std::string& name, const std::array<double, 10>& row) {
  std::printf("  %-4s %6.0f %5.0f   %.3f   %.3f      %.3f  %.3f    %.3f    %.3f %.3f  %.1f\n",
              name.c_str(), row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8],
              row[9]);
}

}  // namespace

double BetterNormalDeg(const Matrix3d& conic, const Vector3d& normal) {
  std::array<CirclePose, 2> poses;
  const int n = CirclePoses(conic, &poses);
  double best = 180.0;
  for (int k = 0; k < n; ++k) {
    const double c = std::abs(poses[static_cast<std::size_t>(k)].normal.dot(normal));
    best = std::min(best, std::acos(std::min(1.0, c)) / kDegree);
  }
  return best;
}

void MeasureRenderings(const std::string& folder) {
  RenderingScores scores;
  const std::map<std::string, RenderedImage> images = ReadRenderings(folder + "/truth.csv");
  for (const auto& [name, truth] : images) {
    const cv::Mat image = cv::imread(folder + "/" + name, cv::IMREAD_GRAYSCALE);
    if (!image.empty()) scores.Add(image, truth);
  }
  std::printf("renderings %s\n  group  truth found  F(0.8) F(0.95)  normal deg: median  90%%\n",
              folder.c_str());
  for (std::size_t g = 0; g < kGroups.size(); ++g) {
    const Score& s = scores.groups[g];
    std::printf("  %-9s %4d %5d   %.3f   %.3f   %17.3f %5.3f\n", kGroups[g], s.truth, s.found,
                s.F(s.hit80), s.F(s.hit95), Quantile(scores.errors[g], 0.5),
                Quantile(scores.errors[g], 0.9));
  }
  std::printf(
      "  of %.0f px and more (the smallest that the truth lists has a semi-axis of %.2f px):\n",
      kSmallestListedPx, scores.smallest_px);
  const Score& listed = scores.listed;
  std::printf("  %-24s %4d %5d   %.3f   %.3f   both rims of %.3f of the rings\n", "circline",
              listed.truth, listed.found, listed.F(listed.hit80), listed.F(listed.hit95),
              scores.BothRims());
  MeasureEllipseBaselines(folder, images);
  std::printf(
      "  ms: edges median %.1f worst %.1f, ellipses besides %.1f %.1f, both together %.1f %.1f\n",
      Quantile(scores.edges_ms, 0.5), Quantile(scores.edges_ms, 1.0),
      Quantile(scores.ellipses_ms, 0.5), Quantile(scores.ellipses_ms, 1.0),
      Quantile(scores.both_ms, 0.5), Quantile(scores.both_ms, 1.0));
}

bool MeasureFreshRenderings(const std::string& textures, int first_seed, int num_seeds, int count) {
  const Renderer renderer(textures);
  if (!renderer.ok()) return false;
  PrintFreshHeader();
  std::array<double, 10> sums{};
  for (int seed = first_seed; seed < first_seed + num_seeds; ++seed) {
    RenderingScores scores;
    for (int k = 0; k < count; ++k) {
      RenderedImage truth;
      const cv::Mat image = renderer.Render(static_cast<std::uint64_t>(seed), k, &truth);
      scores.Add(image, truth);
    }
    const Score& s = scores.listed;
    std::array<double, 10> row = {static_cast<double>(s.truth), static_cast<double>(s.found),
                                  s.F(s.hit80), s.F(s.hit95), scores.BothRims()};
    for (std::size_t g = 0; g < 4; ++g) row[5 + g] = Quantile(scores.errors[g], 0.5);
    row[9] = Quantile(scores.both_ms, 0.5);
    PrintFreshRow(std::to_string(seed), row);
    for (std::size_t k = 0; k < row.size(); ++k) sums[k] += row[k] / num_seeds;
  }
  PrintFreshRow("mean", sums);
  return true;
}

bool WriteRenderings(const std::string& textures, int seed, int count, const std::string& folder) {
  const Renderer renderer(textures);
  std::ofstream file(folder + "/truth.csv");
  if (!renderer.ok() || !file.good()) return false;
  file << "image,group,cx,cy,a,b,theta_rad,nx,ny,nz,centre_u,centre_v\n";
  for (int k = 0; k < count; ++k) {
    RenderedImage truth;
    std::array<char, 256> line{};
    std::snprintf(line.data(), line.size(), "s%03d.png", k);
    const std::string name = line.data();
    const cv::Mat image = renderer.Render(static_cast<std::uint64_t>(seed), k, &truth);
    if (!cv::imwrite(folder + "/" + name, image)) return false;
    for (std::size_t i = 0; i < truth.ellipses.size(); ++i) {
      const Ellipse& e = truth.ellipses[i];
      const Vector3d& n = truth.normals[i];
      std::snprintf(line.data(), line.size(),
                    ",%d,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", truth.group,
                    e.center.x(), e.center.y(), e.a, e.b, e.angle, n.x(), n.y(), n.z(),
                    truth.centers[i].x(), truth.centers[i].y());
      file << name << line.data();
    }
  }
  return file.good();
}

}  // namespace circline::benchmark
