#include "circline/refine/joint_problem.h"

#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "circline/refine/covariance.h"
#include "circline/refine/joint_evidence.h"

namespace circline {
namespace {

constexpr double kRadToDeg = 57.29577951308232;
// A point farther than this many standard deviations from its curve counts as an outlier in masks,
// rms and covariance: 99.8 % of a Gaussian's points lie within.
constexpr double kInlierSigmas = 3.09;

double* At(Values* values, int block) { return (*values)[static_cast<std::size_t>(block)].data(); }
const double* At(const Values& values, int block) {
  return values[static_cast<std::size_t>(block)].data();
}

// Where a refinement stands.
struct State {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // Block 0 counts from here.
  double facing = -1.0;
  Values values;
  double stretch = 1.0;  // Of the robust losses.
  // Circles that cannot lie on this plane in front of the camera, and points that are outliers; by
  // term, 1 = left out.
  std::vector<std::uint8_t> circle_left_out, point_left_out;
};

// Plane coordinates (X, Y) at which a ray meets the plane; false where it does not, in front.
bool PlanePoint(const Eigen::Matrix3d& R, double facing, const Eigen::Vector3d& ray, double* xy) {
  const Eigen::Vector3d y = R.transpose() * ray;
  const double depth = facing * y.z();
  if (!(depth > 1e-9 * y.norm())) return false;
  xy[0] = y.x() / depth;
  xy[1] = y.y() / depth;
  return true;
}

// Circle of the plane like a fitted conic: seen in the plane this is an ellipse, and a circle where
// the plane's normal is one of the conic's.
bool PlaneCircle(const Eigen::Matrix3d& R, double facing, const Eigen::Matrix3d& conic,
                 double* cx_cy_radius) {
  const Eigen::Vector3d d(1.0, 1.0, facing);
  const Eigen::Matrix3d in_plane = d.asDiagonal() * R.transpose() * conic * R * d.asDiagonal();
  Ellipse ellipse;
  if (!ConicToEllipse(in_plane, &ellipse)) return false;
  cx_cy_radius[0] = ellipse.center.x();
  cx_cy_radius[1] = ellipse.center.y();
  cx_cy_radius[2] = std::sqrt(ellipse.a * ellipse.b);
  return true;
}

// An ellipse that the plane cannot explain (across or beyond the horizon) is an outlier of this
// seed; the seed is refused only where that leaves no circle.
bool InitializeCircles(const JointEvidence& e, State* state) {
  std::size_t left_out = 0;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    const CircleTerm& t = e.circles[i];
    double circle[3];
    const ConicFit& fit = *e.observations.circles[static_cast<std::size_t>(t.observation)].fit;
    if (!PlaneCircle(state->rotation, state->facing, fit.conic, circle) ||
        !((state->rotation * Eigen::Vector3d(circle[0], circle[1], state->facing)).z() > 0.0)) {
      state->circle_left_out[i] = 1;
      ++left_out;
      continue;
    }
    double* center = At(&state->values, t.center);
    std::copy(circle, circle + 2, center);
    (t.radius < 0 ? center[2] : At(&state->values, t.radius)[0]) = circle[2] / t.factor;
  }
  return e.circles.empty() || left_out < e.circles.size();
}

void InitializeLine(const LineTerm& t, State* state) {
  if (t.angle < 0) return;
  const Eigen::Vector3d m = state->rotation.transpose() * t.line;
  double* angle = At(&state->values, t.angle);
  if (t.kind == LineCost::Kind::kFixedDirection) {
    Eigen::Vector3d a, b;
    PencilBasis(t.direction, &a, &b);
    angle[0] = std::atan2(m.dot(b), m.dot(a));
  } else if (t.kind == LineCost::Kind::kInPlane) {
    const double theta = At(&state->values, t.shared)[0];
    angle[0] = std::atan2(m.z(), -std::sin(theta) * m.x() + std::cos(theta) * m.y());
  } else {
    angle[0] = std::atan2(-m.x(), m.y());  // A diameter.
  }
}

// Plane distances per world unit, where no circle of known radius has set it already.
void InitializeScale(const JointEvidence& e, State* state) {
  const bool from_circle = std::any_of(e.circles.begin(), e.circles.end(),
                                       [&](const CircleTerm& t) { return t.radius == e.scale; });
  if (e.scale < 0 || from_circle || e.lengths.empty()) return;
  const LengthTerm& t = e.lengths.front();
  const double* a = At(&state->values, t.a);
  const double* b = At(&state->values, t.b);
  At(&state->values, e.scale)[0] = std::hypot(a[0] - b[0], a[1] - b[1]) / t.length;
}

// Closed-form values of all parameters at a seed; false where the seed contradicts the evidence.
bool Initialize(const JointEvidence& e, const CameraPose& seed, State* state) {
  state->rotation = seed.rotation;
  state->facing = seed.rotation.col(2).dot(seed.translation) > 0.0 ? 1.0 : -1.0;
  state->values.assign(e.parameters.size(), {0.0, 0.0, 0.0});
  state->circle_left_out.assign(e.circles.size(), 0);
  state->point_left_out.assign(e.points.size(), 0);
  const auto place = [&](const Eigen::Vector3d& ray, int block) {
    return PlanePoint(state->rotation, state->facing, ray, At(&state->values, block));
  };
  if (e.origin >= 0 && !place(seed.translation, e.origin)) return false;
  if (!InitializeCircles(e, state)) return false;
  for (const auto& [id, theta] : e.thetas) {
    const PencilObservation& pencil =
        e.observations.pencils[static_cast<std::size_t>(FindPencil(e.observations, id))];
    const Eigen::Vector3d v = state->rotation.transpose() * pencil.fit->direction;
    At(&state->values, theta)[0] = std::atan2(v.y(), v.x());
  }
  for (const LineTerm& term : e.lines) InitializeLine(term, state);
  for (const LengthTerm& term : e.lengths) {
    const auto ray = [&](int block) {
      return std::find_if(e.points.begin(), e.points.end(),
                          [block](const PointTerm& p) { return p.point == block; })
          ->measured.Homogeneous();
    };
    if (!place(ray(term.a), term.a) || !place(ray(term.b), term.b)) return false;
  }
  InitializeScale(e, state);
  return true;
}

// The residual blocks at a base rotation, on the given point sets (one for each of the evidence's;
// empty ones make none).
std::vector<ResidualTerm> MakeTerms(const JointEvidence& e, const std::vector<PointSet>& sets,
                                    const State& state) {
  const Eigen::Matrix3d& R = state.rotation;
  std::vector<ResidualTerm> terms;
  const auto set = [&sets](int index) { return &sets[static_cast<std::size_t>(index)]; };
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    const CircleTerm& t = e.circles[i];
    if (set(t.set)->points.empty() || state.circle_left_out[i] != 0) continue;
    std::vector<int> blocks = {0, t.center};
    if (t.radius >= 0) blocks.push_back(t.radius);
    terms.push_back({std::make_unique<CircleCost>(set(t.set), &state.stretch, R, state.facing,
                                                  t.radius >= 0, t.factor),
                     blocks});
  }
  for (const LineTerm& t : e.lines) {
    if (set(t.set)->points.empty()) continue;
    std::vector<int> blocks = {0};
    if (t.shared >= 0) blocks.push_back(t.shared);
    if (t.angle >= 0) blocks.push_back(t.angle);
    terms.push_back({std::make_unique<LineCost>(t.kind, set(t.set), &state.stretch, R, state.facing,
                                                t.direction),
                     blocks});
  }
  for (std::size_t i = 0; i < e.points.size(); ++i) {
    const PointTerm& t = e.points[i];
    if (state.point_left_out[i] != 0) continue;
    terms.push_back({std::make_unique<PointCost>(t.measured, t.sigma_px, e.options.line_loss.type,
                                                 &state.stretch, R, state.facing),
                     {0, t.point}});
  }
  for (const AngleTerm& t : e.angles) {
    std::vector<int> blocks;
    for (int theta : t.theta) {
      if (theta >= 0) blocks.push_back(theta);
    }
    terms.push_back({std::make_unique<AngleCost>(t.value, t.sigma, t.fixed), blocks});
  }
  for (const LengthTerm& t : e.lengths) {
    terms.push_back({std::make_unique<LengthCost>(t.length), {t.a, t.b, e.scale}});
  }
  return terms;
}

