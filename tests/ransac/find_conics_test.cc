#include "circline/ransac/find_conics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "circline/estimators/random.h"
#include "tests/ransac/conic_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

using conic_scene::kPi;
using conic_scene::TestCamera;

struct Scene {
  std::vector<Ellipse> ellipses;  // Pixels.
  std::vector<Eigen::Vector2d> pixels;
  EdgeDirections directions;
  std::vector<CalibratedPoint> points;

  void AddEllipse(const Ellipse& ellipse, int num_points, Random* random) {
    ellipses.push_back(ellipse);
    for (int i = 0; i < num_points; ++i) {
      const double t = 2.0 * kPi * i / num_points;
      const double nx = random->Normal(), ny = random->Normal();
      pixels.push_back(EllipsePoint(ellipse, t) + 0.5 * Eigen::Vector2d(nx, ny));
      const Eigen::Vector2d local(std::cos(t) / ellipse.a, std::sin(t) / ellipse.b);
      directions.normals.push_back(
          (Eigen::Rotation2Dd(ellipse.angle + 0.05 * random->Normal()) * local).normalized());
    }
  }
  void AddClutter(int num_points, Random* random) {
    for (int i = 0; i < num_points; ++i) {
      const double x = random->Uniform(0.0, 640.0), y = random->Uniform(0.0, 480.0);
      Add({x, y}, random);
    }
  }
  void AddBlob(const Eigen::Vector2d& center, double radius, int num_points, Random* random) {
    for (int i = 0; i < num_points; ++i) {
      const double r = radius * std::sqrt(random->Uniform());
      const double angle = random->Uniform(0.0, 2.0 * kPi);
      Add(center + r * Eigen::Vector2d(std::cos(angle), std::sin(angle)), random);
    }
  }
  void Calibrate() { PixelsToCalibrated(TestCamera(), pixels, &points); }

  // Ellipses of the scene whose contour lies within a pixel of one that was found.
  int NumFound(const std::vector<FoundConic>& conics) const {
    int found = 0;
    for (const Ellipse& ellipse : ellipses) {
      const bool seen = std::any_of(conics.begin(), conics.end(), [&](const FoundConic& conic) {
        for (int i = 0; i < 64; ++i) {
          CalibratedPoint p;
          EXPECT_TRUE(PixelToCalibrated(TestCamera(), EllipsePoint(ellipse, 0.1 * i), &p));
          if (!(std::abs(ConicDistancePx(p, conic.fit.conic)) < 1.0)) return false;
        }
        return true;
      });
      found += seen ? 1 : 0;
    }
    return found;
  }

 private:
  void Add(const Eigen::Vector2d& pixel, Random* random) {
    pixels.push_back(pixel);
    const double angle = random->Uniform(0.0, kPi);
    directions.normals.emplace_back(std::cos(angle), std::sin(angle));
  }
};

// Four ellipses, two of them concentric, one crossing another, among as much clutter again.
Scene MakeScene(std::uint64_t seed, int clutter = 320) {
  Random random(seed);
  Scene scene;
  const double angle = random.Uniform(-1.5, 1.5);
  scene.AddEllipse({{200.0, 200.0}, 100.0, 60.0, angle}, 100, &random);
  scene.AddEllipse({{200.0, 200.0}, 70.0, 42.0, angle}, 80, &random);
  scene.AddEllipse({{290.0, 230.0}, 60.0, 50.0, random.Uniform(-1.5, 1.5)}, 80, &random);
  scene.AddEllipse({{500.0, 350.0}, 50.0, 30.0, random.Uniform(-1.5, 1.5)}, 60, &random);
  scene.AddClutter(clutter, &random);
  scene.Calibrate();
  return scene;
}

FindConicsOptions HalfPixelOptions() {
  FindConicsOptions options;
  options.fit.sigma_px = 0.5;
  options.fit.ransac.threshold = kInlierSigmas * 0.5;
  return options;
}

TEST(FindConics, FindsThemAllAndNothingElse) {
  constexpr std::uint64_t kTrials = Trials(12);
  for (const bool with_directions : {false, true}) {
    int incomplete = 0;
    for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
      const Scene scene = MakeScene(seed);
      std::vector<FoundConic> conics;
      ASSERT_TRUE(FindConics(scene.points, HalfPixelOptions(), &conics,
                             with_directions ? &scene.directions : nullptr)
                      .ok());
      EXPECT_LE(conics.size(), 4u) << seed;
      incomplete += scene.NumFound(conics) == 4 ? 0 : 1;
    }
    EXPECT_LE(incomplete, 1) << with_directions;
  }
}

