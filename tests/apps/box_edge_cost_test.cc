#include "apps/reconstruct/box_edge_cost.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <vector>

#include "tests/refine/cost_function_checks.h"

namespace circline::apps {
namespace {

using cost_function_checks::Blocks;
using cost_function_checks::CostOf;
using cost_function_checks::ExpectGradientByDifferences;
using cost_function_checks::kRotation;
using cost_function_checks::kTranslation;
using cost_function_checks::LensCamera;

// Every corner of the box, all three axes, leaning and not.
TEST(BoxEdgeCost, HasTheGradientOfItsCost) {
  const Eigen::Vector3d size(1.2, 0.7, 0.9), skew(0.01, -0.02, 0.015);
  Eigen::Matrix3d strained;
  strained << 1.0, 0.5 * skew.z(), 0.5 * skew.y(), 0.5 * skew.z(), 1.0, 0.5 * skew.x(),
      0.5 * skew.y(), 0.5 * skew.x(), 1.0;
  for (int edge = 0; edge < 12; ++edge) {
    const int axis = edge % 3;
    const std::array<bool, 3> far = {edge / 3 % 2 == 1, (edge / 3 + axis) / 2 % 2 == 1,
                                     (edge / 3 + axis) % 2 == 1};
    Eigen::Vector3d corner;
    for (int k = 0; k < 3; ++k) corner[k] = far[static_cast<std::size_t>(k)] ? size[k] : 0.0;
    std::vector<Eigen::Vector2d> pixels;
    for (int i = 0; i < 20; ++i) {
      Eigen::Vector3d X = corner;
      X[axis] = 0.05 * i;
      Eigen::Vector2d pixel;
      ASSERT_TRUE(CameraToPixel(LensCamera(), kRotation * (strained * X) + kTranslation, &pixel));
      pixels.push_back(pixel);
    }
    Blocks truth;
    truth.AddPose(Eigen::Vector3d::Zero());
    truth.values[1][1] = kTranslation.y();
    for (int k = 0; k < 3; ++k) truth.Add({size[k]});
    truth.Add({skew.x(), skew.y(), skew.z()});
    const BoxEdgeCost exact(ImagePoints(LensCamera(), pixels, {}, {}), axis, far);
    EXPECT_LT(CostOf(exact, truth), 1e-12) << "edge " << edge;

    Blocks off;
    off.AddPose();
    for (int k = 0; k < 3; ++k) off.Add({1.01 * size[k]});
    off.Add({0.0, 0.0, 0.0});
    off.Add(std::vector<double>(kCameraSize, 0.001));
    ImagePoints::Options options;
    options.loss = LossType::kCauchy;
    const BoxEdgeCost cost(ImagePoints(LensCamera(), pixels, {}, options), axis, far, true);
    ExpectGradientByDifferences(cost, off, 12, 17);
  }
}

}  // namespace
}  // namespace circline::apps