std::vector<double*> Pointers(const std::vector<int>& blocks, Values* values) {
  std::vector<double*> pointers;
  pointers.reserve(blocks.size());
  for (int block : blocks) pointers.push_back(At(values, block));
  return pointers;
}

double RobustCost(const std::vector<ResidualTerm>& terms, Values* values) {
  double cost = 0.0;
  std::vector<double> residuals;
  for (const ResidualTerm& term : terms) {
    residuals.resize(static_cast<std::size_t>(term.cost->num_residuals()));
    const std::vector<double*> pointers = Pointers(term.blocks, values);
    if (!term.cost->Evaluate(pointers.data(), residuals.data(), nullptr)) {
      return std::numeric_limits<double>::infinity();
    }
    for (double r : residuals) cost += 0.5 * r * r;
  }
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

// Calls visit(set, is_circle, distance) for each circle that takes part, then for each line;
// `terms` as MakeTerms made them on the evidence's own sets. distance(point): signed, pixels.
template <typename Visit>
void ForEachCurve(const JointEvidence& e, const std::vector<ResidualTerm>& terms, State* state,
                  const Visit& visit) {
  std::size_t term = 0;  // MakeTerms writes circles first, then lines.
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state->circle_left_out[i] != 0) continue;
    const auto* cost = static_cast<const CircleCost*>(terms[term].cost.get());
    const Eigen::Matrix3d conic =
        cost->Conic(Pointers(terms[term++].blocks, &state->values).data());
    visit(e.circles[i].set, true,
          [&](const CalibratedPoint& p) { return ConicDistancePx(p, conic); });
  }
  for (const LineTerm& t : e.lines) {
    const auto* cost = static_cast<const LineCost*>(terms[term].cost.get());
    const Eigen::Vector3d line = cost->Line(Pointers(terms[term++].blocks, &state->values).data());
    visit(t.set, false, [&](const CalibratedPoint& p) { return LineDistancePx(p, line); });
  }
}

