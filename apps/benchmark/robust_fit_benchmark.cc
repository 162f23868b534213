// Robust fits of conics, lines and pencils among outliers, beside what OpenCV, a plain RANSAC and a
// RANSAC with a Tukey finish reach on the same data. Every row says whether it meets its bar.
//
//     circline_robust_fit_benchmark --trials=200
//     circline_robust_fit_benchmark --rows=cluster --peers=false --score=magsac
//
// C is the error along the true curve over the Cramer-Rao bound of the inliers; a fit is ok if
// C <= 3; times are processor time of one fit.
#include <gflags/gflags.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <iostream>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/robust_fit_scenes.h"
#include "apps/common/flags_util.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/random.h"
#include "circline/estimators/robust_loss.h"
#include "circline/ransac/find_conics.h"
#include "circline/ransac/line_model.h"
#include "circline/ransac/pencil_model.h"
#include "circline/ransac/ransac.h"
#include "circline/ransac/robust_conic.h"
#include "circline/ransac/robust_directions.h"

DEFINE_int32(trials, 200, "Data sets for each row; 1 or more.");
DEFINE_uint64(seed, 1, "Of the data sets.");
DEFINE_double(sigma_px, 1.0, "Standard deviation of each coordinate of a point, pixels.");
DEFINE_double(direction_sigma_deg, 5.0, "Standard deviation of the edge directions, degrees.");
DEFINE_string(rows, "", "Only the rows whose name holds this.");
DEFINE_bool(peers, true, "Run the other methods too.");
DEFINE_int32(peer_max_iterations, 10000, "Draws of the plain RANSAC; 1 or more.");

// The engine's options, all of them.
DEFINE_double(inlier_sigmas, 3.03, "Threshold, in standard deviations of the noise.");
DEFINE_double(confidence, circline::RansacOptions().confidence, "RansacOptions::confidence.");
DEFINE_int32(min_iterations, circline::RansacOptions().min_iterations,
             "RansacOptions::min_iterations.");
DEFINE_int32(max_iterations, circline::RansacOptions().max_iterations,
             "RansacOptions::max_iterations.");
DEFINE_string(score, "msac", "RansacOptions::score: msac or magsac.");
DEFINE_int32(local_start, circline::RansacOptions().local_start, "RansacOptions::local_start.");
DEFINE_int32(local_samples, circline::RansacOptions().local_samples,
             "RansacOptions::local_samples.");
DEFINE_int32(local_steps, circline::RansacOptions().local_steps, "RansacOptions::local_steps.");
DEFINE_double(max_seconds, circline::RansacOptions().max_seconds, "RansacOptions::max_seconds.");
DEFINE_uint64(ransac_seed, circline::RansacOptions().seed, "RansacOptions::seed.");

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRadians = 3.14159265358979323846 / 180.0;
constexpr double kOkError = 3.0;

constexpr char kUsage[] =
    "circline_robust_fit_benchmark: robust conics, lines and pencils beside their peers.";

RansacOptions EngineOptions() {
  RansacOptions options;
  options.threshold = FLAGS_inlier_sigmas;
  options.confidence = FLAGS_confidence;
  options.min_iterations = FLAGS_min_iterations;
  options.max_iterations = FLAGS_max_iterations;
  options.score = FLAGS_score == "magsac" ? ScoreType::kMagsac : ScoreType::kMsac;
  options.local_start = FLAGS_local_start;
  options.local_samples = FLAGS_local_samples;
  options.local_steps = FLAGS_local_steps;
  options.max_seconds = FLAGS_max_seconds;
  options.seed = FLAGS_ransac_seed;
  return options;
}

RobustFitOptions PixelOptions() {
  RobustFitOptions options;
  options.ransac = EngineOptions();
  options.ransac.threshold *= FLAGS_sigma_px;
  options.sigma_px = FLAGS_sigma_px;
  return options;
}

Status CheckFlags() {
  if (FLAGS_trials < 1) return Status::Invalid("--trials: must be 1 or more");
  if (FLAGS_score != "msac" && FLAGS_score != "magsac") {
    return Status::Invalid("--score: '" + FLAGS_score + "' is not msac or magsac");
  }
  return PixelOptions().Validate();
}

