#include "apps/compare/export.h"

#include "apps/compare/record_files.h"

namespace circline::apps {

namespace {

// Programs take all poses of a file for one world of one unit.
std::string ScaleNote(int num_poses, int num_metric) {
  if (num_metric == num_poses) return "";
  return "exported poses: " + std::to_string(num_metric) + " of " + std::to_string(num_poses) +
         " have a scale, by a known radius or length; without, a translation has length 1, "
         "whatever "
         "the distance\n";
}

}  // namespace

Status WriteExports(const std::string& folder, const std::vector<std::string>& formats,
                    std::string* notes) {
  std::vector<std::unique_ptr<Exporter>> exporters;
  for (const std::string& format : formats) {
    if (format == "colmap") exporters.push_back(MakeColmapExporter(folder));
    if (format == "gltf") exporters.push_back(MakeGltfExporter(folder));
    if (format == "tum") exporters.push_back(MakeTumExporter(folder));
  }
  if (exporters.empty()) return Status::Ok();
  RecordReader reader(folder);
  ImageRecord record;
  int num_poses = 0, num_metric = 0;
  for (ImageLines lines; reader.Next(&lines);) {
    Status status = ParseRecord(lines, &record);
    if (!status.ok()) return status;
    const SolverRecord* shown = SolverToShow(record);
    if (shown == nullptr) continue;
    const HypothesisRecord& best = shown->hypotheses.front();
    ++num_poses;
    num_metric += best.metric ? 1 : 0;
    for (const auto& exporter : exporters) {
      exporter->Add({record.name, record.index, best.camera.value_or(record.camera), best.rotation,
                     best.translation, std::nullopt});
    }
  }
  for (const auto& exporter : exporters) {
    const Status status = exporter->Finish();
    if (!status.ok()) return status;
    if (const std::string note = exporter->Note(); !note.empty()) *notes += note + "\n";
  }
  *notes += ScaleNote(num_poses, num_metric);
  return Status::Ok();
}

}  // namespace circline::apps