// What the circles left out cost: as much as points far off, so that no pose gains by explaining
// less.
double LeftOutCost(const JointEvidence& e, const State& state) {
  constexpr double kFarOffSigmas = 30.0;
  double cost = 0.0;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state.circle_left_out[i] == 0) continue;
    const PointSet& set = e.sets[static_cast<std::size_t>(e.circles[i].set)];
    cost += 0.5 * static_cast<double>(set.points.size()) *
            EvaluateLoss(set.loss, kFarOffSigmas * kFarOffSigmas).rho;
  }
  return cost;
}

// Minimises in Ceres; `values` in and out.
Status Minimize(const std::vector<ResidualTerm>& terms,
                const std::vector<ParameterInfo>& parameters, bool x_is_fixed, int max_iterations,
                Values* values) {
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;
  ceres::SubsetManifold without_spin(3, {2});  // Outlives the problem.
  ceres::Problem problem(problem_options);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  bool any_private = false;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    problem.AddParameterBlock((*values)[i].data(), parameters[i].size);
    ordering->AddElementToGroup((*values)[i].data(), parameters[i].is_private ? 0 : 1);
    any_private = any_private || parameters[i].is_private;
  }
  if (!x_is_fixed) problem.SetManifold((*values)[0].data(), &without_spin);
  for (const ResidualTerm& term : terms) {
    problem.AddResidualBlock(term.cost.get(), nullptr, Pointers(term.blocks, values));
  }
  ceres::Solver::Options options;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  options.linear_solver_type = any_private ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
  if (any_private) options.linear_solver_ordering = ordering;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable())
    return Status::Failed("the refinement failed: " + summary.message);
  return Status::Ok();
}

