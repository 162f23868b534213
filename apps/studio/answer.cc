#include "apps/studio/answer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/common/document.h"
#include "apps/common/output_file.h"
#include "apps/compare/export.h"
#include "apps/compare/pose_curves.h"
#include "apps/compare/results.h"
#include "apps/reconstruct/measurements.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/metrology.h"

namespace circline::apps {
namespace {

constexpr std::size_t kMaxMeasurements = 200;

double Rounded(double value, double steps) { return std::round(value * steps) / steps; }

Json PixelJson(const Eigen::Vector2d& pixel) {
  if (!pixel.allFinite()) return nullptr;
  return {Rounded(pixel.x(), 100.0), Rounded(pixel.y(), 100.0)};
}

Json CurveJson(const PixelCurve& curve) {
  Json json = Json::array();
  for (const Eigen::Vector2d& pixel : curve) json.push_back(PixelJson(pixel));
  return json;
}

template <typename Curves>
Json CurvesJson(const Curves& curves) {
  Json json = Json::array();
  for (const PixelCurve& curve : curves) json.push_back(CurveJson(curve));
  return json;
}

Json DrawingJson(const ImageRun& run, const PoseHypothesis& hypothesis) {
  const PoseCurves curves =
      CurvesOfPose(run.observations, hypothesis, run.photo.cols, run.photo.rows);
  Json circles = Json::array();
  for (const CircleEstimate& circle : hypothesis.circles) {
    const bool seen = circle.center_px.allFinite() && !circle.center_px.isZero();
    circles.push_back({{"id", circle.id},
                       {"center_px", seen ? PixelJson(circle.center_px) : Json()},
                       {"center", JsonNumbers(circle.center)},
                       {"normal", JsonNumbers(circle.normal)},
                       {"radius", circle.radius}});
  }
  return {{"grid", CurvesJson(curves.grid)},
          {"horizon", CurveJson(curves.vanishing_line)},
          {"origin", curves.axes[0].empty() ? Json() : PixelJson(curves.origin)},
          {"axes", CurvesJson(curves.axes)},
          {"box", CurvesJson(curves.box)},
          {"rotation_is_free", hypothesis.RotationIsFree()},
          {"circles", circles}};
}

std::vector<Eigen::Vector2d> Points(const Json& asked, std::size_t count) {
  const auto list = asked.find("points");
  if (list == asked.end() || !list->is_array() || list->size() != 2 * count) {
    throw RequestError(400, "a measurement must have " + std::to_string(count) + " points");
  }
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const Json &u = (*list)[2 * i], &v = (*list)[2 * i + 1];
    if (!u.is_number() || !v.is_number())
      throw RequestError(400, "a measurement's points must be numbers");
    points.emplace_back(u.get<double>(), v.get<double>());
  }
  return points;
}

bool Measure(const std::string& kind, const std::vector<Eigen::Vector2d>& p, double sigma_px,
             const PoseHypothesis& hypothesis, const Camera& camera, Measurement* value) {
  if (kind == "length") return LengthOnPlane(hypothesis, camera, {p[0], p[1]}, sigma_px, value);
  if (kind == "height") return HeightOverPlane(hypothesis, camera, {p[0], p[1]}, sigma_px, value);
  if (!AngleOnPlane(hypothesis, camera, {p[0], p[1], p[2], p[3]}, sigma_px, value)) return false;
  // Lines have no sense, so that their angle is an acute one.
  const double degrees = std::abs(value->value) / kDegree;
  value->value = std::min(degrees, 180.0 - degrees);
  value->sigma /= kDegree;
  return true;
}

// A request's `measure`, checked: a list, and not too long a one; empty where there is none.
Json AskedMeasurements(const Json& request) {
  Json asked = request.value("measure", Json::array());
  if (!asked.is_array()) throw RequestError(400, "'measure' must be a list");
  if (asked.size() > kMaxMeasurements) throw RequestError(413, "more than 200 measurements");
  return asked;
}

// Which hypothesis of so many a request speaks of: the first unless it says so.
std::size_t ChosenHypothesis(const Json& request, std::size_t count) {
  const auto chosen = request.find("hypothesis");
  if (chosen == request.end()) return 0;
  if (chosen->is_number_integer() && *chosen >= 0 && *chosen < count)
    return chosen->get<std::size_t>();
  throw RequestError(400, "'hypothesis' must be a whole number, 0 to " + std::to_string(count - 1) +
                              ": there are " + std::to_string(count));
}

// `note`: how many cannot be had.
Status WriteMeasurements(const Json& asked, const PoseHypothesis& hypothesis, const Camera& camera,
                         const std::string& folder, std::string* note) {
  std::vector<MeasuredValue> values;
  std::size_t number = 0;
  for (const Json& item : asked) {
    ++number;
    const Json measured = Measured(item, hypothesis, camera);
    if (!measured["value"].is_number()) continue;
    values.push_back({measured["what"], item.value("id", std::to_string(number)), measured["value"],
                      measured["sigma"], measured["unit"]});
  }
  if (values.size() < number) {
    *note = std::to_string(number - values.size()) + " of " + std::to_string(number) +
            " measurements cannot be had, as they are not on this side of the plane's horizon, and "
            "are left out";
  }
  return WriteFile(folder + "/measurements.csv", MeasurementsCsv(values));
}

}  // namespace

