#include "apps/compare/results.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/common/document.h"
#include "apps/compare/pixel_ellipse.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"
#include "circline/estimators/pencil_lean.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

const char* StatusText(const Status& status) {
  if (status.ok()) return "ok";
  return status.code == StatusCode::kRefused ? "refused" : "failed";
}

std::string Line(const Json& json) { return JsonText(json) + "\n"; }

Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json Number(const std::optional<double>& value) { return value ? Number(*value) : Json(); }
Json TextOrNull(const std::string& text) { return text.empty() ? Json() : Json(text); }

Json ScaleJson(double scale_px) { return scale_px > 0.0 ? Json(scale_px) : Json("auto"); }

// Which solver ran on which image, with which loss.
Json RunHead(const ImageRun& image, const SolverRun& run) {
  Json line;
  line["image"] = image.image->name;
  line["solver"] = run.solver;
  line["stage"] = SolverStageName(run.stage);
  line["loss"] = run.loss == nullptr ? Json() : Json(run.loss->loss);
  line["loss_scale_px"] = run.loss == nullptr ? Json() : ScaleJson(run.loss->scale_px);
  return line;
}

Json ResultHead(const ImageRun& image, const SolverRun& run) {
  Json line = RunHead(image, run);
  line["status"] = StatusText(run.estimate.status);
  line["message"] = run.estimate.status.message;
  return line;
}

// Errors that cannot be had are left out.
void AddErrors(const PoseErrors& errors, const Truth& truth, Json* line) {
  const auto add = [line](const char* key, const std::optional<double>& error) {
    if (error) (*line)[key] = *error;
  };
  add("rotation_error_deg", errors.rotation_deg);
  add("normal_error_deg", errors.normal_deg);
  add("translation_error_deg", errors.translation_deg);
  if (truth.directions.empty()) return;
  Json directions = Json::object();
  for (const auto& [id, error] : errors.directions_deg) directions[id] = error;
  (*line)["direction_error_deg"] = directions;
}

