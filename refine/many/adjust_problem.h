// Many photos as one ceres::Problem of public cost functions: cameras, poses, worlds. Internal: not
// installed.
#ifndef CIRCLINE_REFINE_MANY_ADJUST_PROBLEM_H_
#define CIRCLINE_REFINE_MANY_ADJUST_PROBLEM_H_

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/refine/adjust_photos.h"
#include "circline/refine/graph.h"
#include "circline/refine/many/adjust_layout.h"
#include "circline/refine/many/square_grid.h"
#include "circline/refine/many/square_lattice.h"

namespace circline {

class Linearization;

// A photo as the problem takes it. All outlive the problem.
struct AdjustInput {
  const Observations* observations = nullptr;  // As of Prepare, through the camera at start.
  std::size_t camera = 0;
  std::size_t world = 0;  // Photos of one world share circles and pencils of one id.
  CameraPose pose;        // To start from, of that world.
  // What the world calls its circles, by own id; empty: the same. What it calls its pencils; where
  // it does not say and circles have other names, or poses are given, each photo has its own.
  std::map<std::string, std::string> names, pencil_names;
  std::set<std::string> left_out;  // Ids of features that have no part in it.
  bool takes_part = true;
  const CameraPose* given = nullptr;  // In the given frame; null: none.
  const SquareGrid* grid = nullptr;   // Of its lines, which then is its world; null: none.

  const std::string& NameOf(const std::string& id) const {
    const auto name = names.find(id);
    return name != names.end() ? name->second : id;
  }
};

// Of a camera's shifts (camera_shifts.h) against the one that its points were made with.
struct CameraPrior {
  Shifts mean{}, sigma{};  // 0 = held.
  CameraModel model = CameraModel::kOpenCV;
};

// p1, p2 of these shifts.
inline bool IsTangential(CameraModel model, int shift) {
  return model == CameraModel::kOpenCV && (shift == 6 || shift == 7);
}

// A pose against one of another frame and unit, X_other = s R X + t: rotation, translation, those
// of R (4) and t (3), log s (1). `rotation`, `translation`: the camera's in the other frame; the
// deviation of the translation in the unit of the world.
ceres::CostFunction* NewGivenPosePrior(const Eigen::Matrix3d& rotation,
                                       const Eigen::Vector3d& translation, double rotation_sigma,
                                       double translation_sigma);

// How each photo's own pose is estimated.
EstimationOptions PoseOptions(const AdjustOptions& options);

class AdjustProblem : private Graph {
 public:
  // `layouts`: of the circles, by world. `lattices`: on which they lie, by world, as far as worlds
  // have been looked at. `priors`: by camera. `given`: where the world lies in the
  // frame of given poses; null: there are none.
  AdjustProblem(const std::vector<AdjustInput>& photos, const std::vector<Layout>& layouts,
                const std::vector<SquareLattice>& lattices, std::vector<CameraPrior> priors,
                const AdjustOptions& options, const GivenFrame* given);

  // Runs ceres with the losses `stretch` times as wide.
  Status Solve(double stretch, int max_iterations);
  // Root mean square over the points of the worst feature, standard deviations.
  double LargestRms() const { return Graph::LargestRms(ActiveTerms(), values().data()); }

  struct Feature {
    std::size_t photo = 0;
    std::string id;  // As PoseHypothesis::left_out.
    int term = -1;
    bool active = true;
    int grid_term = -1;  // Of a line on a grid: its place there.
    // At the last Judge(): chi^2 of what its points agree on (a conic, a line) against the rest,
    // priors of its own imperfections included, and how many residuals that is.
    double chi2 = 0.0;
    int rows = 0;
  };
  void Judge();
  const std::vector<Feature>& features() const { return features_; }
  // Of all features that take part, per degree of freedom.
  double Misfit() const;
  // A line of a board, all its pieces: how far it is off, in standard deviations.
  struct GridLine {
    std::size_t photo;
    int axis, place;
    double deviations;
  };
  std::vector<GridLine> GridLines() const;
  // A circle of a lattice: how far either coordinate is off, in standard deviations.
  struct LatticeCircle {
    std::size_t world;
    std::pair<int, int> place;
    Eigen::Vector2d deviations;
  };
  std::vector<LatticeCircle> LatticeCircles() const;

