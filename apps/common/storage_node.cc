#include "apps/common/storage_node.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/common/document.h"
#include "apps/common/text.h"
#include "circline/estimators/status.h"

namespace circline::apps {
namespace {

bool StartsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

// A whole number, too ("id: 3").
bool IsText(const nlohmann::ordered_json& node) {
  return node.is_string() || node.is_number_integer();
}

}  // namespace

Status ReadTextFile(const std::string& path, std::string* text) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return Status::Invalid(path + ": is a folder, not a file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::Invalid(path + ": cannot be opened");
  constexpr std::size_t kMaxBytes = std::size_t{256} << 20;
  text->clear();
  std::vector<char> piece(std::size_t{1} << 16);
  while (file.read(piece.data(), static_cast<std::streamsize>(piece.size())) || file.gcount() > 0) {
    text->append(piece.data(), static_cast<std::size_t>(file.gcount()));
    if (text->size() > kMaxBytes) return Status::Invalid(path + ": is larger than 256 MB");
  }
  if (StartsWith(*text, "\xEF\xBB\xBF")) text->erase(0, 3);
  return Status::Ok();
}

Status ParseStorage(const std::string& name, const std::string& text, StorageNode::Json* root) {
  const Status status = ParseDocument(text, root);
  if (!status.ok()) return Status::Invalid(name + ": " + status.message);
  if (root->is_object()) return Status::Ok();
  return Status::Invalid(name + ": not a YAML or JSON document with keys and values");
}

Status ReadStorage(const std::string& path, StorageNode::Json* root) {
  std::string text;
  const Status status = ReadTextFile(path, &text);
  return status.ok() ? ParseStorage(path, text, root) : status;
}

bool StorageNode::Exists() const { return node_ != nullptr && !node_->is_null(); }

void StorageNode::Fail(const std::string& message) const {
  if (!status_->ok()) return;
  *status_ = Status::Invalid(place_.empty() ? message : place_ + ": " + message);
}

bool StorageNode::RequireThat(bool condition, const std::string& expected) const {
  if (condition) return true;
  Fail(Exists() ? "must be " + expected : "is missing");
  return false;
}

void StorageNode::AllowKeys(const std::vector<std::string>& keys) const {
  if (!RequireThat(Exists() && node_->is_object(), "a map of keys and values")) return;
  for (const auto& [key, value] : node_->items()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end())
      Fail("unknown key '" + key + "'" + DidYouMean(key, keys));
  }
}

StorageNode StorageNode::Get(const std::string& key) const {
  const std::string place = place_.empty() ? key : place_ + "." + key;
  const bool has = node_ != nullptr && node_->is_object() && node_->contains(key);
  return {has ? &(*node_)[key] : nullptr, place, status_};
}

StorageNode StorageNode::Require(const std::string& key) const {
  const StorageNode node = Get(key);
  if (!node.Exists()) Fail("'" + key + "' is missing");
  return node;
}

std::vector<StorageNode> StorageNode::Items() const {
  std::vector<StorageNode> items;
  if (!Exists() || !RequireThat(node_->is_array(), "a list")) return items;
  items.reserve(node_->size());
  for (const Json& item : *node_) {
    items.emplace_back(&item, place_ + "[" + std::to_string(items.size()) + "]", status_);
  }
  return items;
}

std::string StorageNode::Text() const {
  if (!RequireThat(Exists() && IsText(*node_), "text")) return "";
  return node_->is_string() ? node_->get<std::string>() : node_->dump();
}

double StorageNode::Number() const {
  if (!RequireThat(Exists() && node_->is_number(), "a number")) return 0.0;
  const auto value = node_->get<double>();
  return RequireThat(std::isfinite(value), "a finite number") ? value : 0.0;
}

int StorageNode::Integer() const {
  const double value = Number();
  RequireThat(value == std::floor(value) && std::abs(value) < 1e9, "a whole number");
  return ok() ? static_cast<int>(value) : 0;
}

std::vector<double> StorageNode::Numbers(std::size_t count, std::size_t multiple_of) const {
  std::vector<double> values;
  if (Exists() && node_->is_object()) {  // A matrix of OpenCV's: rows, cols, dt and data.
    values = Get("data").Numbers();
    const double size = Require("rows").Number() * Require("cols").Number();
    if (ok() && static_cast<double>(values.size()) != size) Fail("must have rows x cols numbers");
  } else if (RequireThat(Exists() && node_->is_array(), "a list of numbers")) {
    values.reserve(node_->size());
    for (const StorageNode& item : Items()) values.push_back(item.Number());
  }
  if (!ok()) return {};
  if (count != 0 && values.size() != count) {
    Fail("must have " + std::to_string(count) + " numbers, has " + std::to_string(values.size()));
  } else if (multiple_of != 0 && values.empty()) {
    Fail("is empty: must have " + std::to_string(multiple_of) + " numbers for each entry");
  } else if (multiple_of != 0 && values.size() % multiple_of != 0) {
    Fail("must have " + std::to_string(multiple_of) + " numbers for each entry, has " +
         std::to_string(values.size()));
  }
  return ok() ? values : std::vector<double>{};
}

}  // namespace circline::apps