bool Wanted(const std::string& name) { return name.find(FLAGS_rows) != std::string::npos; }

std::uint64_t TrialSeed(int trial) { return 1000 * FLAGS_seed + static_cast<std::uint64_t>(trial); }

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

// What a row has to reach; 0 = no bar.
struct Bar {
  double ok_percent = 0.0, error = 0.0, ms = 0.0;
};

class Tally {
 public:
  void Add(double error, double ms) {
    errors_.push_back(error);
    ms_.push_back(ms);
  }
  double OkPercent() const {
    const auto ok = std::count_if(errors_.begin(), errors_.end(),
                                  [](double error) { return error <= kOkError; });
    return 100.0 * static_cast<double>(ok) / static_cast<double>(errors_.size());
  }
  double Error() const { return Median(errors_); }
  double Ms() const { return Median(ms_); }

 private:
  std::vector<double> errors_, ms_;
};

void PrintHead(const char* title, const char* error_name) {
  std::printf("\n%s\n%-26s %-28s %6s %9s %9s  %s\n", title, "data", "method", "ok %", error_name,
              "ms", "bar");
}

std::string Verdict(const Bar& bar, double ok_percent, double error, double ms) {
  std::string verdict;
  char text[64];
  const auto check = [&](const char* name, double limit, double value, bool at_least) {
    if (limit <= 0.0) return;
    const bool met = at_least ? value >= limit : value <= limit;
    std::snprintf(text, sizeof(text), "%s %s %g %s; ", name, at_least ? ">=" : "<=", limit,
                  met ? "met" : "NOT MET");
    verdict += text;
  };
  check("ok", bar.ok_percent, ok_percent, true);
  check("error", bar.error, error, false);
  check("ms", bar.ms, ms, false);
  return verdict;
}

void PrintRow(const std::string& data, const std::string& method, const Tally& tally,
              const Bar& bar) {
  std::printf("%-26s %-28s %6.1f %9.2f %9.3f  %s\n", data.c_str(), method.c_str(),
              tally.OkPercent(), tally.Error(), tally.Ms(),
              Verdict(bar, tally.OkPercent(), tally.Error(), tally.Ms()).c_str());
  std::fflush(stdout);
}

// Milliseconds of processor time that `work` takes.
double Timed(const std::function<void()>& work) {
  const std::clock_t start = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// ---------------------------------------------------------------------------------------- conics

using ConicMethod = std::function<bool(const ConicScene&, Matrix3d*)>;

struct NamedConicMethod {
  const char* name;
  ConicMethod fit;
  bool ours;
};

bool FromOpenCv(const cv::RotatedRect& rect, Matrix3d* conic) {
  Ellipse ellipse;
  ellipse.center = {static_cast<double>(rect.center.x), static_cast<double>(rect.center.y)};
  ellipse.a = 0.5 * static_cast<double>(rect.size.width);
  ellipse.b = 0.5 * static_cast<double>(rect.size.height);
  ellipse.angle = static_cast<double>(rect.angle) * kRadians;
  if (!(ellipse.a > 0.0 && ellipse.b > 0.0)) return false;
  const Camera camera = SceneCamera();
  Matrix3d pixel_from_x;
  pixel_from_x << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  *conic = TransformConic(EllipseToConic(ellipse), pixel_from_x);
  return conic->allFinite();
}

std::vector<cv::Point2f> OpenCvPoints(const std::vector<Vector2d>& pixels,
                                      const std::vector<std::uint8_t>* mask = nullptr) {
  std::vector<cv::Point2f> points;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (mask != nullptr && (*mask)[i] == 0) continue;
    points.emplace_back(static_cast<float>(pixels[i].x()), static_cast<float>(pixels[i].y()));
  }
  return points;
}