  // All else marginalised; from the inliers of the features in force, of photos before `end`.
  struct Covariances {
    // Of the shifts; zero rows where one is held; the prior's where the problem is singular.
    std::vector<Eigen::Matrix<double, kCameraSize, kCameraSize>> cameras;
    std::vector<Matrix6d> poses;  // Of [delta, delta_t], as PoseHypothesis has them.
    double log_scale = 0.0;       // Variance, of GivenFrame::scale.
  };
  // `at_minimum`: counts how far losses may have moved the estimate (Linearization::Options).
  Covariances Covariance(std::size_t end, bool at_minimum = true) const;

  // By a photo that takes part; else there is nothing to ask of it.
  bool IsUsed(std::size_t camera) const { return FirstOf(camera) != photos_.end(); }
  Camera CameraAt(std::size_t camera) const;
  CameraPose PoseAt(std::size_t photo) const;
  std::vector<std::vector<AdjustedResidual>> Residuals() const;  // Of the inliers; by photo.
  std::vector<AdjustedCircle> Circles() const;
  std::vector<AdjustedDirection> Directions() const;
  GivenFrame GivenFrameAt() const;
  bool metric() const { return metric_; }

 private:
  struct Circle {
    int center = -1, radius = -1, tilt = -1, shape = -1;  // Blocks.
    // The least that its pixels in any photo leave open of its centre, about: a standard deviation.
    double told = std::numeric_limits<double>::infinity();
  };

  struct Direction {
    int photo = -1;  // As AdjustedDirection::photo.
    int block = -1;
  };

  void AddCameras();
  void AddCameraPrior(const CameraPrior& prior);
  void AddPhoto(std::size_t photo);
  void SetGauge();
  void AddGivenPoses(const GivenFrame& given);
  void AddCircle(std::size_t photo, const CircleObservation& circle);
  Circle* CircleOf(std::size_t photo, const CircleObservation& circle);
  void StateRadius(std::size_t world, const CircleObservation& circle, int radius);
  void AddKnownRadii();
  int OffsetOf(std::size_t photo, const CircleObservation& circle);
  void AddPencil(std::size_t photo, std::size_t pencil);
  // Squares, of a photo that has a grid: this share of how far its lines are off their places, or,
  // where they are exact, a tenth of what their pixels leave.
  double GridSigma(const AdjustInput& photo, double share) const;
  int AddGridPlace(std::size_t photo, std::size_t pencil, std::size_t line, const CurveCost& cost,
                   std::vector<int> blocks);
  void AddLattice(std::size_t world, const SquareLattice& lattice);
  int DirectionOf(std::size_t photo, const PencilObservation& pencil);
  void AddFeature(std::size_t photo, const std::string& id, std::unique_ptr<FeatureCost> cost,
                  std::vector<int> blocks);
  int AddRotation(const Eigen::Matrix3d& rotation);
  // Of the features in force of photos before `end`, and of the priors of what these have.
  std::vector<const Term*> ActiveTerms(std::size_t end) const;
  std::vector<const Term*> ActiveTerms() const { return ActiveTerms(photos_.size()); }
  // The first photo of a camera that takes part, or the end of all.
  std::vector<AdjustInput>::const_iterator FirstOf(std::size_t camera) const;
  Matrix6d PoseCovariance(std::size_t photo, const Linearization& at) const;

  const std::vector<AdjustInput>& photos_;
  const std::vector<Layout>& layouts_;
  const std::vector<CameraPrior> priors_;  // By camera.
  const AdjustOptions& options_;
  const EstimationOptions pose_options_;
  int num_distortion_ = 0;
  std::vector<int> cameras_, rotations_, translations_;  // Blocks, -1: the photo takes no part.
  // Where poses are given, GivenFrame: rotation, translation, log scale.
  std::vector<int> given_;
  std::map<std::pair<std::size_t, std::string>, Circle> circles_;
  std::map<std::pair<std::size_t, std::string>, Direction> directions_;
  std::map<std::pair<std::size_t, std::string>, int> radius_groups_, centers_;
  std::map<std::pair<std::size_t, int>, int> offsets_;
  // By photo, axis and place: how far off it is.
  std::map<std::tuple<std::size_t, int, int>, int> grid_lines_;
  struct LatticePlace {
    std::size_t world;
    std::pair<int, int> place;
    int term;
  };
  std::vector<LatticePlace> lattice_places_;
  std::vector<int> lattice_frames_;                     // Blocks: origins and sides.
  std::map<std::size_t, bool> x_is_fixed_, has_scale_;  // By world.
  struct KnownRadius {
    double radius, sigma;  // sigma: relative.
    bool is_stated;        // By the photo, not by the noise model.
  };
  std::map<int, KnownRadius> known_radii_;  // By block.
  std::vector<Feature> features_;
  bool metric_ = false;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_MANY_ADJUST_PROBLEM_H_
