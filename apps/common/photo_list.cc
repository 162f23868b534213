#include "apps/common/photo_list.h"

#include <glob.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <set>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

// Letters' case does not count.
bool IsPhotoName(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static const auto* const known = new std::set<std::string>{
      ".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".webp", ".jp2"};
  return known->count(extension) > 0;
}

std::vector<std::string> MatchWildcard(const std::string& pattern) {
  std::vector<std::string> paths;
  glob_t found{};
  if (glob(pattern.c_str(), GLOB_TILDE, nullptr, &found) == 0) {
    for (std::size_t i = 0; i < found.gl_pathc; ++i) paths.emplace_back(found.gl_pathv[i]);
  }
  globfree(&found);
  std::sort(paths.begin(), paths.end());
  return paths;
}

Status ExpandPattern(const std::string& pattern, std::vector<std::string>* paths) {
  std::error_code error;
  if (std::filesystem::exists(pattern, error)) {  // Also a file whose name has wildcard letters.
    const bool is_folder = std::filesystem::is_directory(pattern, error);
    *paths = is_folder ? PhotosInFolder(pattern) : std::vector<std::string>{pattern};
    if (paths->empty()) return Status::Invalid("--images: no photo in the folder " + pattern);
    return Status::Ok();
  }
  if (pattern.find_first_of("*?[") == std::string::npos) {
    if (!IsPhotoName(pattern)) return Status::Invalid("--images: there is no folder " + pattern);
    *paths = {pattern};
    return Status::Ok();
  }
  *paths = MatchWildcard(pattern);
  return paths->empty() ? Status::Invalid("--images: nothing matches " + pattern) : Status::Ok();
}

}  // namespace

std::vector<std::string> PhotosInFolder(const std::string& folder) {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (!entry.is_directory(error) && IsPhotoName(entry.path().string())) {
      paths.push_back(entry.path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

Status ListPhotos(const std::string& patterns, std::vector<std::string>* paths) {
  paths->clear();
  std::error_code error;
  const bool is_one = std::filesystem::exists(patterns, error);
  for (const std::string& pattern :
       is_one ? std::vector<std::string>{patterns} : SplitList(patterns)) {
    if (pattern.empty()) continue;
    std::vector<std::string> named;
    const Status status = ExpandPattern(pattern, &named);
    if (!status.ok()) return status;
    paths->insert(paths->end(), named.begin(), named.end());
  }
  return paths->empty() ? Status::Invalid("--images: names no photo") : Status::Ok();
}

}  // namespace circline::apps
