#include "apps/compare/merge.h"

#include <algorithm>
#include <filesystem>
#include <map>
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
  void Advance() { has_next = reader.Next(&lines); }
  std::size_t index() const { return reader.index(); }

  std::string folder;
  RecordReader reader;
  ImageLines lines;
  bool has_next = false;
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
      if (current_ == nullptr || source->index() < current_->index()) current_ = source.get();
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

// What the photos of one run have in common.
class OneRun {
 public:
  // What is not as in the records before, to follow the name of its folder; empty where nothing is.
  std::string Add(const ImageRecord& record) {
    if (!first_) first_ = record;
    if (record.set_size != first_->set_size) {
      return " is of a set of " + std::to_string(record.set_size) + " images, not " +
             std::to_string(first_->set_size);
    }
    if (record.flags != first_->flags)
      return " ran with " + FlagText(record.flags) + ", others with " + FlagText(first_->flags);
    if (!record.error.empty()) return "";
    const bool guessed = !record.camera_from.empty();
    if (cameras_.empty()) {
      keys_ = KeysOf(record);
      guessed_ = guessed;
    }
    if (keys_ != KeysOf(record)) return " ran other solvers or losses";
    const Camera& camera = cameras_.emplace(record.camera.id, record.camera).first->second;
    const bool same = guessed == guessed_ && (guessed || IsSameLens(camera, record.camera));
    return same ? "" : " ran with another camera '" + record.camera.id + "'";
  }
  std::size_t set_size() const { return first_ ? first_->set_size : 0; }

 private:
  std::optional<ImageRecord> first_;
  std::vector<SolverKey> keys_;
  std::map<std::string, Camera> cameras_;  // By id, of the photos that could be used.
  bool guessed_ = false;                   // Those cameras; each photo has one of its own.
};

// Every index of the set once, of one run.
Status CheckImages(const std::vector<std::string>& folders) {
  Merger merger(folders);
  OneRun run;
  std::size_t expected = 0;
  while (const Source* source = merger.Next()) {
    ImageRecord record;
    const Status status = ParseRecord(source->lines, &record);
    if (!status.ok()) return Status::Invalid("--merge: " + source->folder + ": " + status.message);
    if (source->index() != expected) {
      const bool twice = source->index() < expected;
      return Status::Invalid(
          "--merge: image " + std::to_string(twice ? source->index() : expected) +
          (twice ? " (" + record.name + ") is there twice" : " is missing: is a shard not named?"));
    }
    ++expected;
    const std::string difference = run.Add(record);
    if (!difference.empty()) return Status::Invalid("--merge: " + source->folder + difference);
  }
  if (expected < run.set_size()) {
    return Status::Invalid("--merge: image " + std::to_string(expected) + " of " +
                           std::to_string(run.set_size()) + " is missing: is a shard not named?");
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
  if (status.ok()) status = CheckResultFiles(output);
  if (status.ok()) status = CreateFolder(output);
  FolderLock lock;
  if (status.ok()) status = lock.Acquire(output);
  if (!status.ok()) return status;
  RemoveEarlierRun(output);
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
  MarkFinished(output);  // Of a run that was stopped there before.
  return Status::Ok();
}

}  // namespace circline::apps