// How wide the losses must be for (nearly) all residuals to lie where they are convex: twice the
// largest |residual| / tuning constant but for the worst hundredth. Tukey's and Geman-McClure's are
// convex up to 0.45 and 0.58 of theirs. 1 or less: nothing lies in the tails.
double RelativeSpread(const JointEvidence& e, const std::vector<ResidualTerm>& terms,
                      State* state) {
  std::vector<double> ratios;
  const auto add = [&](const PointSet& set, const auto& distance) {
    for (const CalibratedPoint& p : set.points) {
      ratios.push_back(std::abs(distance(p)) / (set.sigma_px * LossTuningConstant(set.loss)));
    }
  };
  ForEachCurve(e, terms, state, [&](int set, bool, const auto& distance) {
    add(e.sets[static_cast<std::size_t>(set)], distance);
  });
  if (ratios.empty()) return 0.0;
  const auto quantile = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() * 99 / 100);
  std::nth_element(ratios.begin(), quantile, ratios.end());
  constexpr double kConvex = 2.0;
  return kConvex * *quantile;
}

// Graduated non-convexity: where residuals lie far in the tails, the losses start as wide as these
// ask for, and narrow to their own width as they shrink (Black and Rangarajan 1996).
Status GraduatedMinimize(const JointEvidence& e, const std::vector<ResidualTerm>& terms,
                         int max_iterations, State* state) {
  constexpr double kFarOut = 3.0;  // Gaussian noise alone has a spread of 2.2.
  constexpr double kShrink = 0.5;
  constexpr int kIterationsOnTheWay = 5;
  const double spread = RelativeSpread(e, terms, state);
  state->stretch = spread > kFarOut ? spread : 1.0;
  while (state->stretch > 1.0) {
    const Status status = Minimize(terms, e.parameters, e.x_is_fixed,
                                   std::min(kIterationsOnTheWay, max_iterations), &state->values);
    if (!status.ok()) return status;
    state->stretch =
        std::max(1.0, std::min(kShrink * state->stretch, RelativeSpread(e, terms, state)));
  }
  return Minimize(terms, e.parameters, e.x_is_fixed, max_iterations, &state->values);
}

// Moves the rotation found into the base, so that block 0 is zero: the covariance is that of the
// rotation at the estimate.
void Recenter(State* state) {
  state->rotation = RotationChart(state->rotation, At(state->values, 0)).rotation;
  state->values[0] = {0.0, 0.0, 0.0};
  const Eigen::Quaterniond q(state->rotation);  // Rounding of many products, off.
  state->rotation = q.normalized().toRotationMatrix();
}

// From a seed to (near) a minimum, with the rotation in the state's base.
Status Converge(const JointEvidence& e, const CameraPose& seed, int max_iterations, State* state) {
  if (!Initialize(e, seed, state)) return Status::Failed("a seed pose contradicts the evidence");
  const std::vector<ResidualTerm> terms = MakeTerms(e, e.sets, *state);
  const Status status = GraduatedMinimize(e, terms, max_iterations, state);
  if (status.ok()) Recenter(state);
  return status;
}

// --- Results ---

// How far the image of a point in the camera frame misses its measurement, pixels (first order).
double PointMissPx(const CalibratedPoint& measured, const Eigen::Vector3d& X) {
  if (!(X.z() > 0.0)) return std::numeric_limits<double>::infinity();
  Eigen::Matrix2d x_from_pixel;
  x_from_pixel << measured.x_from_pixel[0], measured.x_from_pixel[1], measured.x_from_pixel[2],
      measured.x_from_pixel[3];
  return (x_from_pixel.inverse() * (X.head<2>() / X.z() - measured.x)).norm();
}

// 1.4826 x the median; `parameters` of the values' degrees of freedom are spent.
double MadScale(std::vector<double> distances, std::size_t parameters) {
  constexpr std::size_t kEnough = 8;
  if (distances.size() < parameters + kEnough) return 0.0;
  const double n = static_cast<double>(distances.size());
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return 1.4826 * *middle * std::sqrt(n / (n - static_cast<double>(parameters)));
}

// Splits every set into inliers, kept without loss, and the rest; counts, rms and scales on the
// way. A set with fewer than `minimum` inliers is an outlier as a whole, and left empty.
class InlierFilter {
 public:
  InlierFilter(const JointEvidence& e, PoseHypothesis* h) : e_(e), h_(h), kept_(e.sets.size()) {}