// Plain RANSAC: five points, inliers counted, the usual stopping rule.
bool PlainRansac(const ConicScene& scene, std::vector<std::uint8_t>* best) {
  const int n = static_cast<int>(scene.points.size());
  const double threshold = FLAGS_inlier_sigmas * scene.sigma_px;
  Random random(FLAGS_ransac_seed);
  std::vector<std::uint8_t> mask(scene.points.size());
  std::array<Vector2d, 5> sample;
  int most = 0;
  double needed = FLAGS_peer_max_iterations;
  for (int draw = 0; draw < needed; ++draw) {
    for (Vector2d& x : sample) x = scene.points[static_cast<std::size_t>(random.UniformInt(n))].x;
    Matrix3d conic;
    if (!ConicFromFivePoints(sample, &conic) || !NormalizeEllipse(conic, &conic)) continue;
    int count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      mask[i] = std::abs(ConicDistancePx(scene.points[i], conic)) <= threshold ? 1 : 0;
      count += mask[i];
    }
    if (count <= most) continue;
    most = count;
    *best = mask;
    const double good = std::pow(static_cast<double>(count) / n, 5.0);
    needed = std::min<double>(FLAGS_peer_max_iterations,
                              std::log(1.0 - FLAGS_confidence) / std::log1p(-good));
  }
  return most >= 5;
}

bool RansacThenFitEllipse(const ConicScene& scene, Matrix3d* conic) {
  std::vector<std::uint8_t> mask;
  if (!PlainRansac(scene, &mask)) return false;
  return FromOpenCv(cv::fitEllipse(OpenCvPoints(scene.pixels, &mask)), conic);
}

bool RansacThenTukey(const ConicScene& scene, Matrix3d* conic) {
  if (!RansacThenFitEllipse(scene, conic)) return false;
  constexpr int kPasses = 20;
  constexpr double kTukey = 4.685;
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<CalibratedPoint> points;
    std::vector<double> weights;
    for (const CalibratedPoint& p : scene.points) {
      const double u = ConicDistancePx(p, *conic) / (kTukey * scene.sigma_px);
      if (!(std::abs(u) < 1.0)) continue;
      points.push_back(p);
      weights.push_back((1.0 - u * u) * (1.0 - u * u));
    }
    ConicFit fit;
    if (!RefineConic(points, scene.sigma_px, *conic, &fit, &weights).ok()) return true;
    *conic = fit.conic;
  }
  return true;
}

bool OursOnPoints(const ConicScene& scene, Matrix3d* conic) {
  ConicFit fit;
  if (!FitConicRobust(scene.points, PixelOptions(), &fit).ok()) return false;
  *conic = fit.conic;
  return true;
}

bool OursWithDirections(const ConicScene& scene, Matrix3d* conic) {
  ConicFit fit;
  const Status status =
      FitConicRobust(scene.points, PixelOptions(), &fit, nullptr, ConicLimits(), &scene.directions);
  if (!status.ok()) return false;
  *conic = fit.conic;
  return true;
}

std::vector<NamedConicMethod> ConicMethods(bool all_points) {
  const auto open_cv = [](cv::RotatedRect (*fit)(cv::InputArray)) {
    return [fit](const ConicScene& scene, Matrix3d* conic) {
      return FromOpenCv(fit(OpenCvPoints(scene.pixels)), conic);
    };
  };
  std::vector<NamedConicMethod> methods;
  if (FLAGS_peers && all_points) {
    // OpenCV 4.6 has AMS and Direct fall back to fitEllipse, silently, from 200 points on.
    methods.push_back({"all points, fitEllipse", open_cv(cv::fitEllipse), false});
    methods.push_back({"all points, fitEllipseAMS", open_cv(cv::fitEllipseAMS), false});
    methods.push_back({"all points, fitEllipseDirect", open_cv(cv::fitEllipseDirect), false});
  }
  if (FLAGS_peers) {
    methods.push_back({"RANSAC + fitEllipse", RansacThenFitEllipse, false});
    methods.push_back({"RANSAC + Tukey", RansacThenTukey, false});
  }
  methods.push_back({"ours, points", OursOnPoints, true});
  methods.push_back({"ours, with directions", OursWithDirections, true});
  return methods;
}

struct ConicRow {
  const char* name;
  double outlier_ratio, arc_deg;
  Clutter clutter;
  Bar bar;
};

