// What a tracker carries from frame to frame: unknowns, one Gaussian of them a hypothesis, and how
// motion changes them. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_TRACK_STATE_H_
#define CIRCLINE_REFINE_TRACK_TRACK_STATE_H_

#include <ceres/manifold.h>

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/refine/graph.h"
#include "circline/refine/pose_tracker.h"
#include "circline/refine/track/scratch.h"

namespace circline {

// Directions of axes that are drawn.
constexpr char kXAxisId[] = "frame.x_axis", kYAxisId[] = "frame.y_axis";

// The unknowns that hypotheses have in common: which there are, not their values.
class TrackMap : private Graph {
 public:
  using Graph::block;
  using Graph::blocks;
  enum { kRotation, kTranslation, kTurnRate, kVelocity, kCamera };  // Landmarks come behind.
  struct Circle {
    std::string id;
    int center = -1, radius = -1;  // Blocks: X and Y in the world plane; in the world's unit.
    int tilt = -1;                 // X and Y of its normal, radians, and height in radii.
    int offset = -1;               // Of all contours of its contrast, pixels outwards.
    int contrast = 0;
  };
  struct Direction {
    std::string id;  // Of its pencil; "frame.x_axis", "frame.y_axis".
    int block = -1;
    PencilDirection role = PencilDirection::kFree;
  };

  // `is_told`: a frame tells the focal length.
  void Reset(bool has_position, const Camera& camera, const CameraSigma& sigma, bool is_told);
  // Returns the block. A null manifold is Euclidean.
  int AddBlock(int size, std::unique_ptr<ceres::Manifold> manifold = {}, bool is_constant = false);

  // First row of a block in the covariance.
  int tangent(int i) const { return tangents_[static_cast<std::size_t>(i)]; }
  int size() const { return static_cast<int>(tangents_.size()); }
  int tangent_size() const { return tangent_size_; }
  bool has_camera() const { return !block(kCamera).is_constant; }
  bool has_position() const { return !block(kTranslation).is_constant; }

  std::vector<Circle> circles;
  std::vector<Direction> directions;
  std::string plane;  // Of the world, as observations name it; empty where they do not.
  bool metric = false, origin_observed = false;
  // Its error is not estimated but counted: it stays the same from frame to frame, and no number of
  // them averages it out.
  bool camera_is_considered = true;
  // It is an unknown of every refinement (CameraSigma::IsEstimated). One whose focal length no
  // frame tells is considered all the same: what many frames tell of it, each a little, lies along
  // a curved ridge of focal lengths and poses, which no Gaussian follows.
  bool camera_is_unknown = false;

 private:
  std::vector<int> tangents_;
  int tangent_size_ = 0;
};

// One hypothesis: values of all blocks, and the covariance of their tangents at these.
struct TrackState {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  double log_weight = 0.0;

  Eigen::Map<const Eigen::Vector3d> Vector(const TrackMap& map, int block) const {
    return Eigen::Map<const Eigen::Vector3d>(x.data() + map.block(block).offset);
  }
  CameraPose Pose(const TrackMap& map) const;
  void SetPose(const TrackMap& map, const CameraPose& pose);
  // Of rotation and, where there is one, position.
  BlockMatrix PoseCovariance(const TrackMap& map) const {
    const int size = map.tangent(TrackMap::kTurnRate);
    return covariance.topLeftCorner(size, size);
  }
  void Move(const TrackMap& map, const Scratch::Vector& step);  // By a tangent of all blocks.
  bool IsInRange() const;  // Squares of all numbers, and their sums, are finite.
  // Takes in a block that has been added to the map, its numbers independent or not.
  void Append(const TrackMap& map, int block, const Eigen::VectorXd& values,
              const Eigen::VectorXd& sigmas);
  void Append(const TrackMap& map, int block, const double* values,
              const Eigen::MatrixXd& block_covariance);
};

// Squared distance of a pose from another under a covariance of tangents there (PoseCovariance);
// infinite where that is not positive definite.
double SquaredDistance(const CameraPose& from, const CameraPose& to, BlockMatrix covariance);

// Moves a hypothesis on by dt seconds at its own velocity, with the noise of the options.
void MoveOn(const TrackMap& map, const TrackerOptions& options, double dt, TrackState* state);
// The same by a motion that is known from elsewhere; velocities are then those of this motion.
void MoveBy(const TrackMap& map, const TrackerOptions& options, const RelativePose& motion,
            double dt, TrackState* state);
// Conditions a hypothesis on what is known of its pose (Kalman's update), its probability included.
void Condition(const TrackMap& map, const PosePrior& prior, Scratch* scratch, TrackState* state);
void Condition(const TrackMap& map, const GravityPrior& prior, Scratch* scratch, TrackState* state);

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_TRACK_STATE_H_
