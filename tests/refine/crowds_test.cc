#include "circline/refine/crowds.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/random.h"
#include "tests/paper_scene.h"

namespace circline {
namespace {

constexpr double kSigma = 3.0;

// 25 points along 360 px with noise, then 25 in a disc of 15 px, 40 px off.
std::vector<Eigen::Vector2d> LineAndCrowd(Random* random) {
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < 25; ++i) {
    const double dx = random->Normal(), dy = random->Normal();
    pixels.emplace_back(15.0 * i + kSigma * dx, kSigma * dy);
  }
  for (int i = 0; i < 25; ++i) {
    const double r = 15.0 * std::sqrt(random->Uniform()), a = random->Uniform(0.0, 6.2832);
    pixels.emplace_back(100.0 + r * std::cos(a), 40.0 + r * std::sin(a));
  }
  return pixels;
}

TEST(CrowdsTest, ACrowdIsFoundAndTheLineKept) {
  Random random(1);
  int found = 0, lost = 0;
  constexpr int kTrials = 100;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::vector<std::uint8_t> strung = NotCrowded(LineAndCrowd(&random), kSigma);
    lost += static_cast<int>(std::count(strung.begin(), strung.begin() + 25, 0));
    found += static_cast<int>(std::count(strung.begin() + 25, strung.end(), 0));
  }
  EXPECT_LT(lost, 0.01 * 25 * kTrials);
  EXPECT_GT(found, 0.7 * 25 * kTrials);
}

// However densely: a chain of edge points is no crowd, nor is one whose ends are cut short.
TEST(CrowdsTest, AContourIsNoCrowd) {
  for (const double step : {0.05, 0.25, 1.0, 10.0}) {
    std::vector<Eigen::Vector2d> pixels;
    for (int i = 0; i < 200; ++i) {
      const double a = step * i / 60.0;
      pixels.emplace_back(60.0 * std::cos(a), 60.0 * std::sin(a));
    }
    const std::vector<std::uint8_t> strung = NotCrowded(pixels, 0.3);
    EXPECT_EQ(std::count(strung.begin(), strung.end(), 0), 0) << "step " << step;
  }
}

// A fit that has followed a crowd finds back to its line. Points of the line are 16 px apart, one
// px to either side in turn, so that none has a neighbour within 15 px (five sigmas); each of 25
// spread evenly over a disc of that radius has 39 % of them, or more. So all of the crowd is told,
// and the mask of the fit's far end, 6 points on 80 px, grows to the whole line.
TEST(CrowdsTest, RefitLeavesTheCrowd) {
  PencilObservation pencil;
  pencil.id = "L1";
  pencil.sigma_px = kSigma;
  pencil.lines.resize(1);
  LineObservation& line = pencil.lines[0];
  for (int i = 0; i < 25; ++i) line.points.emplace_back(16.0 * i, i % 2 == 0 ? 1.0 : -1.0);
  for (int i = 0; i < 25; ++i) {
    const double r = 15.0 * std::sqrt((i + 0.5) / 25.0), a = 2.399963 * i;  // A sunflower's seeds.
    line.points.emplace_back(100.0 + r * std::cos(a), 40.0 + r * std::sin(a));
  }
  // The line through the middle of the crowd and the far end of the true one.
  const Eigen::Vector2d along = Eigen::Vector2d(284.0, -40.0).normalized();
  for (const Eigen::Vector2d& p : line.points) {
    const Eigen::Vector2d d = p - Eigen::Vector2d(100.0, 40.0);
    line.inliers.push_back(std::abs(d.x() * along.y() - d.y() * along.x()) < 9.0 ? 1 : 0);
  }
  ASSERT_GT(std::count(line.inliers.begin() + 25, line.inliers.end(), 1), 10);
  Observations observations;
  observations.camera = PaperCamera();
  observations.pencils = {pencil};
  FitDirect(kSigma, &observations);
  const auto height_at = [&](double x) {
    const Eigen::Vector3d& l = observations.pencils[0].lines[0].fit->line;
    return -(l.x() * x + l.z() * 1800.0) / l.y();
  };
  ASSERT_GT(height_at(100.0), 20.0);
  EstimationOptions options;
  options.conic_loss.type = options.line_loss.type = LossType::kTukey;
  RefitWithoutCrowds(options, &observations);
  const std::vector<std::uint8_t>& inliers = observations.pencils[0].lines[0].inliers;
  EXPECT_EQ(std::count(inliers.begin(), inliers.begin() + 25, 1), 25);
  EXPECT_EQ(std::count(inliers.begin() + 25, inliers.end(), 1), 0);
  EXPECT_NEAR(height_at(0.0), 0.0, 0.2);
  EXPECT_NEAR(height_at(384.0), 0.0, 0.2);
}

TEST(CrowdsTest, OtherLossesKeepTheMaskAsItIs) {
  Random random(3);
  Observations observations = PaperScene(1.0, &random);
  observations.circles[0].inliers.assign(observations.circles[0].points.size(), 1);
  for (std::size_t i = 0; i < 40; ++i) observations.circles[0].inliers[i] = 0;
  FitDirect(1.0, &observations);
  const std::vector<std::uint8_t> before = observations.circles[0].inliers;
  RefitWithoutCrowds(EstimationOptions(), &observations);
  EXPECT_EQ(observations.circles[0].inliers, before);
}

}  // namespace
}  // namespace circline