Json Intrinsics(const Camera& camera) {
  return {{"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"distortion", camera.distortion}};
}

// Whether the camera is not the one given: it was looked for in the photo.
bool HasFoundCamera(const Observations& observations) {
  return observations.stated_focal_px > 0.0 || observations.found_k1 != 0.0;
}

// The camera that the pose is of, where it may be another one than that given: it was estimated, or
// looked for in the photo's structure.
void AddCamera(const Observations& observations, const PoseHypothesis& h, Json* line) {
  const Camera& seen = observations.camera;
  const bool is_estimated = h.focal_sigma > 0.0;
  const bool has_own = h.camera || HasFoundCamera(observations);
  if (is_estimated) {
    const double moved = std::exp(-StatedLogFocal(observations));  // Against the one given.
    (*line)["focal_scale"] = Number(h.focal_scale * moved);
    (*line)["focal_sigma"] = Number(h.focal_sigma * moved);
  }
  if (is_estimated || has_own) (*line)["focal_px"] = Number(h.focal_scale * seen.fx);
  if (is_estimated) (*line)["focal_sigma_px"] = Number(h.focal_sigma * seen.fx);
  if (has_own) (*line)["camera"] = Intrinsics(CameraOf(h, seen));
}

Json HypothesisLine(const ImageRun& image, const SolverRun& run, std::size_t index) {
  const PoseHypothesis& h = run.estimate.hypotheses[index];
  Json line = ResultHead(image, run);
  line["hypothesis"] = index;
  line["num_hypotheses"] = run.estimate.hypotheses.size();
  line["probability"] = Number(h.probability);
  line["rotation"] = JsonNumbers(h.cam_from_world.rotation);
  line["translation"] = JsonNumbers(h.cam_from_world.translation);
  line["metric"] = h.metric;
  line["rms_px"] = h.num_inliers > 0 ? Number(h.rms_px) : Json();  // Null: a prediction.
  line["num_inliers"] = h.num_inliers;
  line["num_observations"] = h.num_observations;
  line["sigma_rotation_deg"] = JsonNumbers(h.SigmaRotation() / kDegree);
  line["sigma_normal_deg"] = Number(SigmaNormalDeg(h));
  line["free_directions"] = Json::array();
  for (const std::array<double, 6>& direction : h.free_directions) {
    line["free_directions"].push_back(direction);
  }
  line["origin_observed"] = h.origin_observed;
  line["left_out"] = h.left_out;
  line["structure"] = h.structure;
  AddCamera(image.observations, h, &line);
  line["decided_by"] = run.estimate.decided_by;
  line["notes"] = run.estimate.notes;
  if (image.image->truth) AddErrors(run.errors[index], *image.image->truth, &line);
  return line;
}

Json RefusalLine(const ImageRun& image, const SolverRun& run) {
  Json line = ResultHead(image, run);
  line["hypothesis"] = nullptr;
  line["num_hypotheses"] = 0;
  for (const char* key :
       {"probability", "rotation", "translation", "metric", "rms_px", "num_inliers",
        "num_observations", "sigma_rotation_deg", "sigma_normal_deg", "free_directions"}) {
    line[key] = nullptr;
  }
  line["left_out"] = Json::array();
  line["notes"] = run.estimate.notes;
  return line;
}

Json EllipseJson(const CircleObservation& circle) {
  Json json;
  json["id"] = circle.id;
  PixelEllipse pixel;
  if (FitPixelEllipse(circle, &pixel)) {
    json["center"] = JsonNumbers(pixel.ellipse.center);
    json["axes"] = {pixel.ellipse.a, pixel.ellipse.b};
    json["angle_rad"] = pixel.ellipse.angle;
  } else {
    json["center"] = json["axes"] = json["angle_rad"] = nullptr;
  }
  if (circle.fit) {
    const Eigen::Matrix3d& c = circle.fit->conic;
    json["conic"] = {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)};
  } else {
    json["conic"] = nullptr;
  }
  json["coverage"] = pixel.coverage;
  json["concentric"] = TextOrNull(circle.concentric);
  json["plane"] = TextOrNull(circle.plane);
  json["num_points"] = pixel.num_points;
  return json;
}

Json PencilJson(const PencilObservation& pencil, double pencil_axis_rad) {
  Json json;
  json["id"] = pencil.id;
  json["direction"] = pencil.fit ? JsonNumbers(pencil.fit->direction) : Json();
  json["num_segments"] = pencil.lines.size();
  if (pencil.fit) {
    json["sigma_deg"] = Number(LargestSigmaDeg(
        pencil.fit->covariance + pencil_axis_rad * pencil_axis_rad * LeanShape(pencil)));
  } else {
    json["sigma_deg"] = nullptr;
  }
  json["along"] = PencilDirectionName(pencil.direction);
  json["plane"] = TextOrNull(pencil.plane);
  return json;
}

// Its size that of the photo where the calibration does not say; where nothing read the photo, that
// which has the principal point in its middle.
Json CameraJson(const ImageRun& run) {
  const Camera& camera = run.image->observations.camera;
  Json json;
  json["id"] = camera.id;
  json["model"] = ModelName(camera.model);
  const auto size = [](int stated, int photo, double center) {
    return stated > 0  ? stated
           : photo > 0 ? photo
                       : static_cast<int>(std::lround(2.0 * center + 1));
  };
  json["width"] = size(camera.width, run.photo.cols, camera.cx);
  json["height"] = size(camera.height, run.photo.rows, camera.cy);
  json.update(Intrinsics(camera));
  return json;
}

std::string TimingLines(const ImageRun& run) {
  std::string lines;
  const auto whole = [](double microseconds) { return static_cast<long long>(microseconds + 0.5); };
  for (const auto& [stage, microseconds] : run.stages) {
    Json line;
    line["image"] = run.image->name;
    line["stage"] = stage;
    line["microseconds"] = whole(microseconds);
    if (stage == "read")
      line["file"] = {{"bytes", run.photo_file.bytes}, {"written", run.photo_file.written}};
    lines += Line(line);
  }
  for (const SolverRun& solver : run.solvers) {
    Json line = RunHead(run, solver);
    line["microseconds"] = whole(solver.microseconds);
    lines += Line(line);
  }
  return lines;
}

std::size_t CountLines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

std::vector<Json> ResultLines(const ImageRun& image) {
  std::vector<Json> lines;
  for (const SolverRun& run : image.solvers) {
    if (!run.HasAnswer()) {
      lines.push_back(RefusalLine(image, run));
      continue;
    }
    for (std::size_t i = 0; i < run.estimate.hypotheses.size(); ++i) {
      lines.push_back(HypothesisLine(image, run, i));
    }
  }
  return lines;
}

Json ObservationLine(const ImageRun& run, const std::string& overlay,
                     const std::vector<std::string>& flags, const NoiseModel& noise,
                     const LineCounts& counts) {
  Json line;
  line["image"] = run.image->name;
  line["index"] = run.image->index;
  line["set_size"] = run.image->set_size;
  line["detected"] = run.image->detect_everything;
  line["camera"] = CameraJson(run);
  if (!run.image->camera_from.empty()) line["camera_from"] = run.image->camera_from;
  if (HasFoundCamera(run.observations))
    line["calibrated_with"] = Intrinsics(run.observations.camera);
  for (const char* key : {"ellipses", "segments", "pencils"}) line[key] = Json::array();
  for (const CircleObservation& circle : run.observations.circles) {
    line["ellipses"].push_back(EllipseJson(circle));
  }
  for (const PencilObservation& pencil : run.observations.pencils) {
    for (const LineObservation& observed : pencil.lines) {
      const Segment s = EndPoints(observed);
      line["segments"].push_back({s[0].x(), s[0].y(), s[1].x(), s[1].y(), pencil.id});
    }
    line["pencils"].push_back(PencilJson(pencil, noise.pencil_axis_rad));
  }
  line["problems"] = run.problems;
  line["overlay"] = TextOrNull(overlay);
  if (!flags.empty()) line["flags"] = flags;
  line["lines"] = {{"results", counts.results}, {"timings", counts.timings}};
  if (!run.read_error.empty()) line["error"] = run.read_error;
  return line;
}

ImageLines WriteLines(const ImageRun& run, const std::string& overlay,
                      const std::vector<std::string>& flags, const NoiseModel& noise) {
  ImageLines lines;
  for (const Json& line : ResultLines(run)) lines.results += Line(line);
  lines.timings = TimingLines(run);
  const LineCounts counts{run.image->index, CountLines(lines.results), CountLines(lines.timings)};
  lines.observations = Line(ObservationLine(run, overlay, flags, noise, counts));
  return lines;
}
}  // namespace circline::apps
