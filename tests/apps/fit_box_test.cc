// A box from the images of its edges.
#include "apps/reconstruct/fit_box.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include "apps/reconstruct/box_start.h"
#include "circline/estimators/random.h"
#include "tests/apps/painted_box.h"
#include "tests/basics.h"

namespace circline::apps {
namespace {

// All nine visible edges, 20 points each.
BoxObservation SeenEdges(const PaintedBox& box, double noise_px, Random* random) {
  BoxObservation seen;
  seen.id = "b";
  // Axis, and far along x, y, z.
  constexpr int kEdges[9][4] = {{0, 0, 0, 0}, {0, 0, 0, 1}, {0, 0, 1, 1},
                                {1, 0, 0, 0}, {1, 0, 0, 1}, {1, 1, 0, 1},
                                {2, 0, 0, 0}, {2, 1, 0, 0}, {2, 0, 1, 0}};
  for (const auto& e : kEdges) {
    BoxEdge edge;
    edge.axis = e[0];
    edge.far = {e[1] == 1, e[2] == 1, e[3] == 1};
    edge.sigma_px = std::max(noise_px, 1e-3);
    for (int i = 0; i < 20; ++i) {
      Eigen::Vector3d share(e[1], e[2], e[3]);
      share[edge.axis] = i / 19.0;
      edge.points.push_back(box.Corner(share.x(), share.y(), share.z()) + Noise2(noise_px, random));
    }
    seen.edges.push_back(std::move(edge));
  }
  return seen;
}

BoxOptions Exact() {
  BoxOptions options;
  options.noise = NoiseModel::Exact();
  options.camera = CameraSigma::Exact();
  return options;
}

TEST(FitBoxTest, FindsPoseAndLengthsFromEdgesAlone) {
  const PaintedBox box;
  Random random(1);
  BoxObservation seen = SeenEdges(box, 0.0, &random);
  BoxFit fit;
  Status status = FitBox(box.camera(), seen, Exact(), {}, &fit);
  ASSERT_TRUE(status.ok()) << status.message;
  EXPECT_FALSE(fit.metric);
  EXPECT_NEAR(fit.cam_from_box.translation.norm(), 1.0, 1e-9);
  const double scale = box.pose.translation.norm();
  EXPECT_LT((fit.length * scale - box.size).norm(), 1e-6);
  EXPECT_LT(RotationAngle(fit.cam_from_box.rotation, box.pose.rotation), 1e-6);

  seen.length = {0.0, box.size.y(), 0.0};
  status = FitBox(box.camera(), seen, Exact(), {}, &fit);
  ASSERT_TRUE(status.ok()) << status.message;
  EXPECT_TRUE(fit.metric);
  EXPECT_LT((fit.length - box.size).norm(), 1e-6);
  EXPECT_LT((fit.cam_from_box.translation - box.pose.translation).norm(), 1e-5);
}

// The corner and its three edges, marked left-handed: y and x exchanged.
TEST(FitBoxTest, TakesLeftHandedAxes) {
  const PaintedBox box;
  Random random(1);
  BoxObservation seen = SeenEdges(box, 0.0, &random);
  for (BoxEdge& edge : seen.edges) {
    std::swap(edge.far[0], edge.far[1]);
    if (edge.axis < 2) edge.axis = 1 - edge.axis;
  }
  seen.length = {0.0, 0.0, box.size.z()};
  BoxFit fit;
  const Status status = FitBox(box.camera(), seen, Exact(), {}, &fit);
  ASSERT_TRUE(status.ok()) << status.message;
  EXPECT_LT((fit.length - Eigen::Vector3d(box.size.y(), box.size.x(), box.size.z())).norm(), 1e-6);
}

// Of pose and lengths together, with and without a known edge, and with an unknown focal length:
// the mean squared error in the metric of the stated covariance.
void ExpectHonest(bool edge_known, bool focal_open) {
  const PaintedBox box;
  constexpr int kTrials = 60;
  const double unit = edge_known ? 1.0 : box.pose.translation.norm();
  // What is estimated of [delta, delta_t, length]: either the length of the translation or that of
  // the edge along x is given.
  Eigen::Matrix<double, 9, 8> open = Eigen::Matrix<double, 9, 8>::Zero();
  open.topLeftCorner<3, 3>().setIdentity();
  if (edge_known) {
    open.block<3, 3>(3, 3).setIdentity();
  } else {
    const Eigen::Vector3d ray = box.pose.translation.normalized();
    open.block<3, 1>(3, 3) = ray.unitOrthogonal();
    open.block<3, 1>(3, 4) = ray.cross(ray.unitOrthogonal());
    open(6, 5) = 1.0;
  }
  open.bottomRightCorner<2, 2>().setIdentity();
  Random random(7);
  double sum = 0.0;
  int within = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    BoxObservation seen = SeenEdges(box, 0.4, &random);
    if (edge_known) seen.length = {box.size.x(), 0.0, 0.0};
    BoxOptions options = Exact();
    Camera camera = box.camera();
    if (focal_open) {
      options.camera.log_focal = 0.05;
      const double off = std::exp(0.05 * random.Normal());
      camera.fx *= off;
      camera.fy *= off;
    }
    BoxFit fit;
    const Status status = FitBox(camera, seen, options, {}, &fit);
    ASSERT_TRUE(status.ok()) << status.message;
    EXPECT_EQ(fit.focal_sigma > 0.0, focal_open);
    EXPECT_EQ(fit.metric, edge_known);
    Eigen::Matrix<double, 9, 1> error;
    error << LogRotation(box.pose.rotation * fit.cam_from_box.rotation.transpose()),
        box.pose.translation / unit - fit.cam_from_box.translation, box.size / unit - fit.length;
    const Eigen::Matrix<double, 8, 1> off = open.transpose() * error;
    const Eigen::Matrix<double, 8, 8> covariance = open.transpose() * fit.covariance * open;
    sum += off.dot(covariance.ldlt().solve(off));
    for (int k = 6; k < 8; ++k) within += std::abs(off[k]) <= 3.0 * std::sqrt(covariance(k, k));
  }
  // Chi-square of 8 a trial: its mean has a standard deviation of 4 / sqrt(trials).
  EXPECT_NEAR(sum / kTrials, 8.0, 3.5 * 4.0 / std::sqrt(kTrials)) << edge_known << focal_open;
  EXPECT_GE(within, static_cast<int>(0.95 * 2 * kTrials)) << edge_known << focal_open;
}

TEST(FitBoxTest, CovarianceIsHonest) {
  for (const bool edge_known : {false, true}) {
    for (const bool focal_open : {false, true}) ExpectHonest(edge_known, focal_open);
  }
}

TEST(FitBoxTest, LeavesOutAnEdgeThatContradicts) {
  const PaintedBox box;
  Random random(1);
  BoxObservation seen = SeenEdges(box, 0.1, &random);
  for (Eigen::Vector2d& point : seen.edges[2].points) point += Eigen::Vector2d(10.0, 25.0);
  seen.length = {box.size.x(), 0.0, 0.0};
  BoxFit fit;
  const Status status = FitBox(box.camera(), seen, BoxOptions(), {}, &fit);
  ASSERT_TRUE(status.ok()) << status.message;
  ASSERT_EQ(fit.notes.size(), 1U);
  EXPECT_EQ(fit.notes[0], "an edge along x contradicts the others and is left out");
  EXPECT_LT((fit.length - box.size).norm(), 0.01);
}

// A lens of which the fitted distortion turns back at 1.1 focal lengths from the centre.
TEST(FitBoxTest, LeavesOutAnEdgeThatTheLensCannotShow) {
  const PaintedBox box;
  Random random(1);
  BoxObservation seen = SeenEdges(box, 0.0, &random);
  Camera camera = box.camera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion = {-0.28, 0.0, 0.0, 0.0, 0.0};
  for (BoxEdge& edge : seen.edges) {
    for (Eigen::Vector2d& point : edge.points) {
      CalibratedPoint undistorted;
      ASSERT_TRUE(PixelToCalibrated(box.camera(), point, &undistorted));
      ASSERT_TRUE(CameraToPixel(camera, undistorted.Homogeneous(), &point));
    }
  }
  for (Eigen::Vector2d& point : seen.edges[2].points) point += Eigen::Vector2d(1e4, 0.0);
  BoxFit fit;
  const Status status = FitBox(camera, seen, Exact(), {}, &fit);
  ASSERT_TRUE(status.ok()) << status.message;
  ASSERT_EQ(fit.notes.size(), 1U);
  EXPECT_EQ(fit.notes[0], "an edge along x lies where the lens shows nothing and is left out");
  EXPECT_LT((fit.length * box.pose.translation.norm() - box.size).norm(), 1e-6);
  EXPECT_TRUE(std::isfinite(fit.rms_px));
}

TEST(BoxStartTest, FindsAxesOfThreePlanes) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const auto some = [&random] { return Noise3(1.0, &random); };
    const Eigen::Matrix3d truth =
        Eigen::Quaterniond{random.Normal(), random.Normal(), random.Normal(), random.Normal()}
            .normalized()
            .toRotationMatrix();
    std::array<Eigen::Vector3d, 3> normals;
    for (std::size_t k = 0; k < 3; ++k)
      normals[k] = truth.col(static_cast<Eigen::Index>(k)).cross(some()).normalized();
    const std::vector<Eigen::Matrix3d> found = OrthogonalAxes(normals);
    ASSERT_FALSE(found.empty());
    double nearest = 0.0;
    for (const Eigen::Matrix3d& axes : found) {
      EXPECT_NEAR(axes.determinant(), 1.0, 1e-12);
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(axes.col(static_cast<Eigen::Index>(k)).dot(normals[k]), 0.0, 1e-6);
      nearest = std::max(nearest, (axes.transpose() * truth).diagonal().cwiseAbs().minCoeff());
    }
    EXPECT_NEAR(nearest, 1.0, 1e-9) << trial;
  }
}

