// Strict reading of YAML and JSON documents, those of OpenCV's FileStorage among them: every value
// knows where it stands, and the first thing that is wrong becomes one sentence that names the
// place.
#ifndef CIRCLINE_APPS_COMMON_STORAGE_NODE_H_
#define CIRCLINE_APPS_COMMON_STORAGE_NODE_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

// A value of a document. Reading one that has the wrong type or is missing notes the error (the
// first one wins) and returns an empty value, so that callers read on and look at the status once.
class StorageNode {
 public:
  using Json = nlohmann::ordered_json;

  // Views a value of a document that outlives it; nullptr is one that does not exist.
  StorageNode(const Json* node, std::string place, Status* status)
      : node_(node), place_(std::move(place)), status_(status) {}

  bool Exists() const;  // A null does not.
  const std::string& place() const { return place_; }
  void set_place(std::string place) { place_ = std::move(place); }

  // Notes an error at this place.
  void Fail(const std::string& message) const;
  bool ok() const { return status_->ok(); }

  // Of a map: notes an error for a key that is not listed.
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

  const Json* node_;
  std::string place_;
  Status* status_;
};

// Parses a text that must be a map of keys and values; messages call it `name`. Not ok: one line,
// with the line of the text where the parser can tell.
Status ParseStorage(const std::string& name, const std::string& text, StorageNode::Json* root);
// The same of a file.
Status ReadStorage(const std::string& path, StorageNode::Json* root);

// The bytes of a file, without a byte order mark.
Status ReadTextFile(const std::string& path, std::string* text);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_STORAGE_NODE_H_
