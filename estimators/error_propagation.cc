#include "circline/estimators/error_propagation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "circline/estimators/closed_form_errors.h"

namespace circline {
namespace {

using MeasuredInputs = std::vector<MeasuredInput>;

bool AreFinite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

bool IsFinite(const ClosedFormPose& pose) {
  return pose.pose.rotation.allFinite() && pose.pose.translation.allFinite() &&
         AreFinite(pose.contradiction);
}

std::size_t SizeOf(InputKind kind) {
  constexpr std::size_t kSizes[] = {3, 3, 6, 1};  // In the order of InputKind.
  return kSizes[static_cast<std::size_t>(kind)];
}

Status CheckInputs(const MeasuredInputs& inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const std::string name = "inputs[" + std::to_string(i) + "]";
    const std::size_t size = SizeOf(inputs[i].kind);
    if (inputs[i].value.size() != size || inputs[i].covariance.size() != size * size) {
      return Status::Invalid(name + " must have " + std::to_string(size) +
                             " values and a covariance of " + std::to_string(size * size) +
                             ", not " + std::to_string(inputs[i].value.size()) + " and " +
                             std::to_string(inputs[i].covariance.size()));
    }
    if (!AreFinite(inputs[i].value) || !AreFinite(inputs[i].covariance))
      return Status::Invalid(name + " is not finite");
  }
  return Status::Ok();
}

template <typename Vector, typename Matrix>
MeasuredInput Input(InputKind kind, const Vector& value, const Matrix& covariance) {
  MeasuredInput input;
  input.kind = kind;
  input.value.assign(value.data(), value.data() + value.size());
  // Symmetric: rows are columns.
  input.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  return input;
}

std::vector<MovedInput> MovedOf(MeasuredInputs* inputs) {
  std::vector<MovedInput> moved;
  for (MeasuredInput& input : *inputs)
    moved.push_back({input.kind, input.value.data(), {}, input.contrast, input.irregularity});
  return moved;
}

std::vector<Perturbation> ErrorsOf(MeasuredInputs inputs, const Camera& camera,
                                   const NoiseModel& noise) {
  std::vector<MovedInput> moved = MovedOf(&inputs);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const auto size = static_cast<Eigen::Index>(inputs[i].value.size());
    moved[i].columns =
        Measured(Eigen::Map<const Eigen::VectorXd>(inputs[i].value.data(), size),
                 Eigen::Map<const Eigen::MatrixXd>(inputs[i].covariance.data(), size, size))
            .columns;
  }
  return Perturbations(moved, noise, camera);
}

Candidate ToCandidate(const ClosedFormPose& pose) {
  Candidate candidate;
  candidate.pose = pose.pose;
  candidate.contradiction = Eigen::Map<const Eigen::VectorXd>(
      pose.contradiction.data(), static_cast<Eigen::Index>(pose.contradiction.size()));
  return candidate;
}

}  // namespace

MeasuredInput MeasuredInput::Point(const Eigen::Vector3d& point,
                                   const Eigen::Matrix3d& covariance) {
  return Input(InputKind::kPoint, point, covariance);
}
MeasuredInput MeasuredInput::Direction(const VanishingPointFit& fit) {
  return Input(InputKind::kPoint, fit.direction, fit.covariance);
}
MeasuredInput MeasuredInput::Line(const LineFit& fit) {
  return Input(InputKind::kLine, fit.line, fit.covariance);
}
MeasuredInput MeasuredInput::Conic(const ConicFit& fit, int contrast) {
  MeasuredInput input = Input(InputKind::kConic, ConicToVector(fit.conic), fit.Covariance());
  input.contrast = contrast;
  input.irregularity = fit.irregularity;
  return input;
}
MeasuredInput MeasuredInput::Number(double value, double sigma) {
  MeasuredInput input;
  input.value = {value};
  input.covariance = {sigma * sigma};
  return input;
}

Eigen::Matrix3d MeasuredInput::AsConic() const {
  return VectorToConic(Eigen::Map<const Vector6d>(value.data()));
}

Status PropagateErrors(const ClosedForm& closed_form, const std::vector<MeasuredInput>& inputs,
                       const Camera& camera, const NoiseModel& noise_model,
                       const UnknownOfPose& unknown, std::vector<PoseHypothesis>* hypotheses) {
  hypotheses->clear();
  Status status = CheckInputs(inputs);
  if (status.ok()) status = camera.Validate();
  if (status.ok()) status = noise_model.Validate();
  if (!status.ok()) return status;
  const std::vector<Perturbation> errors = ErrorsOf(inputs, camera, noise_model);
  std::optional<std::size_t> num_contradictions;
  bool all_have_as_many = true;
  const auto evaluate = [&](const MeasuredInputs& moved) {
    std::vector<Candidate> candidates;
    for (const ClosedFormPose& pose : closed_form(moved)) {
      if (!num_contradictions) num_contradictions = pose.contradiction.size();
      const bool as_many = pose.contradiction.size() == *num_contradictions;
      if (as_many && IsFinite(pose)) candidates.push_back(ToCandidate(pose));
      all_have_as_many = all_have_as_many && as_many;
    }
    return candidates;
  };
  const auto perturbed = [&](std::size_t error, double part) {
    MeasuredInputs moved = inputs;
    errors[error](part, MovedOf(&moved));
    return evaluate(moved);
  };
  *hypotheses =
      WithUncertainty(evaluate(inputs), perturbed, errors.size(), !unknown.scale, unknown.spin);
  if (!all_have_as_many) {
    hypotheses->clear();
    return Status::Invalid("the closed form's poses have not all as many contradictions");
  }
  RankHypotheses(hypotheses);
  return Status::Ok();
}

}  // namespace circline
