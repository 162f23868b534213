#include "apps/simulate/simulate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "apps/common/in_parallel.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/closed_form_solvers.h"
#include "circline/ransac/fit_observations.h"
#include "circline/refine/refined_solvers.h"

namespace circline::apps {
namespace {

constexpr double kFailureBounds = 10.0;    // A larger rotation error, in bounds, is a failure.
constexpr double kFailureExactRad = 1e-6;  // The same without noise.
constexpr double kMaxOutlierRatio = 0.8;
constexpr double kMinThresholdPx = 0.01;

// One method on one image.
struct Outcome {
  bool failed = true;
  double axis_rad = 0.0, angle_rad = 0.0, rotation_rad = 0.0, nees = 0.0;
};

struct Trial {
  std::vector<Outcome> outcomes;  // By method.
  std::array<Eigen::Matrix3d, kNumEvidences> bounds;
};

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// A seed of its own for each trial.
std::uint64_t TrialSeed(std::uint64_t seed, std::size_t noise, std::size_t ratio,
                        std::size_t trial) {
  for (const std::uint64_t index : {noise, ratio, trial})
    seed = Random(Random(seed).Next() + index).Next();
  return seed;
}

Outcome Judge(const PoseEstimate& estimate, const Eigen::Matrix3d& truth,
              const Eigen::Matrix3d& bound) {
  Outcome outcome;
  if (!estimate.status.ok()) return outcome;
  const PoseHypothesis& best = estimate.hypotheses.front();
  const Eigen::Matrix3d& R = best.cam_from_world.rotation;
  const Eigen::Vector3d error = LogRotation(truth * R.transpose());
  const Eigen::Vector3d true_vector = LogRotation(truth), vector = LogRotation(R);
  outcome.rotation_rad = error.norm();
  outcome.axis_rad = AngleBetween(true_vector, vector);
  outcome.angle_rad = std::abs(true_vector.norm() - vector.norm());
  const Eigen::Matrix3d covariance = best.Covariance().topLeftCorner<3, 3>();
  outcome.nees = error.dot(covariance.inverse() * error);
  const double limit = std::max(kFailureBounds * std::sqrt(bound.trace()), kFailureExactRad);
  outcome.failed = best.RotationIsFree() || !(outcome.rotation_rad <= limit);
  return outcome;
}

// The solvers for images of one outlier ratio.
class Solvers {
 public:
  explicit Solvers(LossType loss) {
    EstimationOptions estimation;
    estimation.conic_loss.type = estimation.line_loss.type = loss;
    ClosedFormOptions closed_form;
    estimation.noise_model = closed_form.noise_model = NoiseModel::Exact();
    AddClosedFormSolvers(&registry_, closed_form);
    AddRefinedSolvers(&registry_, estimation);
  }
  const Solver& Get(const Method& method) const {
    return *registry_.Find(method.solver, method.stage);
  }

