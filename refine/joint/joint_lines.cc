// Lines, pencils and drawn axes, as blocks and terms.
#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/pencil_lean.h"
#include "circline/refine/evidence_points.h"
#include "circline/refine/joint/joint_builder.h"
#include "circline/refine/manifolds.h"
#include "circline/refine/mostly_exact.h"

namespace circline {
namespace {

// By how much the lines of a pencil miss its direction, beyond their own noise, radians: root mean
// square, each as it tells of that, together with one line that misses it by what the noise model
// says.
double LineDeviation(const PencilObservation& pencil, double usual) {
  constexpr double kUnknowns = 2.0;  // Of a direction.
  double squares = usual * usual, count = 1.0 - kUnknowns;
  for (const LineObservation& line : pencil.lines) {
    if (!line.fit || !line.is_parallel || !pencil.fit) continue;
    const Eigen::Vector3d& v = pencil.fit->direction;
    const double miss = line.fit->line.normalized().dot(v);
    const double noise = std::max(
        0.0, v.dot(line.fit->covariance * v) / line.fit->line.squaredNorm() - usual * usual);
    const double tells = std::pow(usual * usual / (usual * usual + noise), 2.0);
    squares += tells * (miss * miss - noise);
    count += tells;
  }
  return std::sqrt(std::max(0.0, squares) / std::max(1.0, count));
}

// Standard deviation of a pencil's direction against its axis: a corner is as square as its sides
// are straight and parallel. Those of a board are so to a fraction of a degree; those of an old
// street, of which each misses its direction by a third of a degree, to one or two. A photo tells
// the focal length or whether a corner is square, not both: where that is an unknown, more so.
double AxisSigma(const PencilObservation& pencil, const NoiseModel& model,
                 const CameraSigma& camera) {
  // In units of the lines' deviation. Of 1 to 4, on the streets of scene-lund (and -more), whose
  // directions are 88.4 degrees apart, and drawn ones (seed 1); and of 2 to 8, on scene-lund and
  // chessboard-opencv. Boxes, other boards and other seeds had no part in it.
  constexpr double kOfKnownCamera = 1.5, kOfGuessedCamera = 4.0;
  const bool is_free = pencil.direction == PencilDirection::kFree;
  if (is_free || !(model.pencil_axis_rad > 0.0)) return model.pencil_axis_rad;
  const double of_deviation = camera.IsWide() ? kOfGuessedCamera : kOfKnownCamera;
  return std::max(model.pencil_axis_rad,
                  of_deviation * LineDeviation(pencil, model.line_direction_rad));
}

// What a direction may miss its axis by, as the covariance is to count it, in units of `sigma`, the
// axis' own: walls lean apart by what the noise model says (LeanShape), and whatever more the
// corner is off square by is of all of them.
Eigen::Matrix3d LeanAgainst(double sigma, const PencilObservation& pencil, const NoiseModel& model,
                            const CameraSigma& camera) {
  const double walls = std::pow(model.pencil_axis_rad / sigma, 2.0);
  const double alike = (camera.IsWide() ? kLeaning * kLeaning : 1.0) * (1.0 - walls);
  Eigen::Matrix3d one_wall = Eigen::Matrix3d::Identity();
  if (pencil.fit) one_wall -= pencil.fit->direction * pencil.fit->direction.transpose();
  return walls * LeanShape(pencil) + alike * one_wall;
}

}  // namespace

// The drawn axis that a pencil's line carries, where the origin is observed: 0 = x, 1 = y, -1 =
// none.
int JointProblemBuilder::AxisOfLine(std::size_t pencil, std::size_t line) const {
  if (!p_.origin_observed_) return -1;
  const auto carries = [&](const std::optional<Segment>& axis) {
    int p, l;
    return axis && FindAxisLine(obs_, *axis, &p, &l) && p == static_cast<int>(pencil) &&
           l == static_cast<int>(line);
  };
  return carries(obs_.frame.x_axis) ? 0 : carries(obs_.frame.y_axis) ? 1 : -1;
}

// A pencil's direction: tied to its axis or to the plane, as closely as the noise model says.
int JointProblemBuilder::DirectionBlock(std::size_t index) {
  const PencilObservation& pencil = obs_.pencils[index];
  const double sigma = AxisSigma(pencil, model_, p_.camera_sigma_);
  const bool is_free = pencil.direction == PencilDirection::kFree;
  const Eigen::Vector3d axis = is_free ? Eigen::Vector3d::UnitX()
                                       : Eigen::Vector3d::Unit(static_cast<int>(pencil.direction));
  const std::vector<double> value(axis.data(), axis.data() + 3);
  if (!(sigma > 0.0)) {
    return is_free ? p_.AddBlock(3, value, std::make_unique<InPlaneManifold>())
                   : AddConstant(value);
  }
  const int block = p_.AddBlock(3, value, std::make_unique<ceres::SphereManifold<3>>());
  Feature tie{Feature::Kind::kAxis, pencil.id, "the direction of pencil '" + pencil.id + "'"};
  tie.dof = is_free ? 1 : 2;
  const int feature = AddFeature(tie);
  const int term = p_.AddTerm(
      is_free ? NewInPlanePrior(Eigen::Vector3d::UnitZ(), sigma) : NewDirectionPrior(axis, sigma),
      {block}, feature,
      std::make_unique<MostlyExact>(p_.camera_sigma_.IsWide() ? MostlyExact::kNarrowerOfGuess
                                                              : MostlyExact::kNarrower));
  if (!is_free) p_.term(term).lean_shape = LeanAgainst(sigma, pencil, model_, p_.camera_sigma_);
  return block;
}

void JointProblemBuilder::AddPencil(std::size_t index) {
  const PencilObservation& pencil = obs_.pencils[index];
  const bool is_free = pencil.direction == PencilDirection::kFree;
  // Outside the plane, or a single line: it fixes its own direction, no more.
  if (is_free && (pencil.plane != obs_.frame.plane || !pencil.fit)) return;
  p_.x_is_fixed_ = p_.x_is_fixed_ || pencil.direction == PencilDirection::kX ||
                   pencil.direction == PencilDirection::kY;
  int& direction = p_.directions_[index];
  for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
    const LineObservation& line = pencil.lines[j];
    if (!line.fit) continue;
    Feature feature{Feature::Kind::kLine, pencil.id + "[" + std::to_string(j) + "]",
                    "pencil '" + pencil.id + "', line " + std::to_string(j)};
    feature.observation = static_cast<int>(index);
    feature.line = static_cast<int>(j);
    const double sigma = LineSigma(pencil, line);
    ImagePoints points;
    if (!Points(line.points, line.inliers, sigma, false, &points)) continue;
    const int axis = AxisOfLine(index, j);
    if (axis >= 0) {
      AddAxisLine(std::move(points), *line.fit, axis, feature.id, feature.name);
      continue;
    }
    feature.covariance = line.fit->covariance;
    if (direction < 0) direction = DirectionBlock(index);
    AddLine(std::move(points), line.fit->line, direction, model_.line_direction_rad, feature);
  }
}