  // `distance`: of a point, signed, pixels.
  template <typename Distance>
  void Add(int index, std::size_t minimum, const Distance& distance,
           std::vector<double>* distances) {
    const PointSet& set = e_.sets[static_cast<std::size_t>(index)];
    PointSet& out = kept_[static_cast<std::size_t>(index)];
    out.sigma_px = set.sigma_px;
    double squares = 0.0;
    for (const CalibratedPoint& p : set.points) {
      const double d = std::abs(distance(p));
      distances->push_back(d);
      if (!(d <= kInlierSigmas * set.sigma_px)) continue;
      squares += d * d;
      out.points.push_back(p);
    }
    h_->num_observations += static_cast<int>(set.points.size());
    if (out.points.size() < minimum) {
      out.points.clear();
      return;
    }
    squares_ += squares;
    h_->num_inliers += static_cast<int>(out.points.size());
  }

  void AddPoint(double miss_px, bool is_inlier) {
    ++h_->num_observations;
    if (!is_inlier) return;
    ++h_->num_inliers;
    squares_ += miss_px * miss_px;
  }

  std::vector<PointSet> Finish() {
    h_->rms_px = h_->num_inliers > 0 ? std::sqrt(squares_ / h_->num_inliers) : 0.0;
    return std::move(kept_);
  }

 private:
  const JointEvidence& e_;
  PoseHypothesis* h_;
  std::vector<PointSet> kept_;
  double squares_ = 0.0;
};

std::vector<PointSet> KeepInliers(const JointEvidence& e, const std::vector<ResidualTerm>& terms,
                                  State* state, PoseHypothesis* h, ResidualScales* scales) {
  InlierFilter filter(e, h);
  std::vector<double> of_circles, of_lines;
  ForEachCurve(e, terms, state, [&](int set, bool is_circle, const auto& distance) {
    filter.Add(set, is_circle ? 5 : 2, distance, is_circle ? &of_circles : &of_lines);
  });
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state->circle_left_out[i] != 0) {
      h->num_observations +=
          static_cast<int>(e.sets[static_cast<std::size_t>(e.circles[i].set)].points.size());
    }
  }
  for (std::size_t i = 0; i < e.points.size(); ++i) {
    const PointTerm& t = e.points[i];
    const double* xy = At(state->values, t.point);
    const double miss_px =
        PointMissPx(t.measured, state->rotation * Eigen::Vector3d(xy[0], xy[1], state->facing));
    state->point_left_out[i] = miss_px <= kInlierSigmas * t.sigma_px ? 0 : 1;
    filter.AddPoint(miss_px, state->point_left_out[i] == 0);
  }
  constexpr std::size_t kPerCircle = 3, kPerLine = 1, kPose = 3;
  scales->conic_px = MadScale(of_circles, kPose + kPerCircle * e.circles.size());
  scales->line_px = MadScale(of_lines, kPose + kPerLine * e.lines.size());
  return filter.Finish();
}

// Origin of the world in units of the plane's distance, camera frame.
Eigen::Vector3d OriginInPlane(const JointEvidence& e, const State& state, const CameraPose& seed) {
  if (e.origin >= 0) {
    const double* o = At(state.values, e.origin);
    return {o[0], o[1], state.facing};
  }
  double o[2] = {0.0, 0.0};
  PlanePoint(state.rotation, state.facing, seed.translation, o);
  return {o[0], o[1], state.facing};
}

void FillPose(const JointEvidence& e, const State& state, const Eigen::Vector3d& origin,
              PoseHypothesis* h) {
  h->cam_from_world.rotation = state.rotation;
  const Eigen::Vector3d t = state.rotation * origin;
  h->metric = e.scale >= 0;
  h->origin_observed = e.origin_observed;
  h->cam_from_world.translation =
      h->metric ? Eigen::Vector3d(t / At(state.values, e.scale)[0]) : t.normalized();
}

