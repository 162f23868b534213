// Strict reading of OpenCV FileStorage documents (YAML, JSON): every value knows where it stands,
// and the first thing that is wrong becomes one sentence that names the place.
#ifndef CIRCLINE_APPS_COMMON_STORAGE_NODE_H_
#define CIRCLINE_APPS_COMMON_STORAGE_NODE_H_

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

// A value of a document. Reading one that has the wrong type or is missing notes the error (the
// first one wins) and returns an empty value, so that callers read on and look at the status once.
class StorageNode {
 public:
  StorageNode(const cv::FileNode& node, std::string place, Status* status)
      : node_(node), place_(std::move(place)), status_(status) {}

  bool Exists() const { return !node_.empty() && !node_.isNone(); }
  const std::string& place() const { return place_; }
  void set_place(std::string place) { place_ = std::move(place); }

  // Notes an error at this place.
  void Fail(const std::string& message) const;
  bool ok() const { return status_->ok(); }

  // Of a map: notes an error for a key that is not listed, or that stands there twice.
  void AllowKeys(const std::vector<std::string>& keys) const;
  StorageNode Get(const std::string& key) const;      // May not exist.
  StorageNode Require(const std::string& key) const;  // Notes an error if it does not.

  std::vector<StorageNode> Items() const;  // Of a list.
  std::string Text() const;                // A whole number is taken as text, too ("id: 3").
  double Number() const;
  int Integer() const;
  // A list of numbers, or a matrix (!!opencv-matrix), row by row. `count` and `multiple_of`, where
  // not 0, say how many there must be.
  std::vector<double> Numbers(std::size_t count = 0, std::size_t multiple_of = 0) const;

 private:
  bool RequireThat(bool condition, const std::string& expected) const;

  cv::FileNode node_;
  std::string place_;
  Status* status_;
};

// Opens a document held in memory until the object goes. YAML may come without OpenCV's "%YAML:1.0"
// header.
class StorageDocument {
 public:
  // Not ok: one line that names the file, and the line in it where the parser can tell.
  Status Open(const std::string& path);
  // The same of a text; messages call it `name`.
  Status Parse(const std::string& name, std::string text);
  cv::FileNode root() const { return storage_.root(); }

 private:
  std::string text_;
  cv::FileStorage storage_;
};

// The bytes of a file, without a byte order mark.
Status ReadTextFile(const std::string& path, std::string* text);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_STORAGE_NODE_H_
