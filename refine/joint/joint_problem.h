// Everything that is known of the world plane as one ceres::Problem: circles, lines, centres, axes,
// known angles and lengths, priors. Made once for a photo; solved for each reading (which features
// take part) from each start. Internal: not installed.
//
// Unknowns. The pose (R, t), t being the image of the world origin: free where the world is metric
// and the origin is observed or, by convention, a circle's centre; a unit vector where the world
// has no scale; held where its direction is a convention. Each circle's centre, radius, tilt and
// height, each pencil's direction, each line's place and deviation, the contours' common offset,
// the camera. What has no prior width is held.
#ifndef CIRCLINE_REFINE_JOINT_JOINT_PROBLEM_H_
#define CIRCLINE_REFINE_JOINT_JOINT_PROBLEM_H_

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/graph.h"

namespace circline {

// What can be left out as a whole.
struct Feature {
  enum class Kind {
    kCircle,
    kCenterMark,
    kLine,
    kPlaneLine,
    kPoint,
    kLength,
    kAngle,
    kAxis,
    kPrior
  };
  Kind kind;
  std::string id;                   // PoseHypothesis::left_out: "c1", "kerbs[3]", "length[0]".
  std::string name;                 // For people: "circle 'c1'".
  int parent = -1;                  // A feature without which this one says nothing.
  int dof = 1;                      // Parameters of its free fit less unknowns of its own.
  int observation = -1, line = -1;  // Index of circle, pencil or length; line within its pencil.
  // Twice the cost of its own free fit, under the loss.
  double free_twice_cost = 0.0;
  // Of the fit of a line, of an angle (a multiple of I), or of the turn [delta] that a prior knows.
  std::optional<Eigen::Matrix3d> covariance = std::nullopt;
};

// Which features take part, by feature: 1 or 0.
using Reading = std::vector<std::uint8_t>;

// Where a refinement stands.
struct State {
  std::vector<double> x;  // All parameter blocks.
  Reading active;
  double cost = 0.0;  // Of the active terms, priors included.

  bool Has(int feature) const { return active[static_cast<std::size_t>(feature)] != 0; }
};
inline bool HasLessCost(const State& a, const State& b) { return a.cost < b.cost; }

class JointProblem : public Graph {
 public:
  // `observations` fitted and resolved (ResolveWorld), each feature with its noise (StateNoise);
  // they and the options outlive this. Features without a fit, of other planes, or without any tie
  // to the world frame take no part.
  JointProblem(const Observations& observations, const EstimationOptions& options);

  // All unknowns at a seed: its rotation and plane, circles by their points in that plane, the rest
  // by its own fits. Features that cannot lie in that plane in front of the camera are made
  // inactive. Refused where no circle can that the reading keeps, or the origin lies beyond the
  // horizon.
  Status Start(const CameraPose& seed, double log_focal, const Reading& reading,
               State* state) const;
  // Makes an inactive line, circle, centre, angle or prior active, at the state's pose. False for
  // other features, and where it cannot lie there.
  bool Admit(std::size_t feature, State* state) const;
  // Runs ceres on it, under losses of these `widths`, one after the other, before their own. Not ok
  // where the evidence cannot be evaluated, or at the pace of a step that would not lead to a cost
  // of `most_cost`.
  Status Solve(int max_iterations, State* state,
               double most_cost = std::numeric_limits<double>::infinity(),
               const std::vector<double>& widths = {}) const;
  // The same from a start that may be far off, where much lies in the tails of the losses: under
  // wide ones first, which narrow to their own width.
  Status SolveGraduated(int max_iterations, State* state) const;

  // Of the active features' own free fits: no pose costs less.
  double FreeCost(const State& state) const;
  // Infinity where it cannot be evaluated.
  double Cost(const State& state) const;
  CameraPose PoseAt(const State& state) const;
  double LogFocalAt(const State& state) const { return *At(kCamera, state); }

  const Observations& observations() const { return observations_; }
  const EstimationOptions& options() const { return options_; }
  const std::vector<Feature>& features() const { return features_; }
  const Feature& feature(int i) const { return features_[static_cast<std::size_t>(i)]; }
  // The line of a feature of that kind that is one of a pencil's.
  const LineObservation& LineOf(const Feature& feature) const {
    return observations_.pencils[static_cast<std::size_t>(feature.observation)]
        .lines[static_cast<std::size_t>(feature.line)];
  }
  // A block's values.
  const double* At(int i, const State& state) const { return state.x.data() + block(i).offset; }
  double* At(int i, State* state) const { return state->x.data() + block(i).offset; }
  // Features that a fit has not found to contradict their like.
  Reading FirstReading() const;
  // What the observations say that has no part in the problem, and why, a sentence each.
  const std::vector<std::string>& unused() const { return unused_; }