TEST(FindConics, NoPointIsUsedTwice) {
  constexpr std::uint64_t kTrials = Trials(4);
  for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
    const Scene scene = MakeScene(seed);
    std::vector<FoundConic> conics;
    const FindConicsOptions options = HalfPixelOptions();
    ASSERT_TRUE(FindConics(scene.points, options, &conics).ok());
    std::set<int> used;
    for (const FoundConic& conic : conics) {
      EXPECT_TRUE(std::is_sorted(conic.points.begin(), conic.points.end()));
      EXPECT_GE(static_cast<int>(conic.points.size()), options.min_points);
      EXPECT_LE(conic.log_false_alarms, std::log(options.max_false_alarms));
      for (const int i : conic.points) {
        EXPECT_TRUE(used.insert(i).second) << i;
        EXPECT_LE(
            std::abs(ConicDistancePx(scene.points[static_cast<std::size_t>(i)], conic.fit.conic)),
            options.fit.ransac.threshold);
      }
    }
  }
}

TEST(FindConics, ClutterAloneHoldsNone) {
  int found = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    Scene scene;
    scene.AddClutter(200, &random);
    scene.Calibrate();
    FindConicsOptions options = HalfPixelOptions();
    options.fit.ransac.max_iterations = 20000;
    std::vector<FoundConic> conics;
    ASSERT_TRUE(FindConics(scene.points, options, &conics).ok());
    found += static_cast<int>(conics.size());
  }
  EXPECT_EQ(found, 0);
}

TEST(FindConics, ABlobIsNoEllipse) {
  constexpr std::uint64_t kTrials = Trials(10);
  for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
    Random random(seed);
    Scene scene;
    scene.AddEllipse({{400.0, 250.0}, 100.0, 60.0, 0.4}, 100, &random);
    scene.AddBlob({150.0, 150.0}, 12.0, 300, &random);
    scene.Calibrate();
    std::vector<FoundConic> conics;
    ASSERT_TRUE(FindConics(scene.points, HalfPixelOptions(), &conics).ok());
    EXPECT_EQ(conics.size(), 1u) << seed;
    EXPECT_EQ(scene.NumFound(conics), 1) << seed;
  }
}

TEST(FindConics, KeepsToItsStoppingRule) {
  const Scene scene = MakeScene(3, 100);
  FindConicsOptions options = HalfPixelOptions();
  std::vector<FoundConic> conics;
  options.max_conics = 2;
  ASSERT_TRUE(FindConics(scene.points, options, &conics).ok());
  EXPECT_EQ(conics.size(), 2u);
  options.max_conics = 0;
  ASSERT_TRUE(FindConics(scene.points, options, &conics).ok());
  EXPECT_TRUE(conics.empty());
  options.max_conics = 10;
  options.min_points = 72;
  ASSERT_TRUE(FindConics(scene.points, options, &conics).ok());
  EXPECT_EQ(conics.size(), 3u);
}

TEST(FindConics, SameSeedSameBits) {
  const Scene scene = MakeScene(5);
  std::vector<FoundConic> a, b;
  ASSERT_TRUE(FindConics(scene.points, HalfPixelOptions(), &a).ok());
  ASSERT_TRUE(FindConics(scene.points, HalfPixelOptions(), &b).ok());
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].fit.conic, b[k].fit.conic);
    EXPECT_EQ(a[k].points, b[k].points);
  }
}

TEST(FindConics, FewPointsHoldNone) {
  std::vector<FoundConic> conics(2);
  ASSERT_TRUE(FindConics({}, FindConicsOptions(), &conics).ok());
  EXPECT_TRUE(conics.empty());
  ASSERT_TRUE(FindConics(std::vector<CalibratedPoint>(50), FindConicsOptions(), &conics).ok());
  EXPECT_TRUE(conics.empty());
}

TEST(FindConics, NamesBadOptions) {
  struct Case {
    const char* field;
    void (*spoil)(FindConicsOptions*);
  };
  const Case cases[] = {
      {"max_conics", [](FindConicsOptions* o) { o->max_conics = -1; }},
      {"min_points", [](FindConicsOptions* o) { o->min_points = 5; }},
      {"max_false_alarms", [](FindConicsOptions* o) { o->max_false_alarms = 0.0; }},
      {"sigma_px", [](FindConicsOptions* o) { o->fit.sigma_px = 0.0; }},
      {"min_arc_deg", [](FindConicsOptions* o) { o->limits.min_arc_deg = -1.0; }},
  };
  for (const Case& c : cases) {
    FindConicsOptions options;
    c.spoil(&options);
    std::vector<FoundConic> conics;
    const Status status = FindConics({}, options, &conics);
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
    EXPECT_NE(status.message.find(c.field), std::string::npos) << status.message;
  }
}

}  // namespace
}  // namespace circline
