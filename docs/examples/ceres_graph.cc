// Circles and parallel lines in a ceres::Problem of your own: three photos of a manhole cover (0.6
// m across), a round sign of unknown size, and kerbs that run along one direction. Simulated, 0.3
// px of noise, one point in twenty an outlier. All poses, circles and the direction come out at
// once, with covariances. The package test builds and runs this file.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "circline/estimators/line.h"
#include "circline/estimators/random.h"
#include "circline/refine/cost_functions.h"

using namespace circline;
using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// Each member is a parameter block, as cost_functions.h names them.
struct Photo {
  Quaterniond rotation;  // cam_from_world; Eigen keeps x, y, z, w, as the cost functions want.
  Vector3d translation;
};
struct Circle {
  Vector3d center, normal;
  double radius;
};
struct Graph {
  Photo photos[3];
  Circle circles[2];         // Cover, sign.
  Vector3d kerbs;            // Their direction.
  double across[3][3] = {};  // Of kerb k in photo i.
};
const Vector3d kKerbs[] = {{0, 0.6, 0}, {0, 0.6, 0.15}, {0, -1, 0}};

constexpr double kSigmaPx = 0.3;
Random rng(1);
Vector3d Noise(double s) { return s * Vector3d(rng.Normal(), rng.Normal(), rng.Normal()); }
Photo Moved(const Photo& photo, double turn, double shift) {
  const Vector3d v = Noise(turn);
  const Quaterniond q(AngleAxisd(v.norm(), v.normalized()));
  return {q * photo.rotation, photo.translation + Noise(shift)};
}
double Off(const Photo& a, const Photo& b) { return 57.3 * a.rotation.angularDistance(b.rotation); }
Photo LookFrom(const Vector3d& eye, double yaw) {  // North by yaw, and down.
  const Quaterniond q = AngleAxisd(2.0, Vector3d::UnitX()) * AngleAxisd(yaw, Vector3d::UnitZ());
  return {q, -(q * eye)};
}

// What your front end brings: pixels, here those of points of the world.
ImagePoints See(const Camera& camera, const Photo& photo, const std::vector<Vector3d>& points) {
  std::vector<Eigen::Vector2d> pixels;
  for (const Vector3d& X : points) {
    Eigen::Vector2d pixel;
    if (!CameraToPixel(camera, photo.rotation * X + photo.translation, &pixel)) continue;
    pixels.push_back(pixel + Noise(rng.UniformInt(20) == 0 ? 8.0 : kSigmaPx).head<2>());
  }
  ImagePoints::Options options;
  options.sigma_px = kSigmaPx;
  options.loss = LossType::kCauchy;  // Of each point, inside the block.
  // Points of photographs share errors: options.weight below 1 says how much less they count.
  return ImagePoints(camera, pixels, /*inliers=*/{}, options);
}
ImagePoints SeeCircle(const Camera& camera, const Photo& photo, const Circle& c) {
  const Vector3d u = c.normal.unitOrthogonal(), v = c.normal.cross(u);
  std::vector<Vector3d> points;
  for (double a = 0.0; a < 6.28; a += 0.08)
    points.push_back(c.center + c.radius * (std::cos(a) * u + std::sin(a) * v));
  return See(camera, photo, points);
}
ImagePoints SeeKerb(const Camera& camera, const Photo& photo, const Vector3d& at) {
  std::vector<Vector3d> points;
  for (double x = -1.0; x < 1.5; x += 0.05) points.push_back(at + x * Vector3d::UnitX());
  return See(camera, photo, points);
}

