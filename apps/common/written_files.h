// What a run reads is not what it writes over.
#ifndef CIRCLINE_APPS_COMMON_WRITTEN_FILES_H_
#define CIRCLINE_APPS_COMMON_WRITTEN_FILES_H_

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

// The files that a run is about to write, or others, by any of their names, wherever links lead.
class WrittenFiles {
 public:
  // `names`: in that folder, which need not exist; a * in the last part stands for anything
  // ("overlays/*.png").
  WrittenFiles(const std::string& folder, const std::vector<std::string>& names);

  bool Has(const std::string& path);
  // Not ok: one line that names the first of the paths that the run would read and write.
  Status CheckKept(const std::vector<std::string>& read);

 private:
  std::filesystem::path Canonical(const std::filesystem::path& path);

  std::set<std::filesystem::path> files_;
  std::vector<std::pair<std::filesystem::path, std::string>> patterns_;  // Folder and name.
  // Photos lie in few folders, and looking links up takes the time of reading a file.
  std::map<std::filesystem::path, std::filesystem::path> folders_;
};

// The files, beside photos, that the command line has named: flag files, scene, camera and others.
std::vector<std::string> FilesOfFlags();

// Removes files of an earlier run, by their names in that folder: no folders, and none of those
// that flags of this run have named.
void RemoveFiles(const std::string& folder, const std::vector<std::string>& names);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_WRITTEN_FILES_H_
