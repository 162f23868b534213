#include "apps/compare/record.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "apps/common/camera_file.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kTinyTurn = 1e-6;  // Below it a free direction does not turn.

// What the line has under this key, else `otherwise`; null is nothing.
template <typename Value>
Value Get(const Json& line, const char* key, Value otherwise = {}) {
  const auto found = line.find(key);
  return found != line.end() && !found->is_null() ? found->get<Value>() : otherwise;
}

std::optional<double> OptionalNumber(const Json& line, const char* key) {
  const double value = Get(line, key, kUnknown);
  return std::isfinite(value) ? std::optional<double>(value) : std::nullopt;
}

// Null (unbounded) is infinity.
Eigen::Vector3d ReadVector(const Json& json) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    const Json& value = json.at(static_cast<std::size_t>(i));
    v[i] = value.is_number() ? value.get<double>() : std::numeric_limits<double>::infinity();
  }
  return v;
}

SolverKey ReadKey(const Json& line) {
  const Json scale = Get<Json>(line, "loss_scale_px");  // Also "auto".
  return {line.at("solver").get<std::string>(), line.at("stage").get<std::string>(),
          Get<std::string>(line, "loss"), scale.is_number() ? scale.get<double>() : 0.0};
}

PoseErrors ReadErrors(const Json& line) {
  PoseErrors errors;
  errors.rotation_deg = OptionalNumber(line, "rotation_error_deg");
  errors.normal_deg = OptionalNumber(line, "normal_error_deg");
  errors.translation_deg = OptionalNumber(line, "translation_error_deg");
  const Json directions = Get<Json>(line, "direction_error_deg");
  for (const auto& [id, error] : directions.items()) {
    if (error.is_number()) errors.directions_deg.emplace_back(id, error.get<double>());
  }
  return errors;
}

void ReadIntrinsics(const Json& json, Camera* camera) {
  camera->fx = json.at("fx").get<double>();
  camera->fy = json.at("fy").get<double>();
  camera->cx = json.at("cx").get<double>();
  camera->cy = json.at("cy").get<double>();
  camera->distortion = json.at("distortion").get<std::array<double, 8>>();
}

HypothesisRecord ReadHypothesis(const Json& line, const Camera& given) {
  HypothesisRecord h;
  h.probability = Get(line, "probability", kUnknown);
  for (std::size_t i = 0; i < 9; ++i) {
    h.rotation(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) =
        line.at("rotation").at(i).get<double>();
  }
  h.translation = ReadVector(line.at("translation"));
  h.metric = line.at("metric").get<bool>();
  if (line.contains("camera")) ReadIntrinsics(line.at("camera"), &h.camera.emplace(given));
  h.focal_px = Get(line, "focal_px", kUnknown);
  h.focal_sigma_px = Get(line, "focal_sigma_px", kUnknown);
  h.rms_px = Get(line, "rms_px", kUnknown);
  h.num_inliers = line.at("num_inliers").get<int>();
  h.num_observations = line.at("num_observations").get<int>();
  h.sigma_rotation_deg = ReadVector(line.at("sigma_rotation_deg"));
  h.sigma_normal_deg = Get(line, "sigma_normal_deg", kUnknown);
  for (const Json& direction : line.at("free_directions")) {
    if (ReadVector(direction).norm() > kTinyTurn) h.rotation_is_free = true;
  }
  h.errors = ReadErrors(line);
  return h;
}

void ReadResults(const std::string& text, ImageRecord* record) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const Json json = Json::parse(line);
    const bool has_hypothesis = json.at("hypothesis").is_number();
    if (!has_hypothesis || json.at("hypothesis").get<int>() == 0) {
      SolverRecord solver;
      solver.key = ReadKey(json);
      solver.status = json.at("status").get<std::string>();
      solver.message = Get<std::string>(json, "message");
      solver.decided_by = Get<std::string>(json, "decided_by");
      solver.notes = Get<std::vector<std::string>>(json, "notes");
      record->solvers.push_back(std::move(solver));
    }
    if (!has_hypothesis) continue;
    record->solvers.back().hypotheses.push_back(ReadHypothesis(json, record->camera));
  }
}

