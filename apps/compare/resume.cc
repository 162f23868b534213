#include "apps/compare/resume.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/common/document.h"
#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/common/photo_file.h"
#include "apps/common/storage_node.h"
#include "apps/common/written_files.h"
#include "apps/compare/export.h"
#include "apps/compare/record_files.h"
#include "apps/compare/results.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kResults[] = {"results.jsonl", "observations.jsonl", "timings.jsonl",
                                    "summary.csv", "report.html"};

// Lies in the folder while photos are missing, and says with which flags the run was begun.
std::string MarkerPath(const std::string& folder) { return folder + "/unfinished.flags"; }

Status OtherRun(const std::string& folder, const std::string& what) {
  return Status::Invalid("--resume: " + folder + " has the results of another run: " + what +
                         "; give another --output, or leave --resume out to begin anew");
}

// The first line in which they differ.
std::string FirstDifference(const std::string& before, const std::string& now) {
  std::istringstream a(before), b(now);
  std::string line_a, line_b;
  while (std::getline(a, line_a) && std::getline(b, line_b)) {
    if (line_a != line_b) return line_a + ", now " + line_b;
  }
  return "its flags differ";
}

Status CheckFlags(const std::string& folder, const std::string& flags) {
  std::string before;
  if (!IsUnfinished(folder) || !ReadTextFile(MarkerPath(folder), &before).ok()) return Status::Ok();
  return before == flags ? Status::Ok() : OtherRun(folder, FirstDifference(before, flags));
}

// Flags say how a camera is guessed.
bool IsSameCamera(const ImageRecord& record, const SceneImage& image, bool guess) {
  if (guess || !record.camera_from.empty()) return guess && !record.camera_from.empty();
  return IsSameLens(record.camera, image.observations.camera);
}

Status FindDone(const CompareOptions& options, const ImageSet& images,
                const std::vector<SolverKey>& solvers, DonePart* done) {
  const std::string& folder = options.output;
  RecordReader reader(folder);
  ImageRecord record;
  for (ImageLines lines; reader.Next(&lines);) {
    if (!ParseRecord(lines, &record).ok()) return Status::Ok();  // Done again from here on.
    if (done->images >= images.size()) return OtherRun(folder, "it has more images");
    const std::string name = TextAsWritten(images.name(done->images));
    if (record.name != name || record.index != images.index(done->images)) {
      return OtherRun(folder, "its image " + std::to_string(done->images + 1) + " is " +
                                  record.name + ", not " + name);
    }
    const SceneImage image = images.At(done->images);
    if (record.set_size != image.set_size)
      return OtherRun(folder, "it is of a set of " + std::to_string(record.set_size) + " images");
    if (record.error.empty() && KeysOf(record) != solvers)
      return OtherRun(folder, "its solvers or losses differ");
    if (record.error.empty() && !IsSameCamera(record, image, options.inputs.guess.wanted))
      return OtherRun(folder, "the camera of " + name + " differs");
    if (record.flags != options.unusual_flags) {
      return OtherRun(folder, "it was made with " + FlagText(record.flags) + ", not with " +
                                  FlagText(options.unusual_flags));
    }
    // The lines stand in the order of the images: what follows is done again, too.
    if (record.photo_file && !(*record.photo_file == StateOf(images.path(done->images)))) {
      SayOnStderr(images.path(done->images) +
                  ": has changed, and is done again with what follows it");
      return Status::Ok();
    }
    if (!record.error.empty()) SayOnStderr(images.path(done->images) + ": " + record.error);
    ++done->images;
    done->bytes = reader.bytes_read();
  }
  return Status::Ok();
}

// Pictures in overlays/, and nothing elsewhere whatever the file says.
std::vector<std::string> OverlaysOfRun(const std::string& folder) {
  std::vector<std::string> names;
  std::ifstream file(folder + "/observations.jsonl", std::ios::binary);
  for (std::string line; std::getline(file, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object() || !json.contains("overlay") || !json["overlay"].is_string()) continue;
    const auto name = json["overlay"].get<std::string>();
    const fs::path path = name;
    if (path.parent_path() == "overlays" && path.extension() == ".png") names.push_back(name);
  }
  return names;
}

// What was being written when the run was stopped; nothing that is not its own.
void RemoveParts(const std::string& folder) {
  std::error_code error;
  for (const char* name : {"summary.csv", "report.html", "unfinished.flags"})
    fs::remove(folder + "/" + name + ".part", error);
  for (const auto& entry : fs::directory_iterator(folder + "/overlays", error)) {
    const fs::path& path = entry.path();
    if (path.extension() == ".part" && path.stem().extension() == ".png") fs::remove(path, error);
  }
}

}  // namespace

void RemoveEarlierRun(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  // Else what poses there are may be of circline_calibrate.
  if (fs::exists(folder + "/observations.jsonl", error) &&
      !fs::exists(folder + "/calibration.json", error)) {
    names = ExportedFilesIn(folder);
  }
  const std::vector<std::string> overlays = OverlaysOfRun(folder);
  names.insert(names.end(), overlays.begin(), overlays.end());
  names.insert(names.end(), std::begin(kResults), std::end(kResults));
  RemoveFiles(folder, names);
}

Status CheckResultFiles(const std::string& folder) {
  for (const char* name : kResults) {
    std::error_code error;
    const std::string path = folder + "/" + name;
    const fs::file_status status = fs::status(path, error);
    if (fs::exists(status) && !fs::is_regular_file(status))
      return Status::Invalid(path + ": is no file, and is not replaced by one");
  }
  return Status::Ok();
}

Status PrepareFolder(const CompareOptions& options, const ImageSet& images,
                     const std::vector<SolverKey>& solvers, DonePart* done) {
  const std::string& folder = options.output;
  *done = {};
  Status status = CheckResultFiles(folder);
  if (status.ok() && options.resume) {
    status = CheckFlags(folder, options.result_flags);
    if (status.ok()) status = FindDone(options, images, solvers, done);
  }
  if (!status.ok()) return status;
  if (!options.resume) RemoveEarlierRun(folder);
  RemoveParts(folder);
  return WriteFile(MarkerPath(folder), options.result_flags);
}

void MarkFinished(const std::string& folder) {
  std::error_code error;
  fs::remove(MarkerPath(folder), error);
}

bool IsUnfinished(const std::string& folder) {
  std::error_code error;
  return fs::exists(MarkerPath(folder), error);
}

}  // namespace circline::apps
