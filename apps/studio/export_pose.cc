#include "apps/studio/export_pose.h"

#include <memory>

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

std::unique_ptr<Exporter> MakeExporter(const std::string& format, const std::string& folder) {
  if (format == "gltf") return MakeGltfExporter(folder);
  if (format == "colmap") return MakeColmapExporter(folder);
  return MakeTumExporter(folder);
}

}  // namespace

std::vector<std::string> ExportedFiles(const std::string& format) {
  if (format == "gltf") return {"cameras.gltf"};
  if (format == "colmap") return {"images.txt", "cameras.txt", "points3D.txt"};
  if (format == "tum") return {"trajectory.txt"};
  if (format == "csv") return {"measurements.csv"};
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
  const std::string format = request.at("format");
  std::string note;
  Status status;
  if (format == "csv") {
    status = WriteMeasurements(AskedMeasurements(request), hypothesis, run.observations.camera,
                               folder, &note);
  } else {
    const std::unique_ptr<Exporter> exporter = MakeExporter(format, folder);
    const CameraPose& pose = hypothesis.cam_from_world;
    exporter->Add(
        {run.image->name, run.image->index, camera, pose.rotation, pose.translation, std::nullopt});
    status = exporter->Finish();
    note = exporter->Note();
  }
  if (!status.ok()) throw RequestError(409, status.message);
  Json files = Json::array();
  for (const std::string& name : ExportedFiles(format)) files.push_back(folder + "/" + name);
  return {{"files", files}, {"note", note}};
}

}  // namespace circline::apps
