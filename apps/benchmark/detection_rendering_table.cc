// The table of ellipses on renderings.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "apps/benchmark/detection_ellipses.h"
#include "apps/benchmark/detection_render.h"
#include "apps/benchmark/detection_tables.h"
#include "apps/benchmark/timing.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kGroups = 4;  // RenderedImage::group: plain, textured, occluded, noisy.

// What is found in a set of renderings.
class RenderingScores {
 public:
  void Add(const cv::Mat& image, const RenderedImage& truth) {
    std::vector<PolygonPoints> polygons, large;
    for (const Ellipse& e : truth.ellipses) polygons.push_back(EllipsePolygon(e));
    const FoundEllipses found = FindEllipses(image, PinholeCamera());
    ms.push_back(found.edges_ms + found.ellipses_ms);
    for (const PolygonPoints& polygon : found.polygons) {
      if (SemiMinorPx(polygon) >= kSmallestListedPx) large.push_back(polygon);
    }
    std::vector<double> overlap;
    Match(polygons, large, &overlap);
    listed.Add(overlap, large.size());
    const std::vector<int> partner = Match(polygons, found.polygons, &overlap);
    AddRings(truth, overlap);
    for (std::size_t k = 0; k < partner.size(); ++k) {
      if (overlap[k] < 0.8) continue;
      const auto f = static_cast<std::size_t>(partner[k]);
      errors[static_cast<std::size_t>(truth.group)].push_back(
          BetterNormalDeg(found.ellipses[f].fit.conic, truth.normals[k]));
    }
  }

  double BothRims() const { return rings > 0 ? static_cast<double>(both_rims) / rings : 1.0; }

  std::array<std::vector<double>, kGroups> errors;  // Of normals, degrees.
  Score listed;                                     // Of ellipses of kSmallestListedPx and more.
  std::vector<double> ms;

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

void PrintRow(const std::string& name, const std::array<double, 10>& row) {
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

bool MeasureRenderings(const std::string& textures, int first_seed, int num_seeds, int count) {
  const Renderer renderer(textures);
  if (!renderer.ok()) return false;
  std::printf(
      "renderings, ellipses of %.0f px and more; a ring's rims both at 0.8; normals: median "
      "deg\n  seed  truth found  F(0.8) F(0.95)  both rims  plain textured occluded noisy   ms\n",
      kSmallestListedPx);
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
    for (std::size_t g = 0; g < kGroups; ++g) row[5 + g] = Quantile(scores.errors[g], 0.5);
    row[9] = Quantile(scores.ms, 0.5);
    PrintRow(std::to_string(seed), row);
    for (std::size_t k = 0; k < row.size(); ++k) sums[k] += row[k] / num_seeds;
  }
  PrintRow("mean", sums);
  return true;
}

}  // namespace circline::apps
