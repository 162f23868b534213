#include "circline/estimators/error_propagation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "circline/estimators/closed_form_errors.h"

namespace circline {
namespace {

using MeasuredInputs = std::vector<MeasuredInput>;
using Error = std::function<void(double part, MeasuredInputs* inputs)>;

bool AreFinite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

bool IsFinite(const ClosedFormPose& pose) {
  return pose.pose.rotation.allFinite() && pose.pose.translation.allFinite() &&
         AreFinite(pose.contradiction);
}

std::size_t SizeOf(InputKind kind) {
  switch (kind) {
    case InputKind::kPoint:
    case InputKind::kLine:
      return 3;
    case InputKind::kConic:
      return 6;
    case InputKind::kNumber:
      return 1;
  }
  return 0;
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

Measured WithColumns(const MeasuredInput& input) {
  const auto size = static_cast<Eigen::Index>(input.value.size());
  return Measured(Eigen::Map<const Eigen::VectorXd>(input.value.data(), size),
                  Eigen::Map<const Eigen::MatrixXd>(input.covariance.data(), size, size));
}

void SetValue(const Eigen::VectorXd& value, MeasuredInput* input) {
  input->value.assign(value.data(), value.data() + value.size());
}

// After the change of calibrated coordinates x' = A x.
void ChangeCoordinates(const Eigen::Matrix3d& A, MeasuredInput* input) {
  switch (input->kind) {
    case InputKind::kPoint:
      return SetValue(A * input->AsVector(), input);
    case InputKind::kLine:
      return SetValue(A.inverse().transpose() * input->AsVector(), input);
    case InputKind::kConic:
      return SetValue(ConicToVector(TransformConic(input->AsConic(), A.inverse())), input);
    case InputKind::kNumber:
      return;
  }
}

std::vector<Error> ErrorsOf(const MeasuredInputs& inputs, const Camera& camera,
                            const NoiseModel& noise) {
  std::vector<Error> errors;
  std::set<int> contrasts;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const Measured measured = WithColumns(inputs[i]);
    for (Eigen::Index k = 0; k < measured.columns.cols(); ++k) {
      const Eigen::VectorXd column = measured.columns.col(k);
      if (column.isZero(0.0)) continue;
      errors.push_back([i, column](double part, MeasuredInputs* moved) {
        MeasuredInput& input = (*moved)[i];
        Eigen::Map<Eigen::VectorXd>(input.value.data(), column.size()) += part * column;
      });
    }
    if (inputs[i].kind == InputKind::kConic) contrasts.insert(inputs[i].contrast);
  }
  for (const CoordinateChange& change : CameraErrors(noise.SigmaOf(camera), camera)) {
    errors.push_back([change](double part, MeasuredInputs* moved) {
      for (MeasuredInput& input : *moved) ChangeCoordinates(change(part), &input);
    });
  }
  const double offset = noise.contour_offset_px / std::sqrt(camera.fx * camera.fy);
  for (const int contrast : contrasts) {
    if (offset == 0.0) continue;
    errors.push_back([=](double part, MeasuredInputs* moved) {
      for (MeasuredInput& input : *moved) {
        if (input.kind != InputKind::kConic || input.contrast != contrast) continue;
        SetValue(ConicToVector(GrownEllipse(input.AsConic(), part * offset)), &input);
      }
    });
  }
  return errors;
}

Candidate ToCandidate(const ClosedFormPose& pose) {
  Candidate candidate;
  candidate.pose = pose.pose;
  candidate.contradiction = Eigen::Map<const Eigen::VectorXd>(
      pose.contradiction.data(), static_cast<Eigen::Index>(pose.contradiction.size()));
  return candidate;
}

// A closed form whose poses are looked at before they are used.
class CheckedClosedForm {
 public:
  explicit CheckedClosedForm(const ClosedForm& closed_form) : closed_form_(closed_form) {}

  std::vector<Candidate> operator()(const MeasuredInputs& inputs) {
    std::vector<Candidate> candidates;
    for (const ClosedFormPose& pose : closed_form_(inputs)) {
      const std::size_t size = pose.contradiction.size();
      is_even_ = is_even_ && size == num_contradictions_.value_or(size);
      num_contradictions_ = size;
      if (is_even_ && IsFinite(pose)) candidates.push_back(ToCandidate(pose));
    }
    return candidates;
  }
  // Whether every pose so far had as many contradictions.
  bool is_even() const { return is_even_; }

 private:
  const ClosedForm& closed_form_;
  std::optional<std::size_t> num_contradictions_;
  bool is_even_ = true;
};

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
  const std::vector<Error> errors = ErrorsOf(inputs, camera, noise_model);
  CheckedClosedForm checked(closed_form);
  const std::vector<Candidate> candidates = checked(inputs);
  const std::vector<Eigen::MatrixXd> sensitivities = Sensitivities(
      [&](std::size_t error, double part) {
        MeasuredInputs moved = inputs;
        errors[error](part, &moved);
        return checked(moved);
      },
      errors.size(), candidates);
  if (!checked.is_even())
    return Status::Invalid("the closed form's poses have not all as many contradictions");
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    PoseHypothesis h = UncertainPose(candidates[i], !unknown.scale, unknown.spin);
    FillUncertainty(sensitivities[i], candidates[i], &h);
    hypotheses->push_back(std::move(h));
  }
  RankHypotheses(hypotheses);
  return Status::Ok();
}

}  // namespace circline
