#include "circline/estimators/error_propagation.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "tests/basics.h"

namespace circline {
namespace {

Camera TestCamera() {
  Camera camera;
  camera.fx = camera.fy = 500.0;
  return camera;
}

// A translation that is measured as it is, and two numbers: what contradicts the first pose and
// what contradicts the second.
std::vector<MeasuredInput> Inputs() {
  Eigen::Matrix3d covariance;
  covariance << 0.04, 0.01, 0.0, 0.01, 0.09, 0.02, 0.0, 0.02, 0.16;
  return {MeasuredInput::Point({0.1, 0.2, 5.0}, covariance), MeasuredInput::Number(6.0, 2.0),
          MeasuredInput::Number(0.0, 2.0)};
}

std::vector<ClosedFormPose> TwoPoses(const std::vector<MeasuredInput>& inputs) {
  std::vector<ClosedFormPose> poses(2);
  for (std::size_t i = 0; i < 2; ++i) {
    poses[i].pose.translation = inputs[0].AsVector();
    poses[i].contradiction = {inputs[i + 1].value[0]};
  }
  return poses;
}

Status Propagate(const ClosedForm& closed_form, const std::vector<MeasuredInput>& inputs,
                 std::vector<PoseHypothesis>* hypotheses) {
  UnknownOfPose unknown;
  unknown.scale = false;
  return PropagateErrors(closed_form, inputs, TestCamera(), NoiseModel::Exact(), unknown,
                         hypotheses);
}

std::string ErrorOf(const ClosedForm& closed_form, const std::vector<MeasuredInput>& inputs) {
  std::vector<PoseHypothesis> hypotheses(3);
  const Status status = Propagate(closed_form, inputs, &hypotheses);
  EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
  EXPECT_TRUE(hypotheses.empty());
  return status.message;
}

TEST(ErrorPropagation, CovarianceIsThatOfTheInputsAndContradictionsRank) {
  const std::vector<MeasuredInput> inputs = Inputs();
  std::vector<PoseHypothesis> hypotheses;
  ASSERT_TRUE(Propagate(TwoPoses, inputs, &hypotheses).ok());
  ASSERT_EQ(hypotheses.size(), 2U);
  const Eigen::Map<const Eigen::Matrix3d> given(inputs[0].covariance.data());
  for (const PoseHypothesis& h : hypotheses) {
    const Matrix6d covariance = h.Covariance();
    EXPECT_LT((covariance.bottomRightCorner<3, 3>() - given).norm(), 1e-12);
    EXPECT_LT(covariance.topRows<3>().norm(), 1e-12);
  }
  EXPECT_NEAR(hypotheses[0].cost, 0.0, 1e-12);  // The second pose, which nothing contradicts.
  EXPECT_NEAR(hypotheses[1].cost, 4.5, 1e-9);   // Three standard deviations.
  EXPECT_GT(hypotheses[0].probability, 0.98);
}

TEST(ErrorPropagation, InputsOfAWrongSizeAreNamed) {
  std::vector<MeasuredInput> inputs = Inputs();
  inputs[1].kind = InputKind::kConic;
  EXPECT_EQ(ErrorOf(TwoPoses, inputs),
            "inputs[1] must have 6 values and a covariance of 36, not 1 and 1");
  inputs = Inputs();
  inputs[0].value.pop_back();
  EXPECT_EQ(ErrorOf(TwoPoses, inputs),
            "inputs[0] must have 3 values and a covariance of 9, not 2 and 9");
  inputs = Inputs();
  inputs[2].covariance.clear();
  EXPECT_EQ(ErrorOf(TwoPoses, inputs),
            "inputs[2] must have 1 values and a covariance of 1, not 1 and 0");
  inputs = Inputs();
  inputs[2].value[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ErrorOf(TwoPoses, inputs), "inputs[2] is not finite");
}

TEST(ErrorPropagation, PosesThatAreNotFiniteDoNotCount) {
  std::vector<PoseHypothesis> hypotheses;
  const auto spoilt = [](const std::vector<MeasuredInput>& inputs) {
    std::vector<ClosedFormPose> poses = TwoPoses(inputs);
    poses[1].pose.rotation(0, 0) = std::numeric_limits<double>::quiet_NaN();
    return poses;
  };
  ASSERT_TRUE(Propagate(spoilt, Inputs(), &hypotheses).ok());
  ASSERT_EQ(hypotheses.size(), 1U);
  EXPECT_NEAR(hypotheses[0].cost, 4.5, 1e-9);
  const auto none = [](const std::vector<MeasuredInput>&) { return std::vector<ClosedFormPose>(); };
  ASSERT_TRUE(Propagate(none, Inputs(), &hypotheses).ok());
  EXPECT_TRUE(hypotheses.empty());
}

// A contour that is less regular than the noise model says has a worse known shape.
TEST(ErrorPropagation, ConicsKeepTheIrregularityOfTheirFits) {
  ConicFit fit;
  fit.conic = Eigen::Vector3d(1.0, 4.0, -0.04).asDiagonal();
  NoiseModel noise = NoiseModel::Exact();
  noise.circle_shape = 1e-3;
  UnknownOfPose unknown;
  unknown.scale = false;
  // The conic's numbers for a place: whatever follows them has their covariance.
  const auto numbers = [](const std::vector<MeasuredInput>& inputs) {
    const Eigen::Matrix3d conic = inputs[0].AsConic();
    ClosedFormPose pose;
    pose.pose.translation = Eigen::Vector3d(conic(0, 0), conic(1, 1), 5.0);
    return std::vector<ClosedFormPose>{pose};
  };
  double variances[2] = {};
  for (const double irregularity : {1.0, 3.0}) {
    fit.irregularity = irregularity;
    std::vector<PoseHypothesis> hypotheses;
    ASSERT_TRUE(PropagateErrors(numbers, {MeasuredInput::Conic(fit)}, TestCamera(), noise, unknown,
                                &hypotheses)
                    .ok());
    variances[irregularity > 1.0 ? 1 : 0] = hypotheses.at(0).Covariance().trace();
  }
  EXPECT_GT(variances[0], 0.0);
  EXPECT_NEAR(variances[1] / variances[0], 9.0, 0.01);
}

// Also where that happens only for inputs that are moved by an error.
TEST(ErrorPropagation, PosesMustHaveAsManyContradictionsEach) {
  for (const double above : {-1.0, 5.5, 7.0}) {
    const auto uneven = [above](const std::vector<MeasuredInput>& inputs) {
      std::vector<ClosedFormPose> poses = TwoPoses(inputs);
      if (inputs[1].value[0] > above) poses[1].contradiction.push_back(0.0);
      return poses;
    };
    EXPECT_CONTAINS(ErrorOf(uneven, Inputs()), "contradictions") << above;
  }
}

}  // namespace
}  // namespace circline
