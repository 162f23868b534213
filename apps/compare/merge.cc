#include "apps/compare/merge.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/compare/record_files.h"
#include "apps/compare/resume.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

// One folder with its next image.
struct Source {
  explicit Source(std::string f) : folder(std::move(f)), reader(folder) { Advance(); }
  void Advance() {
    LineCounts counts;
    has_next = reader.Next(&lines) && ReadLineCounts(lines.observations, &counts);
    index = counts.index;
  }

  std::string folder;
  RecordReader reader;
  ImageLines lines;
  bool has_next = false;
  std::size_t index = 0;
};

// All images of all folders, by index.
class Merger {
 public:
  explicit Merger(const std::vector<std::string>& folders) {
    for (const std::string& folder : folders) sources_.push_back(std::make_unique<Source>(folder));
  }
  // Null after the last one. The lines are valid until the next call.
  const Source* Next() {
    if (current_ != nullptr) current_->Advance();
    current_ = nullptr;
    for (const auto& source : sources_) {
      if (!source->has_next) continue;
      if (current_ == nullptr || source->index < current_->index) current_ = source.get();
    }
    return current_;
  }

 private:
  std::vector<std::unique_ptr<Source>> sources_;
  Source* current_ = nullptr;
};

Status CheckFolders(const std::vector<std::string>& folders, const std::string& output) {
  for (const std::string& folder : folders) {
    std::error_code error;
    if (!fs::exists(folder + "/results.jsonl", error)) {
      return Status::Invalid("--merge: " + folder + " has no results.jsonl");
    }
    if (IsUnfinished(folder)) {
      return Status::Invalid("--merge: " + folder +
                             " is not finished; run that shard again with "
                             "--resume");
    }
    if (fs::equivalent(folder, output, error)) {
      return Status::Invalid("--merge: " + folder + " is the output folder itself");
    }
  }
  return Status::Ok();
}

// Every index of the set once, the same solvers and flags everywhere.
Status CheckImages(const std::vector<std::string>& folders) {
  Merger merger(folders);
  std::size_t expected = 0, set_size = 0;
  std::optional<std::vector<SolverKey>> keys;
  std::vector<std::string> flags;
  while (const Source* source = merger.Next()) {
    ImageRecord record;
    const Status status = ParseRecord(source->lines, &record);
    if (!status.ok()) return Status::Invalid("--merge: " + source->folder + ": " + status.message);
    if (source->index != expected) {
      const bool twice = source->index < expected;
      return Status::Invalid(
          "--merge: image " + std::to_string(twice ? source->index : expected) +
          (twice ? " (" + record.name + ") is there twice" : " is missing: is a shard not named?"));
    }
    if (expected++ == 0) {
      set_size = record.set_size;
      flags = record.flags;
    }
    if (record.set_size != set_size) {
      return Status::Invalid("--merge: " + source->folder + " is of a set of " +
                             std::to_string(record.set_size) + " images, not " +
                             std::to_string(set_size));
    }
    if (record.flags != flags) {
      return Status::Invalid("--merge: " + source->folder + " ran with " + FlagText(record.flags) +
                             ", others with " + FlagText(flags));
    }
    if (!record.error.empty()) continue;
    if (!keys) keys = KeysOf(record);
    if (*keys != KeysOf(record)) {
      return Status::Invalid("--merge: " + source->folder + " ran other solvers or losses");
    }
  }
  if (expected < set_size) {
    return Status::Invalid("--merge: image " + std::to_string(expected) + " of " +
                           std::to_string(set_size) + " is missing: is a shard not named?");
  }
  return expected > 0 ? Status::Ok() : Status::Invalid("--merge: there are no images");
}

Status CopyOverlays(const std::string& from, const std::string& to) {
  std::error_code error;
  if (!fs::is_directory(from + "/overlays", error)) return Status::Ok();
  const Status status = CreateFolder(to + "/overlays");
  if (!status.ok()) return status;
  fs::copy(from + "/overlays", to + "/overlays",
           fs::copy_options::recursive | fs::copy_options::overwrite_existing, error);
  return error ? Status::Failed(to + "/overlays: " + error.message()) : Status::Ok();
}

}  // namespace

Status MergeFolders(const std::vector<std::string>& folders, const std::string& output) {
  Status status = CheckFolders(folders, output);
  if (status.ok()) status = CheckImages(folders);
  if (status.ok()) status = CreateFolder(output);
  FolderLock lock;
  if (status.ok()) status = lock.Acquire(output);
  if (!status.ok()) return status;
  RecordWriter writer(output, {});
  Merger merger(folders);
  while (const Source* source = merger.Next()) {
    ImageRecord record;
    status = ParseRecord(source->lines, &record);
    if (status.ok() && !record.error.empty()) SayOnStderr(record.name + ": " + record.error);
    if (status.ok()) status = writer.Append(source->lines);
    if (!status.ok()) return status;
  }
  for (const std::string& folder : folders) {
    status = CopyOverlays(folder, output);
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

}  // namespace circline::apps
