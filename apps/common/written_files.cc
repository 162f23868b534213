#include "apps/common/written_files.h"

#include <fnmatch.h>
#include <gflags/gflags.h>

#include <algorithm>
#include <utility>

#include "apps/common/flags_util.h"
#include "apps/common/text.h"

namespace circline::apps {

namespace fs = std::filesystem;

WrittenFiles::WrittenFiles(const std::string& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const fs::path path = fs::path(folder) / name;
    if (name.find('*') == std::string::npos) {
      files_.insert(Canonical(path));
    } else {
      patterns_.emplace_back(Canonical(path.parent_path()), path.filename().string());
    }
  }
}

bool WrittenFiles::Has(const std::string& path) {
  const fs::path canonical = Canonical(path);
  return files_.count(canonical) > 0 ||
         std::any_of(patterns_.begin(), patterns_.end(), [&](const auto& pattern) {
           return canonical.parent_path() == pattern.first &&
                  fnmatch(pattern.second.c_str(), canonical.filename().c_str(), 0) == 0;
         });
}

Status WrittenFiles::CheckKept(const std::vector<std::string>& read) {
  for (const std::string& path : read) {
    if (Has(path)) {
      return Status::Invalid(path +
                             ": is read, and would be written over by this run: "
                             "give another place to write to");
    }
  }
  return Status::Ok();
}

fs::path WrittenFiles::Canonical(const fs::path& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  if (!absolute.has_filename() || fs::is_symlink(absolute, error)) {
    const fs::path canonical = fs::weakly_canonical(absolute, error);
    return error ? absolute : canonical;  // Such as of a pipe, which has no name.
  }
  const auto [folder, is_new] = folders_.try_emplace(absolute.parent_path());
  if (is_new) folder->second = fs::weakly_canonical(absolute.parent_path(), error);
  return folder->second / absolute.filename();
}

std::vector<std::string> FilesOfFlags() {
  std::vector<std::string> files = FlagFiles();
  std::string value;
  for (const char* flag : {"scene", "camera", "noise_model", "timestamps"}) {
    // Not every app has them all.
    if (gflags::GetCommandLineOption(flag, &value) && !value.empty()) files.push_back(value);
  }
  if (gflags::GetCommandLineOption("plugin", &value) && !value.empty()) {
    for (std::string& library : SplitList(value)) files.push_back(std::move(library));
  }
  return files;
}

void RemoveFiles(const std::string& folder, const std::vector<std::string>& names) {
  WrittenFiles read("", FilesOfFlags());
  for (const std::string& name : names) {
    std::error_code error;
    const fs::path path = fs::path(folder) / name;
    const fs::file_status status = fs::symlink_status(path, error);
    if (!fs::is_regular_file(status) && !fs::is_symlink(status)) continue;
    if (!read.Has(path.string())) fs::remove(path, error);
  }
}

}  // namespace circline::apps