int main() {
  Camera camera;
  camera.model = CameraModel::kOpenCV;
  camera.fx = camera.fy = 1000.0, camera.cx = 640.0, camera.cy = 480.0;
  camera.distortion = {-0.1, 0.02};
  const Circle cover = {Vector3d::Zero(), Vector3d::UnitZ(), 0.3};
  const Circle sign = {{0.8, 0.9, 0.7}, Vector3d(-0.4, -1.0, 0.2).normalized(), 0.25};
  const Photo a = LookFrom({0.2, -3, 1.6}, 0.1), b = LookFrom({1.7, -2.6, 1.5}, -0.4);
  const Graph truth = {{a, b, LookFrom({-1.5, -2, 2}, 0.6)}, {cover, sign}, Vector3d::UnitX(), {}};

  // Where you start from: odometry, or EstimatePose on each photo. Here the truth, a little off.
  Graph graph = truth;
  for (Photo& photo : graph.photos) photo = Moved(photo, 0.02, 0.05);
  for (Circle& c : graph.circles)
    c = {c.center + Noise(0.03), (c.normal + Noise(0.03)).normalized(), 0.3};
  graph.kerbs = (truth.kerbs + Noise(0.03)).normalized();
  const Graph start = graph;

  ceres::Problem problem;  // Owns cost functions and manifolds.
  std::vector<FeatureCost*> features;
  for (int i = 0; i < 3; ++i) {
    double* q = graph.photos[i].rotation.coeffs().data();
    double* t = graph.photos[i].translation.data();
    for (int k = 0; k < 2; ++k) {  // A block of a landmark is shared by all photos that see it.
      Circle& c = graph.circles[k];
      features.push_back(
          new CircleContourCost(SeeCircle(camera, truth.photos[i], truth.circles[k]), {}));
      problem.AddResidualBlock(features.back(), nullptr, q, t, c.center.data(), c.normal.data(),
                               &c.radius);
    }
    for (int k = 0; k < 3; ++k) {  // A line lies where it likes across the common direction.
      ImagePoints kerb = SeeKerb(camera, truth.photos[i], kKerbs[k]);
      LineFit fit;
      if (!FitLine(kerb.points(), kSigmaPx, &fit).ok()) return 1;
      auto* cost = new DirectionLineCost(std::move(kerb), fit.line, {});
      const double* at[] = {q, graph.kerbs.data()};
      if (!cost->Start(at, &graph.across[i][k])) return 1;
      problem.AddResidualBlock(cost, nullptr, q, graph.kerbs.data(), &graph.across[i][k]);
      features.push_back(cost);
    }
    problem.SetManifold(q, new ceres::EigenQuaternionManifold);
  }
  for (Vector3d* unit : {&graph.circles[0].normal, &graph.circles[1].normal, &graph.kerbs})
    problem.SetManifold(unit->data(), new ceres::SphereManifold<3>);

  // The gauge. Scale: one radius is known (to 0.1 %: NewLogPrior(0.3, 0.001)). Place: the first
  // pose is known to 0.1 degrees and 5 mm; where nothing is, hold its two blocks constant.
  problem.SetParameterBlockConstant(&graph.circles[0].radius);
  const Photo known = Moved(truth.photos[0], 1.7e-3, 5e-3);
  Matrix6d covariance = Matrix6d::Zero();  // Of [rotation (camera frame, rad), translation].
  covariance.diagonal() << Vector3d::Constant(3e-6), Vector3d::Constant(2.5e-5);
  problem.AddResidualBlock(NewPosePrior(known.rotation.matrix(), known.translation, covariance),
                           nullptr, graph.photos[0].rotation.coeffs().data(),
                           graph.photos[0].translation.data());

  ceres::Solver::Summary summary;
  for (const double stretch : {100.0, 10.0, 1.0}) {  // A start tens of sigmas off is no outlier.
    Weighing wide;
    wide.stretch = stretch;
    for (FeatureCost* feature : features) feature->set_weighing(wide);
    ceres::Solve(ceres::Solver::Options(), &problem, &summary);
  }
  std::printf("%s\n", summary.BriefReport().c_str());

  bool right = summary.IsSolutionUsable();
  for (int i = 0; i < 3; ++i) {
    const Photo &now = graph.photos[i], &is = truth.photos[i];
    const std::vector<const double*> pose = {now.rotation.coeffs().data(), now.translation.data()};
    ceres::Covariance sigma{ceres::Covariance::Options()};
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> C;  // In the manifolds' own coordinates, and so:
    right = right && sigma.Compute(pose, &problem) &&
            sigma.GetCovarianceMatrixInTangentSpace(pose, C.data());
    Eigen::Matrix<double, 6, 1> error;
    ceres::EigenQuaternionManifold().Minus(is.rotation.coeffs().data(), pose[0], error.data());
    error.tail<3>() = is.translation - now.translation;
    const double sigmas = std::sqrt(error.dot(C.ldlt().solve(error)) / 6.0);
    std::printf("photo %d: %.2f degrees off, then %.2f: %.1f sigma\n", i, Off(start.photos[i], is),
                Off(now, is), sigmas);
    right = right && sigmas < 2.0;  // About 1 expected, above 2 once in 1500.
  }
  return right ? 0 : 1;
}