  // Undistorts the points as the camera of this state has them, where it is estimated: for all that
  // is asked of that camera until the next call.
  void SeeThrough(const State& state) const;
  // Whether it is kept and all that it is a part of: the centre of a circle that is left out says
  // nothing, whatever the reading has of the centre.
  bool TakesPart(std::size_t feature, const Reading& reading) const;
  // Whether the same features take part.
  bool IsSameReading(const Reading& a, const Reading& b) const;
  bool IsActive(const Term& term, const State& state) const;
  std::vector<const Term*> ActiveTerms(const State& state) const;
  bool IsMetric(const State& state) const;
  // Whether anything that takes part says where the origin is.
  bool OriginIsPlaced(const State& state) const;
  bool origin_observed() const { return origin_observed_; }
  // Whether nothing that takes part says how the world is turned about its normal.
  bool SpinIsFree(const State& state) const;
  // Whether nothing takes part but lines of one pencil: the plane may be any about their direction.
  bool IsOnePencil(const State& state) const;
  bool camera_is_estimated() const { return camera_is_estimated_; }
  const CameraSigma& camera_sigma() const { return camera_sigma_; }

  // Blocks and terms by what they are; -1 where there is none.
  struct CircleBlocks {
    int observation, feature, term, center, radius, tilt;
  };
  const CircleObservation& ObservationOf(const CircleBlocks& circle) const {
    return observations_.circles[static_cast<std::size_t>(circle.observation)];
  }
  struct LineBlocks {
    int term, line, feature;
  };
  struct PlaneLineBlocks {
    int angle;
    Eigen::Vector3d fit;
  };
  struct LengthBlocks {
    int a, b, feature;
  };
  const std::vector<CircleBlocks>& circles() const { return circles_; }
  const std::vector<int>& directions() const { return directions_; }
  const std::vector<LineBlocks>& lines() const { return lines_; }
  enum { kRotation = 0, kTranslation = 1, kCamera = 2 };  // Blocks that are always there.

 private:
  friend class JointProblemBuilder;

  Eigen::Matrix3d SenseOfPriors(const CameraPose& seed, const State& state) const;
  // What Start has found of the circles.
  struct Placed {
    int num_circles = 0;
    std::vector<double> scales;  // Known radii over those in the seed's unit.
    std::optional<Eigen::Vector2d> origin;
  };
  bool PlaceCircle(const CircleBlocks& circle, State* state, Eigen::Vector3d* in_plane) const;
  Placed PlaceCircles(State* state) const;
  bool LinesSuffice(const Reading& reading) const;
  bool OriginRay(const State& state, Eigen::Vector3d* ray) const;
  bool PlaceOrigin(const Placed& placed, State* state) const;
  void PlaceScale(Placed placed, State* state) const;
  bool PlaceLine(const LineBlocks& line, State* state) const;
  void PlaceLines(State* state) const;
  bool Ray(const State& state, const Eigen::Vector2d& pixel, Eigen::Vector3d* ray) const;

  const Observations& observations_;
  const EstimationOptions& options_;
  std::vector<Feature> features_;
  std::vector<CircleBlocks> circles_;
  std::vector<int> directions_;  // By pencil; -1: it takes no part.
  std::vector<LineBlocks> lines_;
  std::vector<PlaneLineBlocks> plane_lines_;
  std::vector<LengthBlocks> lengths_;
  std::vector<std::string> unused_;
  struct PriorTerm {
    int term;
    bool tells_spin;
  };
  std::vector<PriorTerm> pose_priors_;
  int center_at_origin_ = -1;  // Circle (index in circles_) whose centre the origin is, or -1.
  CameraSigma camera_sigma_;
  bool origin_observed_ = false, x_is_fixed_ = false, camera_is_estimated_ = false;
  bool x_is_seen_ = false;  // Fixed by lines, up to its sense, not by a prior alone.
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_JOINT_PROBLEM_H_