 private:
  SolverRegistry registry_;
};

Trial RunTrial(const PaperScene& scene, const Disturbance& disturbance, const Solvers& solvers,
               double inlier_sigmas, std::uint64_t seed) {
  Random random(seed);
  InlierMasks masks;
  Observations observations = scene.Observe(disturbance, &random, &masks);
  if (disturbance.outlier_ratio > 0.0) {
    FitOptions fit;
    fit.noise_model = NoiseModel::Exact();
    fit.inlier_threshold_px = std::max(inlier_sigmas * disturbance.noise_px, kMinThresholdPx);
    fit.seed = random.Next();
    FitObservations(fit, &observations);
  } else {
    FitDirect(observations.circles.front().sigma_px, &observations);
  }
  Trial trial;
  const double variance = disturbance.noise_px * disturbance.noise_px;
  for (std::size_t e = 0; e < kNumEvidences; ++e) {
    trial.bounds[e] = variance * scene.BoundCovariance(static_cast<Evidence>(e), masks);
  }
  for (const Method& method : Methods()) {
    const PoseEstimate estimate = solvers.Get(method).Solve(observations);
    trial.outcomes.push_back(Judge(estimate, scene.pose().rotation,
                                   trial.bounds[static_cast<std::size_t>(method.evidence)]));
  }
  return trial;
}

// Mean and standard deviation of a sample, NaN of nothing.
struct Spread {
  explicit Spread(const std::vector<double>& values) {
    if (values.empty()) mean = std = std::numeric_limits<double>::quiet_NaN();
    const double n = static_cast<double>(values.size());
    for (const double v : values) mean += v / n;
    for (const double v : values) std += (v - mean) * (v - mean) / n;
    std = std::sqrt(std);
  }
  double mean = 0.0, std = 0.0;
};

// Errors of axis and angle that a Gaussian rotation error of this covariance makes, to first order.
void FillBoundSpread(const Eigen::Matrix3d& covariance, const Eigen::Matrix3d& truth,
                     SimulationRow* row) {
  const Eigen::Vector3d vector = LogRotation(truth);
  const double angle = vector.norm();
  const Eigen::Vector3d axis = vector / angle;
  // The angle's error is one Gaussian, its absolute value half of it.
  const double sigma = std::sqrt(axis.dot(covariance * axis));
  row->bound_angle_mean_rad = sigma * std::sqrt(2.0 / kPi);
  row->bound_angle_std_rad = sigma * std::sqrt(1.0 - 2.0 / kPi);
  // The axis moves across itself, in two dimensions: Rodrigues' inverse left Jacobian.
  const Eigen::Matrix3d K = CrossMatrix(vector);
  const double half = 0.5 * angle;
  const double c = (1.0 - half / std::tan(half)) / (angle * angle);
  const Eigen::Matrix3d across = (Eigen::Matrix3d::Identity() - axis * axis.transpose()) *
                                 (Eigen::Matrix3d::Identity() - 0.5 * K + c * K * K) / angle;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
      across * covariance * across.transpose(), Eigen::EigenvaluesOnly);
  const double a = std::max(0.0, eigen.eigenvalues()[2]), b = std::max(0.0, eigen.eigenvalues()[1]);
  // The mean length of a Gaussian vector: over directions, then over radii.
  constexpr int kSteps = 64;
  double mean = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double direction = kPi * (i + 0.5) / kSteps;
    mean += std::hypot(std::sqrt(a) * std::cos(direction), std::sqrt(b) * std::sin(direction));
  }
  row->bound_axis_mean_rad = std::sqrt(0.5 * kPi) * mean / kSteps;
  row->bound_axis_std_rad =
      std::sqrt(std::max(0.0, a + b - row->bound_axis_mean_rad * row->bound_axis_mean_rad));
}

SimulationRow Summarize(const std::vector<Trial>& trials, std::size_t method_index,
                        const Disturbance& disturbance, const Eigen::Matrix3d& truth) {
  SimulationRow row;
  row.noise_px = disturbance.noise_px;
  row.outlier_ratio = disturbance.outlier_ratio;
  row.method = &Methods()[method_index];
  row.trials = static_cast<int>(trials.size());
  std::vector<double> axis, angle, squares, nees;
  Eigen::Matrix3d bound = Eigen::Matrix3d::Zero();
  for (const Trial& trial : trials) {
    bound += trial.bounds[static_cast<std::size_t>(row.method->evidence)];
    const Outcome& outcome = trial.outcomes[method_index];
    if (outcome.failed) {
      ++row.failures;
      continue;
    }
    axis.push_back(outcome.axis_rad);
    angle.push_back(outcome.angle_rad);
    squares.push_back(outcome.rotation_rad * outcome.rotation_rad);
    nees.push_back(outcome.nees);
  }
  bound /= static_cast<double>(trials.size());
  row.axis_mean_rad = Spread(axis).mean;
  row.axis_std_rad = Spread(axis).std;
  row.angle_mean_rad = Spread(angle).mean;
  row.angle_std_rad = Spread(angle).std;
  row.rotation_rms_rad = std::sqrt(Spread(squares).mean);
  row.nees_mean = row.noise_px > 0.0 ? Spread(nees).mean : std::numeric_limits<double>::quiet_NaN();
  row.bound_rms_rad = std::sqrt(bound.trace());
  FillBoundSpread(bound, truth, &row);
  return row;
}

// Empty where there is nothing to say.
std::string Number(double value) { return std::isfinite(value) ? FormatPlain(value, 9) : ""; }

}  // namespace

Status SimulationOptions::Validate() const {
  if (trials < 1) return Status::Invalid("trials must be 1 or more");
  if (noise_px.empty()) return Status::Invalid("noise_px has no value");
  if (outlier_ratios.empty()) return Status::Invalid("outlier_ratio has no value");
  for (const double noise : noise_px) {
    if (!(noise >= 0.0) || !std::isfinite(noise))
      return Status::Invalid("noise_px must be 0 or more");
  }
  for (const double ratio : outlier_ratios) {
    if (!(ratio >= 0.0 && ratio <= kMaxOutlierRatio))
      return Status::Invalid("outlier_ratio must be between 0 and " +
                             FormatShort(kMaxOutlierRatio));
  }
  if (!(focal_px > 0.0) || !std::isfinite(focal_px))
    return Status::Invalid("focal must be positive");
  if (!(inlier_sigmas > 0.0) || !std::isfinite(inlier_sigmas))
    return Status::Invalid("inlier_sigmas must be positive");
  if (focal_sigma != 0.0 && !(focal_sigma >= 0.1 && focal_sigma <= 1.0))
    return Status::Invalid("focal_sigma must be 0, or between 0.1 and 1");
  if (threads < 0 || threads > 1024) return Status::Invalid("threads must be between 0 and 1024");
  const Status status = PaperScene(focal_px, translation).Validate();
  return status.ok() ? status : Status::Invalid("translation: " + status.message);
}