void ReadTimings(const std::string& text, ImageRecord* record) {
  std::istringstream lines(text);
  std::size_t next = 0;  // Times stand in the order of the results.
  for (std::string line; std::getline(lines, line);) {
    const Json json = Json::parse(line);
    const double microseconds = json.at("microseconds").get<double>();
    if (!json.contains("solver")) {
      record->stages.emplace_back(json.at("stage").get<std::string>(), microseconds);
      const Json file = Get<Json>(json, "file");
      if (file.is_object()) {
        record->photo_file = {file.at("bytes").get<std::uint64_t>(),
                              file.at("written").get<std::int64_t>()};
      }
    } else if (next < record->solvers.size()) {
      record->solvers[next++].microseconds = microseconds;
    }
  }
}

Camera ReadCamera(const Json& json) {
  Camera camera;
  camera.id = json.at("id").get<std::string>();
  const auto model = json.at("model").get<std::string>();
  if (!ModelFromName(model, &camera.model)) throw std::invalid_argument(NoSuchModel(model));
  camera.width = json.at("width").get<int>();
  camera.height = json.at("height").get<int>();
  ReadIntrinsics(json, &camera);
  return camera;
}

void ReadObservations(const std::string& text, ImageRecord* record) {
  const Json line = Json::parse(text);
  record->index = line.at("index").get<std::size_t>();
  record->set_size = line.at("set_size").get<std::size_t>();
  record->name = line.at("image").get<std::string>();
  record->error = Get<std::string>(line, "error");
  record->overlay = Get<std::string>(line, "overlay");
  record->detected = line.at("detected").get<bool>();
  record->num_ellipses = line.at("ellipses").size();
  record->num_segments = line.at("segments").size();
  record->num_pencils = line.at("pencils").size();
  record->camera = ReadCamera(line.at("camera"));
  record->camera_from = Get<std::string>(line, "camera_from");
  record->problems = Get<std::vector<std::string>>(line, "problems");
  record->flags = Get<std::vector<std::string>>(line, "flags");
}

}  // namespace

std::string SolverKey::ScaleText() const {
  if (!refined()) return "-";
  return scale_px > 0.0 ? FormatPlain(scale_px) : "auto";
}

std::string SolverKey::LossText() const { return refined() ? loss + ", " + ScaleText() : "-"; }

std::string SolverKey::Name() const {
  const std::string name = stage == "refined" ? solver + " refined" : solver;
  return refined() ? name + ", " + loss + " " + ScaleText() : name;
}

bool SolverKey::operator==(const SolverKey& other) const {
  return std::tie(solver, stage, loss, scale_px) ==
         std::tie(other.solver, other.stage, other.loss, other.scale_px);
}

bool IsSameLens(const Camera& a, const Camera& b) {
  return std::tie(a.model, a.fx, a.fy, a.cx, a.cy, a.distortion) ==
         std::tie(b.model, b.fx, b.fy, b.cx, b.cy, b.distortion);
}

std::vector<SolverKey> KeysOf(const ImageRecord& record) {
  std::vector<SolverKey> keys;
  for (const SolverRecord& solver : record.solvers) keys.push_back(solver.key);
  return keys;
}

Status ParseRecord(const ImageLines& lines, ImageRecord* record) {
  *record = {};
  try {
    ReadObservations(lines.observations, record);
    ReadResults(lines.results, record);
    ReadTimings(lines.timings, record);
  } catch (const std::exception& error) {  // Of the JSON, or of a name in it.
    return Status::Invalid(std::string("a line is not as this program writes it: ") + error.what());
  }
  return Status::Ok();
}

bool ReadLineCounts(const std::string& observation_line, LineCounts* counts) {
  const Json line = Json::parse(observation_line, nullptr, false);
  if (!line.is_object() || !line.contains("lines") || !line.contains("index")) return false;
  try {
    counts->index = line["index"].get<std::size_t>();
    counts->results = line["lines"].at("results").get<std::size_t>();
    counts->timings = line["lines"].at("timings").get<std::size_t>();
  } catch (const nlohmann::json::exception&) {
    return false;
  }
  return true;
}

std::array<int, 4> ShowRank(const std::string& solver, bool refined, double probability,
                            int num_observations) {
  return {std::isfinite(probability) ? 1 : 0, solver == kJoint ? 1 : 0, refined ? 1 : 0,
          num_observations};
}

std::array<int, 4> SolverRecord::Rank() const {
  const HypothesisRecord& first = hypotheses.front();
  return ShowRank(name(), key.refined(), first.probability, first.num_observations);
}

std::string FlagText(const std::vector<std::string>& flags) {
  return flags.empty() ? "the default flags" : JoinList(flags, " ");
}

}  // namespace circline::apps