void RunConicRow(const ConicRow& row) {
  ConicSceneOptions options;
  options.outlier_ratio = row.outlier_ratio;
  options.arc_deg = row.arc_deg;
  options.clutter = row.clutter;
  options.sigma_px = FLAGS_sigma_px;
  options.direction_sigma_rad = FLAGS_direction_sigma_deg * kRadians;
  std::vector<ConicScene> scenes;
  for (int trial = 0; trial < FLAGS_trials; ++trial) {
    scenes.push_back(MakeConicScene(options, TrialSeed(trial)));
    scenes.back().directions.sigma_rad = std::max(options.direction_sigma_rad, 1e-3);
  }
  for (const NamedConicMethod& method : ConicMethods(row.clutter == Clutter::kUniform)) {
    Tally tally;
    for (const ConicScene& scene : scenes) {
      Matrix3d conic;
      bool found = false;
      const double ms = Timed([&] { found = method.fit(scene, &conic); });
      const double error = found ? scene.Error(conic) : 1e9;
      tally.Add(std::isfinite(error) ? error : 1e9, ms);
    }
    PrintRow(row.name, method.name, tally, method.ours ? row.bar : Bar());
  }
}

const ConicRow kConicRows[] = {
    {"10 %, full", 0.1, 360.0, Clutter::kUniform, {100.0, 1.05, 0.1}},
    {"30 %, full", 0.3, 360.0, Clutter::kUniform, {100.0, 1.05, 0.1}},
    {"50 %, full", 0.5, 360.0, Clutter::kUniform, {100.0, 1.05, 1.5}},
    {"70 %, full", 0.7, 360.0, Clutter::kUniform, {100.0, 1.10, 4.0}},
    {"70 %, 180 deg arc", 0.7, 180.0, Clutter::kUniform, {99.0, 1.25, 4.0}},
    {"70 %, 90 deg arc", 0.7, 90.0, Clutter::kUniform, {99.0, 1.25, 4.0}},
    {"90 %, full", 0.9, 360.0, Clutter::kUniform, {95.0, 0.0, 0.0}},
    {"70 %, 180 deg, in its box", 0.7, 180.0, Clutter::kArcBox, {}},
    {"70 %, 90 deg, in its box", 0.7, 90.0, Clutter::kArcBox, {}},
};

const ConicRow kStructuredRows[] = {
    {"second ellipse, 30 %", 0.3, 360.0, Clutter::kEllipse, {99.0, 0.0, 0.0}},
    {"second ellipse, 45 %", 0.45, 360.0, Clutter::kEllipse, {99.0, 0.0, 0.0}},
    {"straight edge, 50 %", 0.5, 360.0, Clutter::kEdge, {99.0, 0.0, 0.0}},
    {"straight edge, 70 %", 0.7, 360.0, Clutter::kEdge, {99.0, 0.0, 0.0}},
    {"cluster, 30 %", 0.3, 360.0, Clutter::kCluster, {99.0, 0.0, 0.0}},
    {"cluster, 50 %", 0.5, 360.0, Clutter::kCluster, {99.0, 0.0, 0.0}},
    {"cluster, 70 %", 0.7, 360.0, Clutter::kCluster, {99.0, 0.0, 0.0}},
};

void RunConics() {
  char title[160];
  std::snprintf(title, sizeof(title),
                "Conics: 100 points, semi-axes 100 and 60 px, sigma %g px, directions %g deg, "
                "%d trials",
                FLAGS_sigma_px, FLAGS_direction_sigma_deg, FLAGS_trials);
  PrintHead(title, "median C");
  for (const ConicRow& row : kConicRows) {
    if (Wanted(row.name)) RunConicRow(row);
  }
  PrintHead("Conics among structured outliers", "median C");
  for (const ConicRow& row : kStructuredRows) {
    if (Wanted(row.name)) RunConicRow(row);
  }
}

