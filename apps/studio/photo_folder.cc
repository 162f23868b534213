#include "apps/studio/photo_folder.h"

#include <algorithm>
#include <filesystem>

#include "apps/common/photo_list.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

bool IsInside(const fs::path& path, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first ==
         folder.end();
}

}  // namespace

Status PhotoFolder::Open(const std::string& path) {
  std::error_code error;
  const fs::path folder = fs::canonical(path, error);
  if (error || !fs::is_directory(folder, error)) {
    return Status::Invalid("--images=" + path + ": must be a folder with photos");
  }
  path_ = folder.string();
  names_.clear();
  for (const std::string& photo : PhotosInFolder(path_)) {
    names_.push_back(fs::path(photo).filename().string());
  }
  return names_.empty() ? Status::Invalid("--images=" + path + ": has no photo in it")
                        : Status::Ok();
}

std::size_t PhotoFolder::Find(const std::string& name) const {
  const auto found = std::lower_bound(names_.begin(), names_.end(), name);
  return found != names_.end() && *found == name ? static_cast<std::size_t>(found - names_.begin())
                                                 : names_.size();
}

Status PhotoFolder::PhotoPath(std::size_t n, std::string* path) const {
  std::error_code error;
  const fs::path file = fs::canonical(fs::path(path_) / names_[n], error);
  if (error) return Status::Failed(names_[n] + ": " + error.message());
  if (!IsInside(file, path_)) {
    return Status::Refused(names_[n] + " is a link that leads out of the folder");
  }
  *path = file.string();
  return Status::Ok();
}

Status PhotoFolder::OwnPath(const std::string& name, std::string* path) const {
  fs::path place = path_;
  for (const fs::path& part : fs::path(name)) {
    place /= part;
    // The second is the name under which a file is written at first (output_file.h).
    for (const fs::path& taken : {place, fs::path(place.string() + ".part")}) {
      std::error_code error;
      if (fs::is_symlink(fs::symlink_status(taken, error))) {
        return Status::Refused(taken.string() + " is a link: nothing is written through it");
      }
    }
  }
  *path = place.string();
  return Status::Ok();
}

}  // namespace circline::apps
