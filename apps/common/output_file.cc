#include "apps/common/output_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

std::string FoldCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// At most so many bytes of a name, that it and what is appended to it fit into the 255 of a file
// system; not within a character of UTF-8.
std::string Shortened(std::string name) {
  constexpr std::size_t kMaxBytes = 200;
  if (name.size() <= kMaxBytes) return name;
  std::size_t end = kMaxBytes;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0) == 0x80) --end;
  name.resize(end);
  return name;
}

// The last `num_folders` folders of the path and its stem, joined by "_".
std::string StemWithFolders(const fs::path& path, int num_folders) {
  std::string stem = path.stem().string();
  fs::path folder = path.parent_path();
  for (int i = 0; i < num_folders && folder.has_filename(); ++i) {
    const std::string name = folder.filename().string();
    if (name != "." && name != "..") stem = name + "_" + stem;
    folder = folder.parent_path();
  }
  return Shortened(stem);
}

// What a symbolic link points at, be it there or not: the link stays.
std::string Followed(const std::string& path) {
  constexpr int kMaxLinks = 16;
  fs::path followed = path;
  std::error_code error;
  for (int i = 0; i < kMaxLinks && fs::is_symlink(followed, error); ++i) {
    const fs::path target = fs::read_symlink(followed, error);
    if (error) break;
    followed = followed.parent_path() / target;  // `target` alone where it is absolute.
  }
  return followed.string();
}

// A device or pipe, which is written to and not replaced.
bool IsSpecial(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

}  // namespace

OutputFile::OutputFile(const std::string& path)
    : path_(Followed(path)),
      temporary_path_(IsSpecial(path_) ? path_ : path_ + ".part"),
      stream_(temporary_path_, std::ios::binary) {}

OutputFile::~OutputFile() {
  if (committed_ || temporary_path_ == path_) return;
  stream_.close();
  std::error_code error;
  fs::remove(temporary_path_, error);
}

Status OutputFile::Commit() {
  stream_.close();
  std::error_code error;
  if (stream_ && temporary_path_ != path_) fs::rename(temporary_path_, path_, error);
  if (!stream_ || error) return Status::Failed(path_ + ": cannot be written");
  committed_ = true;
  return Status::Ok();
}

AppendFile::AppendFile(std::string path, std::uint64_t keep_bytes)
    : path_(std::move(path)),
      descriptor_(open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666)) {
  if (descriptor_ >= 0 && ftruncate(descriptor_, static_cast<off_t>(keep_bytes)) != 0) {
    close(descriptor_);
    descriptor_ = -1;
  }
}

AppendFile::~AppendFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

Status AppendFile::Append(const std::string& text) {
  std::size_t done = 0;
  while (descriptor_ >= 0 && done < text.size()) {
    const ssize_t written = write(descriptor_, text.data() + done, text.size() - done);
    if (written < 0 && errno != EINTR) break;
    if (written > 0) done += static_cast<std::size_t>(written);
  }
  if (descriptor_ >= 0 && done == text.size()) return Status::Ok();
  // Where the disk is full a part is there, which is taken back.
  const off_t end = descriptor_ >= 0 ? lseek(descriptor_, 0, SEEK_END) : -1;
  const bool taken_back = end < 0 || ftruncate(descriptor_, end - static_cast<off_t>(done)) == 0;
  return Status::Failed(path_ + ": cannot be written" +
                        (taken_back ? "" : "; its last line is cut off"));
}

Status WriteFile(const std::string& path, const std::string& content) {
  OutputFile file(path);
  file.Write(content);
  return file.Commit();
}

Status CanWriteFile(const std::string& path) {
  std::error_code error;
  const bool can = !fs::is_directory(path, error) && OutputFile(path).is_open();
  return can ? Status::Ok() : Status::Invalid(path + ": cannot be written");
}

Status CreateFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  std::error_code unknown;  // Where it cannot even be looked at, the first error says why.
  if (fs::is_directory(path, unknown)) return Status::Ok();
  return Status::Invalid(path + ": this folder cannot be created" +
                         (error ? " (" + error.message() + ")" : ""));
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

Status FolderLock::Acquire(const std::string& folder) {
  descriptor_ = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool taken = descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0;
  if (taken || errno != EWOULDBLOCK) return Status::Ok();
  return Status::Invalid(folder + ": another run is writing into this folder");
}

std::vector<std::string> UniqueStems(const std::vector<std::string>& paths) {
  constexpr int kMaxFolders = 8;
  std::vector<std::string> stems(paths.size());
  std::vector<std::size_t> open(paths.size());
  for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
  std::set<std::string> taken;
  for (int num_folders = 0; num_folders <= kMaxFolders && !open.empty(); ++num_folders) {
    std::map<std::string, int> count;
    for (const std::size_t i : open) ++count[FoldCase(StemWithFolders(paths[i], num_folders))];
    std::vector<std::size_t> still_open;
    for (const std::size_t i : open) {
      const std::string stem = StemWithFolders(paths[i], num_folders);
      if (count[FoldCase(stem)] == 1 && taken.count(FoldCase(stem)) == 0) {
        stems[i] = stem;
      } else {
        still_open.push_back(i);
      }
    }
    for (const std::size_t i : open) {
      if (!stems[i].empty()) taken.insert(FoldCase(stems[i]));
    }
    open = still_open;
  }
  // Same path twice, or names such as a.jpg and a.png. By stem: the number that was given last.
  std::map<std::string, int> numbers;
  for (const std::size_t i : open) {
    const std::string own = StemWithFolders(paths[i], 0);
    int& number = numbers[FoldCase(own)];
    do {
      stems[i] = ++number == 1 ? own : own + "_" + std::to_string(number);
    } while (!taken.insert(FoldCase(stems[i])).second);
  }
  return stems;
}

}  // namespace circline::apps