// A trial is ok if all four are found; the second column counts what is none of them.
void RunInstancesRow(const char* method, bool with_directions) {
  FindConicsOptions options;
  options.fit = PixelOptions();
  std::vector<double> times;
  int complete = 0, wrong = 0;
  for (int trial = 0; trial < FLAGS_trials; ++trial) {
    InstancesScene scene =
        MakeInstancesScene(FLAGS_sigma_px, FLAGS_direction_sigma_deg * kRadians, TrialSeed(trial));
    scene.directions.sigma_rad = std::max(FLAGS_direction_sigma_deg * kRadians, 1e-3);
    std::vector<FoundConic> found;
    times.push_back(Timed([&] {
      (void)FindConics(scene.points, options, &found,
                       with_directions ? &scene.directions : nullptr);
    }));
    std::vector<Matrix3d> conics;
    for (const FoundConic& conic : found) conics.push_back(conic.fit.conic);
    const int right = scene.NumFound(conics);
    complete += right == 4 ? 1 : 0;
    wrong += std::max(0, static_cast<int>(conics.size()) - right);
  }
  std::printf("%-26s %-28s %6.1f %9.2f %9.3f\n", "four ellipses, 50 %", method,
              100.0 * complete / FLAGS_trials, static_cast<double>(wrong) / FLAGS_trials,
              Median(times));
}

void RunInstances() {
  if (!Wanted("four ellipses, 50 %")) return;
  PrintHead("Several ellipses from one set: all four found, and others reported", "others");
  RunInstancesRow("ours, points", false);
  RunInstancesRow("ours, with directions", true);
}

// ----------------------------------------------------------------------------------------- lines

bool OpenCvLine(const LineScene& scene, int distance, Vector3d* line) {
  cv::Vec4f fit;
  cv::fitLine(OpenCvPoints(scene.pixels), fit, distance, 0.0, 0.01, 0.01);
  const Vector2d direction(static_cast<double>(fit[0]), static_cast<double>(fit[1]));
  const Vector2d point(static_cast<double>(fit[2]), static_cast<double>(fit[3]));
  const Vector2d normal(-direction.y(), direction.x());
  const Camera camera = SceneCamera();
  const Vector3d in_pixels(normal.x(), normal.y(), -normal.dot(point));
  Matrix3d pixel_from_x;
  pixel_from_x << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  *line = (pixel_from_x.transpose() * in_pixels).normalized();
  return true;
}

bool OurLine(const LineScene& scene, Vector3d* line) {
  LineFit fit;
  if (!FitLineRobust(scene.points, PixelOptions(), &fit).ok()) return false;
  *line = fit.line;
  return true;
}

void RunLineRow(const std::string& name, double outlier_ratio, const Bar& bar) {
  struct Method {
    const char* name;
    std::function<bool(const LineScene&, Vector3d*)> fit;
    bool ours;
  };
  std::vector<Method> methods;
  if (FLAGS_peers) {
    const auto open_cv = [](int distance) {
      return [distance](const LineScene& s, Vector3d* l) { return OpenCvLine(s, distance, l); };
    };
    methods.push_back({"fitLine, Huber", open_cv(cv::DIST_HUBER), false});
    methods.push_back({"fitLine, Welsch", open_cv(cv::DIST_WELSCH), false});
  }
  methods.push_back({"ours", OurLine, true});
  for (const Method& method : methods) {
    Tally tally;
    for (int trial = 0; trial < FLAGS_trials; ++trial) {
      const LineScene scene = MakeLineScene(outlier_ratio, FLAGS_sigma_px, TrialSeed(trial));
      Vector3d line;
      bool found = false;
      const double ms = Timed([&] { found = method.fit(scene, &line); });
      tally.Add(found ? scene.Error(line) : 1e9, ms);
    }
    PrintRow(name, method.name, tally, method.ours ? bar : Bar());
  }
}

void RunLines() {
  PrintHead("Lines: 100 points along 300 px, uniform outliers", "median C");
  if (Wanted("line, 50 %")) RunLineRow("line, 50 %", 0.5, {100.0, 1.05, 0.05});
  if (Wanted("line, 70 %")) RunLineRow("line, 70 %", 0.7, {100.0, 1.10, 0.05});
}

// --------------------------------------------------------------------------------------- pencils

PencilOptions LineOptions() {
  PencilOptions options;
  options.ransac = EngineOptions();
  options.model_sigma_rad = 0.0;  // The segments are exactly parallel but for their noise.
  return options;
}