const std::vector<Method>& Methods() {
  static const auto* const kMethods = new std::vector<Method>{
      {"circle_frame", "circle_frame", SolverStage::kClosedForm, Evidence::kCircleFrame},
      {"line_pairs", "line_pairs", SolverStage::kClosedForm, Evidence::kLinePairs},
      {"circle_frame_refined", "circle_frame", SolverStage::kRefined, Evidence::kCircleFrame},
      {"line_pairs_refined", "line_pairs", SolverStage::kRefined, Evidence::kLinePairs},
      {"joint", "joint", SolverStage::kRefined, Evidence::kJoint}};
  return *kMethods;
}

std::vector<SimulationRow> Simulate(const SimulationOptions& options) {
  UseThreads(options.threads);
  const PaperScene scene(options.focal_px, options.translation);
  const Solvers clean(options.loss), robust(options.outlier_loss);
  const std::size_t num_cells = options.noise_px.size() * options.outlier_ratios.size();
  Progress progress("images", static_cast<int>(num_cells) * options.trials);
  std::vector<SimulationRow> rows;
  for (std::size_t i = 0; i < options.noise_px.size(); ++i) {
    for (std::size_t j = 0; j < options.outlier_ratios.size(); ++j) {
      const Disturbance disturbance{options.noise_px[i], options.outlier_ratios[j],
                                    options.outlier_kind};
      const Solvers& solvers = disturbance.outlier_ratio > 0.0 ? robust : clean;
      std::vector<Trial> trials(static_cast<std::size_t>(options.trials));
      InParallel(trials.size(), [&](std::size_t k) {
        trials[k] = RunTrial(scene, disturbance, solvers, options.inlier_sigmas,
                             TrialSeed(options.seed, i, j, k));
        progress.Advance();
      });
      for (std::size_t m = 0; m < Methods().size(); ++m) {
        rows.push_back(Summarize(trials, m, disturbance, scene.pose().rotation));
      }
    }
  }
  return rows;
}

std::string SimulationCsv(const std::vector<SimulationRow>& rows) {
  std::string csv =
      "noise_px,outlier_ratio,method,trials,failures,axis_mean_rad,axis_std_rad,angle_mean_rad,"
      "angle_std_rad,rotation_rms_rad,bound_rms_rad,nees_mean\n";
  for (const SimulationRow& row : rows) {
    csv += JoinList(
               {Number(row.noise_px), Number(row.outlier_ratio), row.method->name,
                std::to_string(row.trials), std::to_string(row.failures), Number(row.axis_mean_rad),
                Number(row.axis_std_rad), Number(row.angle_mean_rad), Number(row.angle_std_rad),
                Number(row.rotation_rms_rad), Number(row.bound_rms_rad), Number(row.nees_mean)},
               ",") +
           "\n";
  }
  return csv;
}

std::string SimulationTable(const std::vector<SimulationRow>& rows) {
  std::ostringstream table;
  const auto line = [&table](const std::array<std::string, 8>& cells) {
    constexpr std::array<int, 8> kWidths = {8, 9, 22, 9, 12, 12, 12, 7};
    for (std::size_t i = 0; i < cells.size(); ++i) table << std::setw(kWidths[i]) << cells[i];
    table << "\n";
  };
  line(
      {"noise px", "outliers", "method", "failures", "rms rad", "bound rad", "efficiency", "NEES"});
  for (const SimulationRow& row : rows) {
    const bool noisy = row.noise_px > 0.0;
    line({FormatShort(row.noise_px), FormatShort(row.outlier_ratio), row.method->name,
          std::to_string(row.failures), FormatFixed(row.rotation_rms_rad, 6),
          FormatFixed(row.bound_rms_rad, 6),
          noisy ? FormatFixed(row.bound_rms_rad / row.rotation_rms_rad, 3) : "-",
          FormatFixed(row.nees_mean, 2)});
  }
  return table.str();
}

}  // namespace circline::apps
