#ifndef CIRCLINE_TESTS_APPS_SMALL_DISK_H_
#define CIRCLINE_TESTS_APPS_SMALL_DISK_H_

#include <sys/mount.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

namespace circline::apps {

// A file system of a test's own, which no other process fills. Only root may mount one.
class SmallDisk {
 public:
  explicit SmallDisk(std::string path) : path_(std::move(path)) {
    std::filesystem::create_directories(path_);
    mounted_ = mount("tmpfs", path_.c_str(), "tmpfs", 0, "size=1m") == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  bool mounted() const { return mounted_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  // Emptied, of that size.
  bool Renew(std::uintmax_t kilobytes, bool read_only = false) const {
    for (const auto& entry : std::filesystem::directory_iterator(path_))
      std::filesystem::remove_all(entry.path());
    const std::string size = "size=" + std::to_string(kilobytes) + "k";
    const unsigned long flags = MS_REMOUNT | (read_only ? MS_RDONLY : 0);
    return mount("tmpfs", path_.c_str(), "tmpfs", flags, size.c_str()) == 0;
  }

 private:
  std::string path_;
  bool mounted_ = false;
};

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_SMALL_DISK_H_
