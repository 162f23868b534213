// The paper's simulation: many noisy images of one scene, every method on each, errors against the
// Cramer-Rao bound.
#ifndef CIRCLINE_APPS_SIMULATE_SIMULATE_H_
#define CIRCLINE_APPS_SIMULATE_SIMULATE_H_

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/simulate/scene.h"
#include "circline/estimators/robust_loss.h"
#include "circline/estimators/solver_registry.h"
#include "circline/estimators/status.h"

namespace circline::apps {

enum class SimulatedScene { kPaper, kStreet };

struct SimulationOptions {
  // Of the street trials, seed, threads and focal_sigma count.
  SimulatedScene scene = SimulatedScene::kPaper;
  int trials = 200;                                                    // 1 or more.
  std::vector<double> noise_px = {0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0};  // 0 or more.
  std::vector<double> outlier_ratios = {0.0};                          // From 0 to 0.8.
  OutlierKind outlier_kind = OutlierKind::kBand;
  double focal_px = 1800.0;  // > 0.
  Eigen::Vector3d translation = Eigen::Vector3d(2.0, 2.0, 100.0);
  std::uint64_t seed = 1;
  int threads = 0;           // 0 = one for each core.
  double focal_sigma = 0.0;  // Of streets: that of DrawStreet, 0 or 0.1 to 1.
  // With outliers: a point farther than this from its curve is one, in standard deviations of the
  // noise; > 0. FitObservations takes 3.03 at most.
  double inlier_sigmas = 3.03;
  // Of the refined methods: on images without outliers, and on images with them.
  LossType loss = LossType::kTrivial, outlier_loss = LossType::kTukey;

  Status Validate() const;
};

struct Method {
  const char* name;    // As simulation.csv has it.
  const char* solver;  // As the registry has it.
  SolverStage stage;
  Evidence evidence;
};
const std::vector<Method>& Methods();

// One line of simulation.csv. Failed trials count in `failures` alone.
struct SimulationRow {
  double noise_px = 0.0, outlier_ratio = 0.0;
  const Method* method = nullptr;
  int trials = 0, failures = 0;
  double axis_mean_rad = 0.0, axis_std_rad = 0.0;    // Angle between true and estimated axis.
  double angle_mean_rad = 0.0, angle_std_rad = 0.0;  // |error| of the rotation angle.
  double rotation_rms_rad = 0.0;                     // Total angle between the rotations.
  double bound_rms_rad = 0.0;                        // The least that this can be.
  double nees_mean = 0.0;                            // 3 is honest; NaN where there is no noise.
  // The first four as an estimate on the bound would have them.
  double bound_axis_mean_rad = 0.0, bound_axis_std_rad = 0.0;
  double bound_angle_mean_rad = 0.0, bound_angle_std_rad = 0.0;
};

// Noise outermost, then outlier ratio, then method. The same options give the same bits, whatever
// the number of threads.
std::vector<SimulationRow> Simulate(const SimulationOptions& options);

std::string SimulationCsv(const std::vector<SimulationRow>& rows);
std::string SimulationTable(const std::vector<SimulationRow>& rows);  // For people.
// The paper's figure, a standalone SVG: mean and standard deviation of the errors of rotation axis
// and angle over the noise, once for each outlier ratio; methods in solid lines, the bound of each
// kind of evidence dashed.
std::string RenderSimulation(const std::vector<SimulationRow>& rows);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_SIMULATE_SIMULATE_H_
