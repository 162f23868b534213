// The front end of main.cc: circles and directions as landmarks, and the features of a frame that
// belong to them, as cost functions for Ceres.
#ifndef CIRCLINE_DOCS_EXAMPLES_VISUAL_ODOMETRY_LANDMARKS_H_
#define CIRCLINE_DOCS_EXAMPLES_VISUAL_ODOMETRY_LANDMARKS_H_

#include <Eigen/Geometry>
#include <array>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/refine/cost_functions.h"

// Every vector and radius is a parameter block, as cost_functions.h names them. World frame.
struct Circle {
  Eigen::Vector3d center, normal;
  double radius;
};
struct Map {
  std::vector<Circle> circles;  // The first is the disc.
  std::vector<Eigen::Vector3d> directions;
};
struct Feature {
  std::unique_ptr<circline::FeatureCost> cost;
  std::vector<double*> blocks;
};
struct Frame {
  std::string name;
  Eigen::Quaterniond rotation;  // cam_from_world
  Eigen::Vector3d translation;
  std::deque<std::array<double, 2>> lines;  // Of each line: where it lies, its own deviation.
  std::vector<Feature> features;

  double* q() { return rotation.coeffs().data(); }
  double* t() { return translation.data(); }
};

// The pose of a frame to start from, and a map of what it sees, in the world of its estimate. False
// where that does not suffice: fewer than five circles, a doubtful pose, no scale.
bool StartMap(const circline::Observations& seen, Frame* frame, Map* map);

// Adds to the frame, whose pose is that of the frame before, the circles and lines that belong to
// landmarks.
void MatchFeatures(const circline::Observations& seen, Map* map, Frame* frame);

#endif  // CIRCLINE_DOCS_EXAMPLES_VISUAL_ODOMETRY_LANDMARKS_H_