TEST(FitBoxTest, SaysWhatIsMissing) {
  const PaintedBox box;
  Random random(1);
  const BoxObservation seen = SeenEdges(box, 0.0, &random);
  const auto refused = [&](const std::vector<std::size_t>& edges) {
    BoxObservation some = seen;
    some.edges.clear();
    for (const std::size_t e : edges) some.edges.push_back(seen.edges[e]);
    BoxFit fit;
    const Status status = FitBox(box.camera(), some, Exact(), {}, &fit);
    EXPECT_EQ(status.code, StatusCode::kRefused);
    return status.message;
  };
  EXPECT_EQ(refused({0, 1, 2, 3, 5}), "the box 'b': no edge along z is seen");
  EXPECT_EQ(refused({0, 3, 6}),
            "the box 'b': edges at one end only of its length along x are "
            "seen, which leaves that open");
  // No three directions at right angles look like this from before the camera.
  BoxObservation bent = seen;
  for (BoxEdge& edge : bent.edges) {
    for (Eigen::Vector2d& point : edge.points)
      point = Eigen::Vector2d(100.0 + 3.0 * edge.axis, 0.0) + 1e-3 * point;
  }
  BoxFit fit;
  EXPECT_EQ(FitBox(box.camera(), bent, Exact(), {}, &fit).code, StatusCode::kRefused);
}

}  // namespace
}  // namespace circline::apps