// Columns: how the shared parameters move [delta, delta_t].
Eigen::MatrixXd PoseFromShared(const JointEvidence& e, const State& state,
                               const Eigen::Vector3d& origin, bool hold_spin,
                               const SharedCovariance& shared) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(6, shared.covariance.cols());
  const Eigen::Matrix3d& R = state.rotation;
  const int spin = hold_spin ? 2 : 3;
  const Eigen::Vector3d P = R * origin;
  // d t / d P: a direction's length does not vary.
  Eigen::Matrix3d by_P =
      (Eigen::Matrix3d::Identity() - P * P.transpose() / P.squaredNorm()) / P.norm();
  if (e.scale >= 0) {
    const double scale = At(state.values, e.scale)[0];
    by_P = Eigen::Matrix3d::Identity() / scale;
    T.block<3, 1>(3, shared.offsets[static_cast<std::size_t>(e.scale)]) = -P / (scale * scale);
  }
  T.topLeftCorner(3, spin) = R.leftCols(spin);
  T.block(3, 0, 3, spin) = -(by_P * R * CrossMatrix(origin)).leftCols(spin);
  if (e.origin >= 0) {
    T.block<3, 2>(3, shared.offsets[static_cast<std::size_t>(e.origin)]) = by_P * R.leftCols<2>();
  }
  return T;
}

// Orthonormal basis of the free directions among [delta, delta_t]; the spin about the normal first.
void FillFreeDirections(const Eigen::MatrixXd& T, const Eigen::MatrixXd& null_space, bool hold_spin,
                        const Eigen::Matrix3d& R, PoseHypothesis* h) {
  Eigen::MatrixXd free = T * null_space;
  if (hold_spin) {
    free.conservativeResize(6, free.cols() + 1);
    free.rightCols<1>() << R.col(2), Eigen::Vector3d::Zero();
  }
  if (free.cols() == 0) return;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(free);
  qr.setThreshold(1e-6);
  const Eigen::MatrixXd Q = Eigen::MatrixXd(qr.householderQ());
  for (Eigen::Index k = 0; k < qr.rank(); ++k) {
    std::array<double, 6> direction;
    Eigen::Map<Vector6d>(direction.data()) = Q.col(k);
    h->free_directions.push_back(direction);
  }
}

// Volume element of the parameters in which a scene is as likely anywhere: rotations by their
// invariant measure, the first circle's centre uniform in space in units of its radius, the others
// in the plane in the same unit, radii by their logarithm. Log of (that measure / the parameters'
// own).
double LogMeasure(const JointEvidence& e, const State& state) {
  const Values& values = state.values;
  double first_radius = 0.0, log_measure = 0.0;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    const CircleTerm& t = e.circles[i];
    if (state.circle_left_out[i] != 0) continue;
    const double radius =
        std::abs(t.radius < 0 ? At(values, t.center)[2] : t.factor * At(values, t.radius)[0]);
    if (first_radius == 0.0) {
      first_radius = radius;
      log_measure -= 4.0 * std::log(radius);
    } else {
      log_measure -= 2.0 * std::log(first_radius) + std::log(radius);
    }
  }
  return log_measure;
}

void FillFeatures(const JointEvidence& e, const State& state, double unit, PoseHypothesis* h) {
  const Eigen::Matrix3d& R = state.rotation;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    const CircleTerm& t = e.circles[i];
    if (state.circle_left_out[i] != 0) continue;
    const double* c = At(state.values, t.center);
    CircleEstimate estimate;
    estimate.id = e.observations.circles[static_cast<std::size_t>(t.observation)].id;
    estimate.normal = -state.facing * R.col(2);
    const Eigen::Vector3d center = R * Eigen::Vector3d(c[0], c[1], state.facing);
    estimate.center = unit * center;
    estimate.radius =
        unit * std::abs(t.radius < 0 ? c[2] : t.factor * At(state.values, t.radius)[0]);
    CameraToPixel(e.observations.camera, center, &estimate.center_px);
    h->circles.push_back(estimate);
  }
  const Eigen::Matrix3d rotation_covariance = h->Covariance().topLeftCorner<3, 3>();
  for (const PencilObservation& pencil : e.observations.pencils) {
    PencilEstimate estimate;
    estimate.id = pencil.id;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    if (pencil.direction != PencilDirection::kFree) {
      estimate.direction = R.col(static_cast<int>(pencil.direction));
      const Eigen::Matrix3d cross = CrossMatrix(estimate.direction);
      covariance = cross * rotation_covariance * cross.transpose();
    } else if (pencil.fit) {
      estimate.direction = pencil.fit->direction;
      covariance = pencil.fit->covariance;
      const auto theta = e.thetas.find(pencil.id);
      if (theta != e.thetas.end()) {
        const double angle = At(state.values, theta->second)[0];
        estimate.direction = R * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
      }
    } else {
      continue;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
    estimate.sigma_deg = kRadToDeg * std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
    h->pencils.push_back(estimate);
  }
}

