#include "circline/ransac/line_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/estimators/line_moments.h"
#include "circline/ransac/inlier_weights.h"

namespace circline {

LineModel::LineModel(const std::vector<CalibratedPoint>& points)
    : index_(RandomOrder(static_cast<int>(points.size()), 1)) {
  const std::size_t n = points.size();
  if (n == 0) return;
  Eigen::AlignedBox2d box;
  for (const CalibratedPoint& p : points) box.extend(p.x);
  center_ = box.center();
  scale_ = std::max(0.5 * box.diagonal().norm(), 1e-12);
  data_.resize(6 * n);
  x_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const CalibratedPoint& p = points[static_cast<std::size_t>(index_[i])];
    x_[i] = (p.x - center_) / scale_;
    data_[i] = static_cast<float>(x_[i].x());
    data_[n + i] = static_cast<float>(x_[i].y());
    for (std::size_t k = 0; k < 4; ++k) {
      data_[(2 + k) * n + i] = static_cast<float>(p.x_from_pixel[k] / scale_);
    }
  }
}

Eigen::Vector3d LineModel::ToLine(const Value& value) const {
  const auto [a, b, c] = value;
  return Eigen::Vector3d(a, b, scale_ * c - a * center_.x() - b * center_.y()).normalized();
}

bool LineModel::Fit(const int* sample, Value* value) const {
  const Eigen::Vector2d& p = x_[static_cast<std::size_t>(sample[0])];
  const Eigen::Vector2d d = x_[static_cast<std::size_t>(sample[1])] - p;
  const double length = d.norm();
  if (!(length > 1e-9)) return false;
  const double a = -d.y() / length, b = d.x() / length;
  *value = {a, b, -(a * p.x() + b * p.y())};
  return true;
}

void LineModel::SquaredResiduals(const Value& value, int begin, int end, float* r2) const {
  const std::size_t n = index_.size();
  const float* x = data_.data() + begin;
  const float a = static_cast<float>(value[0]), b = static_cast<float>(value[1]),
              c = static_cast<float>(value[2]);
  const std::size_t size = static_cast<std::size_t>(end - begin);
  for (std::size_t i = 0; i < size; ++i) {
    const float miss = a * x[i] + b * x[i + n] + c;
    const float gu = x[i + 2 * n] * a + x[i + 4 * n] * b;
    const float gv = x[i + 3 * n] * a + x[i + 5 * n] * b;
    r2[i] = miss * miss / (gu * gu + gv * gv);
  }
}

bool LineModel::Refine(const float* weights, Value* value) const {
  // Total least squares, each point with its pixel's size at the current line.
  const std::size_t n = index_.size();
  const double a = (*value)[0], b = (*value)[1];
  LineMoments moments;
  for (std::size_t i = 0; i < n; ++i) {
    if (!(weights[i] > 0.0f)) continue;
    const float* d = data_.data() + i;
    const double gu = static_cast<double>(d[2 * n]) * a + static_cast<double>(d[4 * n]) * b;
    const double gv = static_cast<double>(d[3 * n]) * a + static_cast<double>(d[5 * n]) * b;
    moments.Add(x_[i], static_cast<double>(weights[i]) / (gu * gu + gv * gv));
  }
  if (!moments.SpreadBeyond(1e-9)) return false;
  Eigen::Map<Eigen::Vector3d>(value->data()) = moments.Line();
  return true;
}

namespace {

// Reweighted steps from the engine's line, then maximum likelihood with the last weights.
Status FitFinal(const std::vector<CalibratedPoint>& points, const LineModel& model,
                const RobustFitOptions& options, LineModel::Value value, LineFit* fit,
                std::vector<std::uint8_t>* mask) {
  const double threshold = options.ransac.threshold;
  std::vector<float> squares(points.size());
  std::vector<double> residuals(points.size()), weights, chosen_weights;
  double sigma = 0.0;
  constexpr int kPasses = 3;
  for (int pass = 0; pass < kPasses; ++pass) {
    model.SquaredResiduals(value, 0, model.NumData(), squares.data());
    for (std::size_t i = 0; i < points.size(); ++i)
      residuals[i] = std::sqrt(static_cast<double>(squares[i]));
    InlierWeights(residuals, threshold, 2, &sigma, &weights);
    const std::vector<float> steps(weights.begin(), weights.end());
    if (pass + 1 < kPasses && !model.Refine(steps.data(), &value)) break;
  }
  std::vector<CalibratedPoint> chosen;
  for (int i = 0; i < model.NumData(); ++i) {
    const double w = weights[static_cast<std::size_t>(i)];
    if (w < 1e-3) continue;
    chosen.push_back(points[static_cast<std::size_t>(model.PointIndex(i))]);
    chosen_weights.push_back(w);
  }
  const Status status = FitLine(chosen, options.sigma_px, fit, &chosen_weights);
  if (!status.ok()) return status;
  mask->assign(points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    residuals[i] = LineDistancePx(points[i], fit->line);
    (*mask)[i] = std::abs(residuals[i]) <= threshold ? 1 : 0;
  }
  fit->rms_px = InlierRms(residuals, threshold);
  return Status::Ok();
}

}  // namespace

Status FitLineRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                     LineFit* fit, std::vector<std::uint8_t>* mask) {
  Status status = options.Validate();
  if (!status.ok()) return status;
  if (points.size() < 2) return Status::Refused("a line needs two points");
  LineFit result;
  std::vector<std::uint8_t> result_mask(points.size(), 1);
  if (points.size() == 2) {
    status = FitLine(points, options.sigma_px, &result);
  } else {
    const LineModel model(points);
    Ransac<LineModel> engine(options.ransac);
    RansacReport<LineModel::Value> report;
    engine.Run(model, &report);
    if (!report.success) return Status::Refused("the points of the line coincide");
    status = FitFinal(points, model, options, report.model, &result, &result_mask);
  }
  if (!status.ok()) return status;
  *fit = result;
  if (mask != nullptr) *mask = std::move(result_mask);
  return Status::Ok();
}

}  // namespace circline
