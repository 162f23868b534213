// Random scenes of one plane with their truth: circles, rings and pencils seen by cameras of every
// kind, from every side. The plane is Z = 0; positions are on it, in the world's unit.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_WORLD_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_WORLD_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline::apps {

enum class Lens { kPinhole, kMild, kStrong, kFisheye };  // kMild and kStrong: CameraModel::kOpenCV.
inline constexpr int kNumLenses = 4;

struct WorldCircle {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius = 1.0;
  double arc_start = 0.0, arc = 2.0 * kPi;  // What is seen of it, radians.
  int num_points = 100;                     // Evenly spread over the arc.
  int ring = -1;                            // Circles of one ring share their centre; -1: none.
  // Its own plane against the world's: a turn about an axis through its centre, radians.
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  // What is stated of the radius: nothing if 0, else the truth times this.
  double stated_radius = 0.0;
  bool has_center = false;  // Whether the image of its centre is seen, with the noise of a point.
};

struct WorldLine {
  double offset = 0.0;           // Across its pencil's direction.
  double from = -1.0, to = 1.0;  // Along it.
  int num_points = 2;
  double turn = 0.0;  // Of an odd line, about its middle, in the plane, radians; else 0.
};

struct WorldPencil {
  PencilDirection direction = PencilDirection::kX;  // kX, kY or kFree.
  double angle = 0.0;                               // From the X axis; that of kX is 0.
  std::vector<WorldLine> lines;
};

// Whether any is along X or Y; else the first is taken for the X axis.
bool HasRole(const std::vector<WorldPencil>& pencils);

struct World {
  Camera camera;
  CameraPose pose;
  std::vector<WorldCircle> circles;
  std::vector<WorldPencil> pencils;
  bool equal_radii = false;  // Stated as one radius group.

  // Whether no pencil fixes the rotation about the normal.
  bool RotationIsFree() const { return pencils.empty(); }
};

// What to draw. The defaults are the scenes "of every kind".
struct Recipe {
  int num_lenses = kNumLenses;  // The first so many of Lens.
  int min_circles = 1, max_circles = 8;
  int min_pencils = 0, max_pencils = 3;
  int min_lines = 2, max_lines = 12;
  bool pencils_only_too = true;  // A tenth of the scenes has no circle, where two pencils are.
  bool free_pencils = true;      // Else along x, then y.
  double ring_share = 0.3;       // Of the scenes, with two circles or more.
  double partial_share = 0.35;   // Of the circles, seen in part.
  double min_arc_deg = 45.0;     // Of those.
  double min_tilt_deg = 0.0, max_tilt_deg = 82.0;  // Between normal and ray to the middle.
  int min_points = 12, max_points = 400;           // Of a circle.
  int max_line_points = 100;                       // 2: by end points alone.
};

World DrawWorld(const Recipe& recipe, Random* random);

// One point of a curve's true image.
struct Sample {
  Eigen::Vector2d pixel;     // Of the photo.
  Eigen::Vector2d normal;    // Unit, across the curve's image; of a circle outwards.
  Eigen::Vector3d point;     // In the camera frame.
  Eigen::Vector2d on_plane;  // Of the curve before tilt or turn.
  // Of the distance across the curve: by the point in the camera frame.
  Eigen::RowVector3d by_point;
};

// False where the camera cannot see some point, or sees it beyond the photo's border.
bool SampleCircle(const World& world, const WorldCircle& circle, std::vector<Sample>* samples);
bool SampleLine(const World& world, const WorldPencil& pencil, const WorldLine& line,
                std::vector<Sample>* samples);
// The centre's image, by each coordinate of it: `normal` is an axis of the photo.
bool SampleCenter(const World& world, const WorldCircle& circle, std::array<Sample, 2>* samples);
bool IsVisible(const World& world);

// Directions of a line and across it, on the plane.
Eigen::Vector2d Along(double angle);
Eigen::Vector2d Across(double angle);

// The image's shorter semi-axis, pixels, were the whole circle seen; 0 where the camera cannot.
double SemiMinorPx(const World& world, const WorldCircle& circle);
double SmallestSemiMinorPx(const World& world);
double SmallestArc(const World& world);  // Radians; 2 pi without circles.
// Angle between the plane's normal and the ray to the middle of the scene, radians.
double Tilt(const World& world);

// By how many standard deviations an odd line's points are off the best line of its pencil's
// direction, for a noise of 1 px.
double OddLineDeviation(const World& world, const WorldPencil& pencil, const WorldLine& line);

// What is added to the true image.
struct Disturbance {
  double noise_px = 0.5;       // Standard deviation of each coordinate of each point.
  bool stated = true;          // Whether the observations say so.
  double bleed_px = 0.0;       // By which all contours lie outside their circles.
  double outlier_ratio = 0.0;  // Share of each feature's points that lies anywhere near it.
};

// Circles are named c0, c1, ...; pencils L0, L1, ...
Observations Observe(const World& world, const Disturbance& disturbance, Random* random);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_WORLD_H_
