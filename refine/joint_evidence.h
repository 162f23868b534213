// What a set of observations amounts to as a least-squares problem: which unknowns there are, and
// which residuals. Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_EVIDENCE_H_
#define CIRCLINE_REFINE_JOINT_EVIDENCE_H_

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/estimate_pose.h"

namespace circline {

// Parameter blocks are named by their index in JointEvidence::parameters; block 0 is the rotation.
struct CircleTerm {
  int observation, set;
  int center;  // Block (cx, cy), or (cx, cy, radius) if `radius` is -1.
  int radius;
  double factor;  // Known radius, where `radius` is the scale block; else 1.
};

struct LineTerm {
  LineCost::Kind kind;
  int set;
  int shared;  // theta, origin or centre; -1 for a fixed direction.
  int angle;   // phi or psi; -1 for an axis.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  Eigen::Vector3d line;  // Closed-form fit, for the initial angle.
};

struct PointTerm {
  CalibratedPoint measured;
  double sigma_px;
  int point;
};

struct AngleTerm {
  double value, sigma;
  double fixed[2];
  int theta[2];
};

struct LengthTerm {
  int a, b;
  double length;
};

struct ParameterInfo {
  int size;
  bool is_private;  // Appears in one residual block only: eliminated before all others.
};

struct JointEvidence {
  Observations observations;
  EstimationOptions options;
  std::vector<ParameterInfo> parameters;
  std::vector<PointSet> sets;
  std::vector<CircleTerm> circles;
  std::vector<LineTerm> lines;
  std::vector<PointTerm> points;
  std::vector<AngleTerm> angles;
  std::vector<LengthTerm> lengths;
  std::map<std::string, int> thetas;  // In-plane pencil id -> its direction's block.
  int origin = -1, scale = -1;        // Blocks, or -1.
  bool origin_observed = false;       // Else the origin is a convention.
  bool x_is_fixed = false;            // Whether anything fixes the rotation about the normal.

  // See JointProblem for what is expected of both.
  JointEvidence(const Observations& observations, const EstimationOptions& options);

 private:
  int AddParameter(int size, bool is_private);
  int AddSet(const std::vector<Eigen::Vector2d>& pixels, const std::vector<std::uint8_t>& mask,
             double sigma_px, LossType loss);
  void AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block);
  void AddFrame();
  void AddCircle(int index, std::map<std::string, int>* concentric);
  int CenterBlock(const CircleObservation& circle, std::map<std::string, int>* concentric);
  void AddDiameter(const Segment& diameter, double sigma_px, int center);
  void AddPencil(int index);
  void AddLine(const PencilObservation& pencil, int theta, const LineObservation& line, int axis);
  void AddAxis(const std::optional<Segment>& axis, bool is_x);
  void AddAngle(const KnownAngle& known);
  void AddLength(const KnownLength& known);
  int ScaleBlock();
  double DrawnSigma() const;
  bool BothAxes() const;
  int AxisOfLine(int pencil, int line) const;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_EVIDENCE_H_
