// Files that appear whole or not at all, and names that do not overwrite one another.
#ifndef CIRCLINE_APPS_COMMON_OUTPUT_FILE_H_
#define CIRCLINE_APPS_COMMON_OUTPUT_FILE_H_

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

// Written under a temporary name (".part" appended); Commit gives it its own. Dropped if not
// committed.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  bool is_open() const { return stream_.is_open(); }
  void Write(const std::string& text) { stream_ << text; }
  // Not ok: names the file that could not be written.
  Status Commit();

 private:
  std::string path_, temporary_path_;
  std::ofstream stream_;
  bool committed_ = false;
};

// Grows under its own name; each Append is handed to the system at once, so that what was appended
// outlives this process however it ends. A kill in the midst of one may leave a part of it.
class AppendFile {
 public:
  // Keeps the first `keep_bytes` of what is there.
  AppendFile(std::string path, std::uint64_t keep_bytes);
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  // Not ok: names the file that could not be written, which is as it was.
  Status Append(const std::string& text);

 private:
  std::string path_;
  int descriptor_;
};

Status WriteFile(const std::string& path, const std::string& content);

// Whether WriteFile would succeed, as far as can be told without writing.
Status CanWriteFile(const std::string& path);

// Creates a folder and its parents. Not ok where that cannot be, or where a file has that name.
Status CreateFolder(const std::string& path);

// While it lives, no other process has the folder; ends with this process, however that ends.
class FolderLock {
 public:
  FolderLock() = default;
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  // Not ok: another process has it. Ok also where the file system knows no locks.
  Status Acquire(const std::string& folder);

 private:
  int descriptor_ = -1;
};

// One file name stem for each path, all different: the path's own stem where no other path has it,
// else with as many folders in front as it takes ("left/01.jpg" -> "left_01"), or a number.
std::vector<std::string> UniqueStems(const std::vector<std::string>& paths);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_OUTPUT_FILE_H_
