#include "apps/studio/export_pose.h"

#include "apps/common/output_file.h"
#include "apps/compare/export.h"
#include "apps/reconstruct/measurements.h"
#include "apps/studio/answer.h"

namespace circline::apps {
namespace {

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

std::vector<std::string> ExportedFiles(const std::string& format) {
  if (format == "csv") return {"measurements.csv"};
  for (const ExportFormat& known : ExportFormats()) {
    if (known.name == format) return known.files;
  }
  throw RequestError(400, "'format' must be one of gltf, colmap, tum, csv");
}

Json ExportPose(const ImageRun& run, const Json& request, const std::string& folder) {
  if (!run.read_error.empty()) throw RequestError(422, run.read_error);
  const SolverRun* shown = RunToShow(run);
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
