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
#include "circline/refine/estimate_pose.h"
#include "circline/refine/quadratic_models.h"

namespace circline {

// Parameter blocks are named by their index in JointEvidence::parameters; block 0 is the rotation.
struct CircleTerm {
  int observation, set;
  int center;     // Block (cx, cy), or (cx, cy, radius) if `radius` is -1.
  int radius;     // The scale block, one that a group of equal circles shares, or its own.
  double factor;  // Known radius, where `radius` is the scale block; else 1.
};

// How a line's interpretation plane follows from the unknowns.
enum class LineKind {
  kFixedDirection,  // phi: along a world axis.
  kInPlane,         // theta, phi: direction (cos theta, sin theta, 0).
  kXAxis,           // origin (2): the line Y = origin.y of the plane.
  kYAxis,           // origin (2): the line X = origin.x.
  kDiameter,        // centre (2), psi: through the centre at angle psi.
};

struct LineTerm {
  LineKind kind;
  int set;
  int shared;             // theta, origin or centre; -1 for a fixed direction.
  int angle;              // phi or psi; -1 for an axis.
  Eigen::Vector3d line;   // Closed-form fit, for the initial angle.
  std::string name = {};  // For people: "pencil 'L1', line 3".
  // Of kFixedDirection: unit vectors across the direction; the normal is cos(phi) a + sin(phi) b.
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = Eigen::Vector3d::Zero();

  void SetDirection(const Eigen::Vector3d& direction);
};

struct PointTerm {
  MeasuredPoint measured;
  int point;
  int like_set;      // The set whose noise it shares; -1 = none.
  std::string name;  // For people: "the centre of circle 'c0'".
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
  bool is_private;  // Appears in one term only: eliminated before all others.
};

// Standard deviations of the points of features that state none, pixels, where the options state
// none either.
struct NoiseScales {
  double conic_px = 0.0, line_px = 0.0;
};

struct JointEvidence {
  const Observations& observations;  // Outlive this.
  const EstimationOptions& options;
  Camera camera;  // That of the observations, unless it has been refocused (focal.h).
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
  std::vector<std::string> unused;    // What was said and has no part in it, and why.

  // See JointProblem for what is expected of both.
  JointEvidence(const Observations& observations, const EstimationOptions& options,
                const NoiseScales& scales);

  void SetScales(const NoiseScales& scales);

 private:
  std::map<std::string, int> radius_groups_;  // Of circles of equal, unknown radii: their block.

  int AddParameter(int size, bool is_private);
  int AddSet(const std::vector<Eigen::Vector2d>& pixels, const std::vector<std::uint8_t>& mask,
             double sigma_px, bool is_conic);
  bool AddSegment(const Segment& segment, double sigma_px, LineTerm* term);
  void AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block, int like_set,
                const std::string& name);
  void AddFrame();
  void AddCircle(int index, std::map<std::string, int>* concentric);
  bool IsAtOrigin(const CircleObservation& circle) const;
  int CenterBlock(const CircleObservation& circle, std::map<std::string, int>* concentric);
  void AddDiameter(const CircleObservation& circle, const Segment& diameter, int center);
  void AddPencil(int index);
  void AddLine(const PencilObservation& pencil, int theta, const LineObservation& line, int axis,
               const std::string& name);
  void AddAxis(const std::optional<Segment>& axis, bool is_x);
  void AddAngle(const KnownAngle& known);
  void AddLength(const KnownLength& known);
  int ScaleBlock();
  int RadiusBlock(const CircleObservation& circle, bool is_private);
  double DrawnSigma() const;
  bool BothAxes() const;
  int AxisOfLine(int pencil, int line) const;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_EVIDENCE_H_