Json DetectionJson(const ImageRun& run, const NoiseModel& noise) {
  Json line = ObservationLine(run, "", {}, noise, {});
  Json contours = Json::object(), sigmas = Json::object();
  for (const CircleObservation& circle : run.observations.circles) {
    Json contour = Json::array();
    for (std::size_t i = 0; i < circle.points.size(); ++i) {
      if (!circle.inliers.empty() && circle.inliers[i] == 0) continue;
      contour.push_back(Rounded(circle.points[i].x(), 1000.0));
      contour.push_back(Rounded(circle.points[i].y(), 1000.0));
    }
    contours[circle.id] = std::move(contour);
    sigmas[circle.id] = circle.sigma_px > 0.0 ? Json(circle.sigma_px) : Json();
  }
  line["contours"] = std::move(contours);
  line["contour_sigma_px"] = std::move(sigmas);
  line["width"] = run.photo.cols;
  line["height"] = run.photo.rows;
  return line;
}

const Json& Required(const Json& request, const char* key) {
  const auto value = request.find(key);
  if (value == request.end()) throw RequestError(400, std::string("'") + key + "' is missing");
  return *value;
}

Json Measured(const Json& asked, const PoseHypothesis& hypothesis, const Camera& camera) {
  const std::string kind = asked.is_object() ? asked.value("kind", "") : "";
  if (kind != "length" && kind != "height" && kind != "angle")
    throw RequestError(400, "a measurement's kind must be length, height or angle");
  const std::vector<Eigen::Vector2d> points = Points(asked, kind == "angle" ? 4 : 2);
  const double sigma_px = asked.value("sigma_px", 1.0);
  if (!(sigma_px > 0.0 && sigma_px <= 100.0))
    throw RequestError(400, "a measurement's sigma_px must be positive, and at most 100");
  Json json = {{"what", kind}};
  json["unit"] = kind == "angle" ? "deg" : hypothesis.metric ? "world" : "distance";
  Measurement measured;
  if (Measure(kind, points, sigma_px, hypothesis, camera, &measured)) {
    json["value"] = measured.value;
    json["sigma"] = measured.sigma;
  } else {
    json["value"] = json["sigma"] = nullptr;
    json["error"] = "it is not on this side of the plane's horizon";
  }
  return json;
}

Json EstimateJson(const ImageRun& run, const Json& request) {
  if (!run.read_error.empty()) throw RequestError(422, run.read_error);
  if (run.solvers.empty()) throw RequestError(500, "there is no solver");
  const Json asked = AskedMeasurements(request);
  const PoseEstimate& estimate = run.solvers.front().estimate;
  const bool ok = estimate.status.ok() && !estimate.hypotheses.empty();
  Json json = {{"status", ok ? "ok" : StatusCodeName(estimate.status.code)},
               {"message", estimate.status.message},
               {"notes", estimate.notes}};
  for (const std::string& problem : run.problems) json["notes"].push_back(problem);
  json["decided_by"] = estimate.decided_by;
  json["camera"] = CameraEntry(run.image->observations.camera, {});
  for (const char* list : {"hypotheses", "drawings", "measurements"}) json[list] = Json::array();
  if (!ok) return json;
  for (Json& line : ResultLines(run)) json["hypotheses"].push_back(std::move(line));
  for (const PoseHypothesis& hypothesis : estimate.hypotheses)
    json["drawings"].push_back(DrawingJson(run, hypothesis));
  const std::size_t chosen = ChosenHypothesis(request, estimate.hypotheses.size());
  const PoseHypothesis& hypothesis = estimate.hypotheses[chosen];
  for (const Json& item : asked) {
    json["measurements"].push_back(Measured(item, hypothesis, run.observations.camera));
  }
  return json;
}

std::vector<std::string> ExportedFiles(const std::string& format) {
  if (format == "csv") return {"measurements.csv"};
  for (const ExportFormat& known : ExportFormats()) {
    if (known.name == format) return known.files;
  }
  throw RequestError(400, "'format' must be one of gltf, colmap, tum, csv");
}

Json ExportPose(const ImageRun& run, const Json& request, const std::string& folder) {
  if (!run.read_error.empty()) throw RequestError(422, run.read_error);
  const SolverRun* shown = AnswerToShow(run.solvers);
  if (shown == nullptr) {
    throw RequestError(422, "there is no pose: " + run.solvers.front().estimate.status.message);
  }
  const std::vector<PoseHypothesis>& hypotheses = shown->estimate.hypotheses;
  const PoseHypothesis& hypothesis = hypotheses[ChosenHypothesis(request, hypotheses.size())];
  Camera camera = CameraOf(hypothesis, run.observations.camera);
  camera.width = run.photo.cols;
  camera.height = run.photo.rows;
  const std::string format = Required(request, "format");
  std::string note;
  Status status;
  if (format == "csv") {
    status = WriteMeasurements(AskedMeasurements(request), hypothesis, run.observations.camera,
                               folder, &note);
  } else {
    status = ExportPoses(format,
                         {{run.image->name, run.image->index, camera, hypothesis.cam_from_world}},
                         folder, &note);
  }
  if (!status.ok()) throw RequestError(409, status.message);
  Json files = Json::array();
  for (const std::string& name : ExportedFiles(format)) files.push_back(folder + "/" + name);
  return {{"files", files}, {"note", note}};
}

}  // namespace circline::apps
