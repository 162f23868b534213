// From seeds to ranked hypotheses: every reading of the evidence (which features take part) that
// competes, refined from every start. What EstimatePose and the refined solvers share, and the
// steps of it. Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_READINGS_H_
#define CIRCLINE_REFINE_JOINT_READINGS_H_

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "circline/estimators/noise_model.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/solver_registry.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/joint/joint_problem.h"

namespace circline {

// Runs the seeders, refines what they propose for the world frame of `observations` on all of
// `observations`, and names the estimate `name`.
PoseEstimate RefineSeeds(const std::string& name,
                         const std::vector<std::shared_ptr<const Solver>>& seeders,
                         const Observations& observations, const EstimationOptions& options);

// Standard deviation, pixels, of the points of features that nobody has fitted and that state none,
// for FitDirect; what they scatter by is measured on these fits.
inline double FitSigmaPx(const EstimationOptions& options) {
  constexpr double kDefaultSigmaPx = 0.4;
  const double scale = options.line_loss.scale_px;
  return scale > 0.0 ? scale : kDefaultSigmaPx;
}

// --- pose_seeds.cc: where refinements of one world plane may start. ---

// For WorldRotation, where every feature has a noise of its own: never taken.
inline constexpr double kAnySigmaPx = 0.5;

struct Seed {
  CameraPose pose;
  double log_focal = 0.0;  // Of the camera that it was found with against the one given.
  // Who proposed it, from 1 up the closed forms, from -1 down the circles, the best known first.
  // The two poses of one circle, however close, are two seeds.
  int source = 0;
  int circle = -1;  // Index of the circle that proposed it.
};

// Close enough to lead to one minimum where the evidence agrees; where it does not, one may be
// stuck where some of it is an outlier.
bool IsSameSeed(const Seed& a, const Seed& b);

// Poses that the closed forms propose for the same world plane, in their order, and those of its
// circles. `resolved`: fitted, with a world (ResolveWorld) and a noise for every feature. `reasons`
// (may be null) receives why closed forms refused; other solvers are not asked.
std::vector<Seed> CollectSeeds(const Observations& resolved,
                               const std::vector<std::shared_ptr<const Solver>>& seeders,
                               double log_focal, std::vector<std::string>* reasons = nullptr);

// Of the best known circles alone: both planes of each, and, of an arc whose ellipse leaves them
// open and one pencil, planes all about the pencil's direction.
void AddCircleSeeds(const Observations& resolved, double log_focal, std::vector<Seed>* seeds);

// The pose prior, and the planes that gravity leaves to each pencil that does not run along it:
// where no closed form gives any seed.
void AddPriorSeeds(const EstimationOptions& options, const Observations& resolved, double log_focal,
                   std::vector<Seed>* seeds);

// The observations of a problem, fits included, through a camera of another focal length.
Observations Refocused(const JointProblem& problem, double log_focal);

// --- imperfection_scales.cc: how exact this photo's world is, against what the noise model takes
// it for: a board is flatter than a box, a box straighter than a street. ---

// Whether there are features enough for any scale.
bool HasManyFeatures(const JointProblem& problem);

// The noise model with the standard deviations that many features of one kind have, each its own
// draw (tilt, height and shared error of contours; deviation and shared error of lines), scaled to
// how far these features contradict each other at a minimum. NoiseModel::spread says by how much
// its own figures may be off.
NoiseModel ScaledNoiseModel(const JointProblem& problem, const State& minimum);

// --- doubted_axes.cc: pencils along axes that may be along none (axis_probability), where the
// focal length is unknown. ---

// The observations with some pencils along no axis, and how probable that is.
struct AxesReading {
  Observations observations;
  double probability = 1.0;
  std::string freed;  // "" where all run as they are said to, else " + free L1".
};
// First that all run along their axes, then that the most doubted one does not, that the next does
// not either, and so on.
std::vector<AxesReading> ReadingsOfAxes(const Observations& resolved);

// The estimates of these readings, as one: each has its probability, however well it fits, as right
// angles are what the focal length is told by. Those that failed have none. In words, which axes
// are doubted.
PoseEstimate UnitedReadings(const std::vector<AxesReading>& readings,
                            std::vector<PoseEstimate> estimates);

// --- reading_search.cc ---

// Radians. Solutions stop within a few hundredths of a standard deviation, and those of hopeless
// evidence have a tenth of a radian.
inline constexpr double kSamePose = 1e-3;

// One pose, up to what the evidence cannot tell: the spin about the normal where that is free, and
// the senses of the axes, which are settled by convention and may tip over.
bool IsSamePose(const JointProblem& problem, const State& a, const State& b,
                double tolerance = kSamePose);

// A seed's unknowns.
struct SeedStart {
  State state;
  double cost;  // With what is left out.
  std::size_t seed;
};
// Of all seeds that can start, the cheapest first; `last` receives what became of the last seed.
std::vector<SeedStart> StartsOf(const JointProblem& problem, const std::vector<Seed>& seeds,
                                const Reading& reading, Status* last);

// All minima of all readings that compete, in the order of the seeds; their cost is with what is
// left out. A feature that contradicts the others as a whole makes a reading without it, and the
// one with it stays. Not ok: no seed could be refined.
Status FindMinima(const JointProblem& problem, const std::vector<Seed>& seeds,
                  std::vector<State>* minima);

// --- agreeing_lines.cc: readings of lines along the axes, of which some do not run as the others
// do. ---

struct AgreeingLines {
  Reading reading;          // Without the lines that do not agree.
  std::vector<Seed> seeds;  // The planes, turned such that one of them fits.
};
// Those with most lines first, and no more than `most` of them.
void KeepFullest(std::size_t most, std::vector<AgreeingLines>* readings);

// In a circle's plane one line along an axis tells how the world is turned: the sample of a search
// by consensus. For each such line, and each plane of the best known circle among the seeds, the
// lines that agree with it as far as the plane and they themselves are known; those with most lines
// first, at most `max_readings`, each reading once. None where all lines agree, or there are many.
std::vector<AgreeingLines> FindAgreeingLines(const JointProblem& problem,
                                             const std::vector<Seed>& seeds,
                                             std::size_t max_readings);

// --- agreeing_pencils.cc

// The same of pencils that alone tell the plane: for each set of lines of one pencil that meet, and
// each of another's. None where all lines of each pencil meet, or there are circles.
std::vector<AgreeingLines> FindAgreeingPencils(const JointProblem& problem,
                                               const std::vector<Seed>& seeds);

// --- ranked_readings.cc, merged_humps.cc ---

// Fills the hypotheses of all minima that compete, of the second ellipses of circles that these
// leave out besides, and adds the notes of the best one. Not ok: no minimum gives a hypothesis.
Status RankReadings(const JointProblem& problem, const std::vector<State>& minima,
                    PoseEstimate* estimate);

// Hypotheses that are less apart than they are wide become one: the most probable pose, with the
// covariances of all about it, and with the volume of all (log_det), so that it is as probable as
// they are together. Ranks what is left. The two poses of a lone circle stay two, however near.
void MergeHumps(std::vector<PoseHypothesis>* hypotheses);

// --- direction_readings.cc ---

// Where the direction of a pencil may be far from a hypothesis' (PencilObservation::readings), the
// hypothesis shares its probability with that pose turned to there, which is not refined again: its
// covariance, rms and inliers are those of the hypothesis. Ranks them.
void ShareByReadings(const Observations& observations, std::vector<PoseHypothesis>* hypotheses);

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_READINGS_H_
