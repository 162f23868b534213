#include "circline/estimators/circle_focal.h"

#include <Eigen/Dense>
#include <cmath>
#include <complex>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/focal_roots.h"
#include "circline/estimators/pose.h"

namespace circline {
namespace {

// f^2 = |b|^2 - |a|^2 of the points a +- ib in which a plane's vanishing line meets the image of
// one of its circles. With s the line's point at infinity and t across it, unit, s.t = 0 in the
// first two coordinates: tau s + t lies on C where tau^2 s'Cs + 2 tau s'Ct + t'Ct = 0.
FocalRoots OnLine(const Eigen::Matrix3d& C, const Eigen::Vector3d& vanishing_line) {
  const Eigen::Vector3d l = vanishing_line.normalized();
  const double slope = l.head<2>().norm();
  if (!(slope > kRounding)) return FocalRoots(FocalRefusal::kFrontal);
  const Eigen::Vector3d s = Eigen::Vector3d(l.y(), -l.x(), 0.0) / slope, t = l.cross(s);
  const Eigen::Vector3d Cs = C * s, Ct = C * t;
  const double real = -s.dot(Ct) / s.dot(Cs);
  const double imag2 = t.dot(Ct) / s.dot(Cs) - real * real;
  if (!(imag2 > 0.0)) return FocalRoots(FocalRefusal::kLineMeetsCircle);
  FocalRoots roots;
  roots.Add((imag2 - real * real - t.head<2>().squaredNorm()) / (t.z() * t.z()));
  return roots;
}

// Two conics in coordinates u in which the first is the unit circle: x = T u, D = diag(1, 1, -1).
struct ConicPencil {
  Eigen::Matrix3d T, second;