// The nearest rotation to three directions found one by one.
bool RotationFromPencils(const PencilScene& scene, Matrix3d* rotation) {
  std::vector<FoundPencil> pencils;
  if (!FindPencils(scene.lines, LineOptions(), &pencils).ok() || pencils.size() < 3) return false;
  Matrix3d directions;
  for (int k = 0; k < 3; ++k) {
    directions.col(k) = pencils[static_cast<std::size_t>(k)].fit.direction;
  }
  if (directions.determinant() < 0.0) directions.col(2) *= -1.0;
  const Eigen::JacobiSVD<Matrix3d> svd(directions, Eigen::ComputeFullU | Eigen::ComputeFullV);
  *rotation = svd.matrixU() * svd.matrixV().transpose();
  return true;
}

bool RotationFromTriplet(const PencilScene& scene, Matrix3d* rotation) {
  OrthogonalTripletFit fit;
  if (!FitOrthogonalTriplet(scene.lines, LineOptions(), &fit).ok()) return false;
  *rotation = fit.rotation;
  return true;
}

// The maximum-likelihood rotation of the inliers alone, known to belong to their directions: what
// the data allow, in these very trials.
bool RotationOfInliers(const PencilScene& scene, Matrix3d* rotation) {
  PencilScene inliers = scene;
  inliers.lines.resize(static_cast<std::size_t>(3 * scene.per_direction));
  return RotationFromTriplet(inliers, rotation);
}

// The error of a row is rms error over rms bound; lost are errors beyond ten times the bound.
void RunPencilRow(const std::string& name, double clutter_ratio, const Bar& bar) {
  struct Method {
    const char* name;
    bool (*fit)(const PencilScene&, Matrix3d*);
    bool ours;
  };
  const Method methods[] = {{"inliers alone", RotationOfInliers, false},
                            {"one by one, then SVD", RotationFromPencils, false},
                            {"ours, orthogonal triplet", RotationFromTriplet, true}};
  constexpr double kLost = 10.0;
  for (const Method& method : methods) {
    std::vector<double> times;
    double squares = 0.0, bounds = 0.0;
    int ok = 0, same = 0;
    for (int trial = 0; trial < FLAGS_trials; ++trial) {
      const PencilScene scene = MakePencilScene(30, clutter_ratio, TrialSeed(trial));
      Matrix3d rotation, again;
      bool found = false;
      times.push_back(Timed([&] { found = method.fit(scene, &rotation); }));
      same += found && method.fit(scene, &again) && again == rotation ? 1 : 0;
      const double error = found ? scene.Error(rotation) : 1e9;
      if (error > kLost * scene.rotation_bound) continue;
      ++ok;
      squares += error * error;
      bounds += scene.rotation_bound * scene.rotation_bound;
    }
    const double percent = 100.0 * ok / FLAGS_trials, ratio = std::sqrt(squares / bounds);
    std::printf("%-26s %-28s %6.1f %9.3f %9.3f  %ssame bits %d of %d\n", name.c_str(), method.name,
                percent, ratio, Median(times),
                Verdict(method.ours ? bar : Bar(), percent, ratio, Median(times)).c_str(), same,
                FLAGS_trials);
  }
}

void RunPencils() {
  PrintHead("Pencils: 30 segments along each of three orthogonal directions, sigma 0.5 px",
            "rms/bound");
  if (Wanted("pencils, clean")) RunPencilRow("pencils, clean", 0.0, {100.0, 1.10, 2.0});
  if (Wanted("pencils, 50 %")) RunPencilRow("pencils, 50 %", 0.5, {100.0, 1.10, 2.0});
  if (Wanted("pencils, 70 %")) RunPencilRow("pencils, 70 %", 0.7, {});
}

int Run() {
  const Status status = CheckFlags();
  if (!status.ok()) {
    SayOnStderr("circline_robust_fit_benchmark: " + status.message);
    return kExitUsage;
  }
  RunConics();
  RunInstances();
  RunLines();
  RunPencils();
  return kExitOk;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  using namespace circline::apps;  // NOLINT(google-build-using-namespace)
  InitAppLogging(argv[0]);
  CommandLine command_line;
  const circline::Status status = ParseCommandLine(argc, argv, &command_line);
  if (!status.ok()) {
    SayOnStderr("circline_robust_fit_benchmark: " + status.message);
    return kExitUsage;
  }
  if (command_line.help) {
    std::cout << HelpText(kUsage);
    return kExitOk;
  }
  return Run();
}