bool IsRobust(const EstimationOptions& options) {
  return options.conic_loss.type != LossType::kTrivial ||
         options.line_loss.type != LossType::kTrivial;
}

}  // namespace

JointProblem::JointProblem(const Observations& observations, const EstimationOptions& options)
    : evidence_(std::make_unique<JointEvidence>(observations, options)) {}

JointProblem::~JointProblem() = default;

bool JointProblem::spin_is_free() const { return !evidence_->x_is_fixed; }

double JointProblem::SeedCost(const CameraPose& seed) const {
  State state;
  if (!Initialize(*evidence_, seed, &state)) return std::numeric_limits<double>::infinity();
  return RobustCost(MakeTerms(*evidence_, evidence_->sets, state), &state.values) +
         LeftOutCost(*evidence_, state);
}

Status JointProblem::ApproachFrom(const CameraPose& seed, Approach* approach) const {
  const JointEvidence& e = *evidence_;
  State state;
  PoseHypothesis h;
  constexpr int kFirstIterations = 8;
  const Status status =
      Converge(e, seed, std::min(kFirstIterations, e.options.max_iterations), &state);
  if (!status.ok()) return status;
  const std::vector<ResidualTerm> terms = MakeTerms(e, e.sets, state);
  approach->cost = RobustCost(terms, &state.values) + LeftOutCost(e, state);
  KeepInliers(e, terms, &state, &h, &approach->scales);
  FillPose(e, state, OriginInPlane(e, state, seed), &h);
  approach->pose = h.cam_from_world;
  const bool finite = std::isfinite(approach->cost) && approach->pose.rotation.allFinite() &&
                      approach->pose.translation.allFinite();
  return finite ? Status::Ok() : Status::Failed("the refinement left the range of numbers");
}

Status JointProblem::Refine(const CameraPose& seed, PoseHypothesis* h) const {
  const JointEvidence& e = *evidence_;
  *h = PoseHypothesis();
  State state;
  const Status status = Converge(e, seed, e.options.max_iterations, &state);
  if (!status.ok()) return status;
  const bool hold_spin = !e.x_is_fixed;
  const std::vector<ResidualTerm> terms = MakeTerms(e, e.sets, state);
  h->cost = RobustCost(terms, &state.values) + LeftOutCost(e, state);
  ResidualScales unused;
  const std::vector<PointSet> inliers = KeepInliers(e, terms, &state, h, &unused);

  SharedCovariance shared;
  const std::vector<ResidualTerm> inlier_terms = MakeTerms(e, inliers, state);
  if (!std::isfinite(h->cost) ||
      !ComputeCovariance(inlier_terms, e.parameters, state.values, hold_spin, &shared)) {
    return Status::Failed("the refined pose leaves some circle or line without inliers");
  }
  const Eigen::Vector3d origin = OriginInPlane(e, state, seed);
  FillPose(e, state, origin, h);
  const Eigen::MatrixXd T = PoseFromShared(e, state, origin, hold_spin, shared);
  // Every loss is tuned to 95 % efficiency: that much wider than least squares on the inliers.
  const double inflation = IsRobust(e.options) ? 1.0 / 0.95 : 1.0;
  const Matrix6d covariance = inflation * T * shared.covariance * T.transpose();
  Eigen::Map<Matrix6d>(h->covariance.data()) = covariance;
  FillFreeDirections(T, shared.null_space, hold_spin, state.rotation, h);
  h->rank = CovarianceRank(covariance);
  h->log_det = shared.log_det + 2.0 * LogMeasure(e, state);
  FillFeatures(e, state, h->cam_from_world.translation.norm() / origin.norm(), h);
  const bool finite = covariance.allFinite() && h->cam_from_world.rotation.allFinite() &&
                      h->cam_from_world.translation.allFinite() && std::isfinite(h->log_det);
  return finite ? Status::Ok() : Status::Failed("the refinement left the range of numbers");
}

}  // namespace circline