  static Eigen::Matrix3d D() { return Eigen::Vector3d(1.0, 1.0, -1.0).asDiagonal(); }
  // The member second - lambda D.
  Eigen::Matrix3d Member(double lambda) const { return second - lambda * D(); }
  Eigen::Vector3d LineInImage(const Eigen::Vector3d& line) const {
    return T.inverse().transpose() * line;
  }
};

bool MakeConicPencil(const Eigen::Matrix3d& first, const Eigen::Matrix3d& second,
                     ConicPencil* pencil) {
  Ellipse e;
  Eigen::Matrix3d scaled;
  if (!ConicToEllipse(first, &e) || !NormalizeEllipse(second, &scaled)) return false;
  const double c = std::cos(e.angle), s = std::sin(e.angle);
  pencil->T << e.a * c, -e.b * s, e.center.x(), e.a * s, e.b * c, e.center.y(), 0.0, 0.0, 1.0;
  return NormalizeEllipse(TransformConic(scaled, pencil->T), &pencil->second);
}

Eigen::Matrix3d Adjugate(const Eigen::Matrix3d& S) {
  Eigen::Matrix3d adjugate;
  adjugate << S.col(1).cross(S.col(2)), S.col(2).cross(S.col(0)), S.col(0).cross(S.col(1));
  return adjugate.transpose();
}

// The lambda with det(second - lambda D) = 0.
Eigen::Vector3cd DegenerateMembers(const ConicPencil& pencil) {
  return Eigen::EigenSolver<Eigen::Matrix3d>(ConicPencil::D() * pencil.second, false).eigenvalues();
}

// f^2 from both of two concentric circles.
std::array<FocalRoots, 2> Concentric(const Vector<12>& z) {
  const Eigen::Matrix3d A = VectorToConic(z.head<6>()), B = VectorToConic(z.tail<6>());
  ConicPencil pencil;
  const auto refused = [](FocalRefusal why) {
    return std::array{FocalRoots(why), FocalRoots(why)};
  };
  if (!MakeConicPencil(A, B, &pencil)) return refused(FocalRefusal::kNoEllipse);
  // Two of them are one, of the pair of lines that touch both conics.
  const Eigen::Vector3cd lambdas = DegenerateMembers(pencil);
  Eigen::Index simple;
  (3.0 * lambdas.array() - lambdas.sum()).abs().maxCoeff(&simple);
  const Eigen::Matrix3d adjugate = Adjugate(pencil.Member(lambdas[simple].real()));
  Eigen::Index longest;
  const double size = adjugate.colwise().norm().maxCoeff(&longest);
  constexpr double kSame = 1e-9;  // A root that is triple is good to 1e-5, and enters squared.
  if (!(size > kSame)) return refused(FocalRefusal::kSameCircle);
  const Eigen::Vector3d line = pencil.LineInImage(ConicPencil::D() * adjugate.col(longest));
  return {OnLine(A, line), OnLine(B, line)};
}

// The two lines of a symmetric matrix l m^T + m l^T, of which `adjugate` is that: -(l x m)(l x
// m)^T.
std::array<Eigen::Vector3d, 2> LinesOf(const Eigen::Matrix3d& pair,
                                       const Eigen::Matrix3d& adjugate) {
  Eigen::Index i, row, column;
  adjugate.diagonal().minCoeff(&i);
  const Eigen::Vector3d p = -adjugate.col(i) / std::sqrt(-adjugate(i, i));
  const Eigen::Matrix3d single = pair + CrossMatrix(p);
  single.cwiseAbs().maxCoeff(&row, &column);
  return {single.row(row).transpose(), single.col(column)};
}

FocalRoots Coplanar(const Vector<12>& z) {
  const Eigen::Matrix3d A = VectorToConic(z.head<6>());
  ConicPencil pencil;
  if (!MakeConicPencil(A, VectorToConic(z.tail<6>()), &pencil))
    return FocalRoots(FocalRefusal::kNoEllipse);
  // A pair of real lines has eigenvalues of both signs beside 0: the trace of the adjugate, which
  // is their product, is negative.
  Eigen::Matrix3d pair = Eigen::Matrix3d::Zero(), adjugate = Eigen::Matrix3d::Zero();
  for (const std::complex<double>& lambda : DegenerateMembers(pencil)) {
    if (lambda.imag() != 0.0) continue;
    const Eigen::Matrix3d member = pencil.Member(lambda.real());
    const Eigen::Matrix3d of_member = Adjugate(member);
    if (of_member.trace() < adjugate.trace()) pair = member, adjugate = of_member;
  }
  // A double root, of circles about one centre, is good to 1e-8.
  constexpr double kSameCenter = 1e-7;
  if (!(adjugate.trace() < -kSameCenter)) return FocalRoots(FocalRefusal::kSameCircle);
  const Eigen::Vector2d other =
      -pencil.second.topLeftCorner<2, 2>().inverse() * pencil.second.topRightCorner<2, 1>();
  FocalRoots roots;
  roots.why = FocalRefusal::kLineMeetsCircle;
  for (const Eigen::Vector3d& line : LinesOf(pair, adjugate)) {
    // The vanishing line leaves both circles on one side.
    if (!(line.z() * other.homogeneous().dot(line) > 0.0)) continue;
    const FocalRoots on_line = OnLine(A, pencil.LineInImage(line));
    if (on_line.count == 1) roots.Add(on_line.squared[0]);
    if (roots.count == 0) roots.why = on_line.why;
  }
  return roots;
}

FocalInputs<12> TwoConics(const ConicFit& a, const ConicFit& b) {
  FocalInputs<12> inputs;
  inputs.SetConic(0, a);
  inputs.SetConic(6, b);
  return inputs;
}

}  // namespace

ConicFit WithTiltError(const ConicFit& fit, double tilt_sigma) {
  ConicFit out = fit;
  Eigen::Map<Matrix6d> covariance(out.covariance.data());
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(fit.conic, &poses);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 2 * count; ++i) {
    const CirclePose& pose = poses[static_cast<std::size_t>(i / 2)];
    const Eigen::Vector3d x = pose.normal.unitOrthogonal();
    const Eigen::Vector3d axis = i % 2 == 0 ? x : pose.normal.cross(x);
    const auto tilted = [&](double angle) {
      CirclePose moved = pose;
      moved.normal = ExpRotation(angle * axis) * pose.normal;
      return ConicToVector(ProjectCircle(moved));
    };
    const Vector6d rate = (tilted(kStep) - tilted(-kStep)) / (2.0 * kStep);
    covariance += tilt_sigma * tilt_sigma / count * rate * rate.transpose();
  }
  return out;
}

int FocalFromCircleAndCenter(const ConicFit& circle, const Eigen::Vector3d& center,
                             const Eigen::Matrix3d& center_covariance, FocalSolution* solution,
                             FocalRefusal* why) {
  FocalInputs<9> inputs;
  inputs.SetConic(0, circle);
  inputs.SetPoint(6, center, center_covariance);
  return FocalSolutionsOf<9>(
      [](const Vector<9>& z) {
        const Eigen::Matrix3d C = VectorToConic(z.head<6>());
        return OnLine(C, C * z.tail<3>());
      },
      inputs, solution, why);
}

int FocalFromConcentricCircles(const ConicFit& a, const ConicFit& b, FocalSolution* solution,
                               FocalRefusal* why) {
  return CombinedSolution<2>(Concentric, TwoConics(a, b), solution, why);
}

int FocalFromCoplanarCircles(const ConicFit& a, const ConicFit& b,
                             std::array<FocalSolution, 2>* solutions, FocalRefusal* why) {
  return FocalSolutionsOf<12>(Coplanar, TwoConics(a, b), solutions->data(), why);
}

}  // namespace circline
