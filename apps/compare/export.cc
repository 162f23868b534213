#include "apps/compare/export.h"

#include "apps/compare/record_files.h"

namespace circline::apps {

Status WriteExports(const std::string& folder, const std::vector<std::string>& formats) {
  std::vector<std::unique_ptr<Exporter>> exporters;
  for (const std::string& format : formats) {
    if (format == "colmap") exporters.push_back(MakeColmapExporter(folder));
    if (format == "gltf") exporters.push_back(MakeGltfExporter(folder));
    if (format == "tum") exporters.push_back(MakeTumExporter(folder));
  }
  if (exporters.empty()) return Status::Ok();
  RecordReader reader(folder);
  ImageRecord record;
  for (ImageLines lines; reader.Next(&lines);) {
    Status status = ParseRecord(lines, &record);
    if (!status.ok()) return status;
    const SolverRecord* shown = SolverToShow(record);
    if (shown == nullptr) continue;
    const HypothesisRecord& best = shown->hypotheses.front();
    for (const auto& exporter : exporters) {
      exporter->Add({record.name, record.index, Refocused(record.camera, best.focal_scale),
                     best.rotation, best.translation});
    }
  }
  for (const auto& exporter : exporters) {
    const Status status = exporter->Finish();
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

}  // namespace circline::apps