void JointProblemBuilder::AddLine(ImagePoints points, const Eigen::Vector3d& fit, int direction,
                                  double direction_sigma, Feature feature) {
  feature.free_twice_cost = FreeTwiceCost(points, fit);
  const DirectionLineCost::Options options{direction_sigma, camera_ >= 0};
  const int f = AddFeature(std::move(feature)),
            own = p_.AddBlock(direction_sigma > 0.0 ? 2 : 1, {});
  const int term = p_.AddTerm(new DirectionLineCost(std::move(points), fit, options),
                              {JointProblem::kRotation, direction, own, camera_}, f);
  p_.lines_.push_back({term, own, f});
}

void JointProblemBuilder::AddPlaneLine(ImagePoints points, int point, int angle, int feature) {
  p_.AddTerm(new PlaneLineCost(std::move(points), camera_ >= 0),
             {JointProblem::kRotation, JointProblem::kTranslation, point, angle, camera_}, feature);
}

// A line through the observed origin, along X or Y.
void JointProblemBuilder::AddAxisLine(ImagePoints points, const LineFit& fit, int axis,
                                      const std::string& id, const std::string& name) {
  p_.x_is_fixed_ = true;
  Feature feature{Feature::Kind::kPlaneLine, id, name};
  feature.dof = 2;
  feature.free_twice_cost = FreeTwiceCost(points, fit.line);
  feature.covariance = fit.covariance;
  const int f = AddFeature(feature), angle = AddConstant({axis * kRightAngle});
  AddPlaneLine(std::move(points), origin_point_, angle, f);
}

// An axis drawn apart from the pencils is a line of its own: through the origin where that is
// observed, else just along X or Y.
void JointProblemBuilder::AddDrawnAxis(const std::optional<Segment>& axis, int which) {
  int pencil, index;
  if (!axis || FindAxisLine(obs_, *axis, &pencil, &index)) return;
  const std::string id = which == 0 ? "frame.x_axis" : "frame.y_axis",
                    name = which == 0 ? "the X axis" : "the Y axis";
  ImagePoints points;
  LineFit fit;
  if (!Points({(*axis)[0], (*axis)[1]}, {}, DrawnSigma(), false, &points) ||
      !FitLine(points.points(), DrawnSigma(), &fit).ok())
    return;
  if (p_.origin_observed_) {
    AddAxisLine(std::move(points), fit, which, id, name);
    return;
  }
  p_.x_is_fixed_ = true;
  const Eigen::Vector3d direction = Eigen::Vector3d::Unit(which);
  const int along = AddConstant({direction.x(), direction.y(), direction.z()});
  AddLine(std::move(points), fit.line, along, 0.0, {Feature::Kind::kLine, id, name});
}

}  // namespace circline
