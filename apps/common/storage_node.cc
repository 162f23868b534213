#include "apps/common/storage_node.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <vector>

#include "apps/common/text.h"
#include "circline/estimators/status.h"

namespace circline::apps {
namespace {

bool StartsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

// FileStorage insists on its header; people write plain YAML. Returns how many lines were added.
int AddMissingHeader(std::string* text) {
  const std::size_t begin = text->find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return 0;
  const char first = (*text)[begin];
  if (first == '{' || first == '<' || StartsWith(text->substr(begin, 5), "%YAML")) return 0;
  const bool has_rule = StartsWith(text->substr(begin, 3), "---");
  *text = (has_rule ? "%YAML:1.0\n" : "%YAML:1.0\n---\n") + *text;
  return has_rule ? 1 : 2;
}

// The parser's complaint as part of one line. It comes as "name(12): Missing ..." in the place
// where OpenCV's exceptions have the function's name.
std::string ParserMessage(const cv::Exception& error, int added_lines) {
  const std::size_t colon = error.func.find("): ");
  const std::size_t parenthesis = error.func.rfind('(', colon);
  if (colon == std::string::npos || parenthesis == std::string::npos) return error.err;
  int line = 0;
  if (!ParseInt(error.func.substr(parenthesis + 1, colon - parenthesis - 1), &line))
    return error.err;
  return "line " + std::to_string(line - added_lines) + ": " + error.func.substr(colon + 3);
}

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
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

Status StorageDocument::Open(const std::string& path) {
  std::string text;
  const Status status = ReadTextFile(path, &text);
  return status.ok() ? Parse(path, std::move(text)) : status;
}

Status StorageDocument::Parse(const std::string& name, std::string text) {
  text_ = std::move(text);
  if (text_.find_first_not_of(" \t\r\n") == std::string::npos) {
    return Status::Invalid(name + ": is empty");
  }
  const int added_lines = AddMissingHeader(&text_);
  try {
    storage_.open(text_, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (storage_.isOpened() && storage_.root().isMap()) return Status::Ok();
  } catch (const cv::Exception& error) {
    return Status::Invalid(
        name + ": not valid YAML or JSON: " + OneLine(ParserMessage(error, added_lines)));
  } catch (const std::exception& error) {
    return Status::Invalid(name + ": not valid YAML or JSON: " + error.what());
  }
  return Status::Invalid(name + ": not a YAML or JSON document with keys and values");
}

void StorageNode::Fail(const std::string& message) const {
  if (!status_->ok()) return;
  *status_ = Status::Invalid(place_ + ": " + message);
}

bool StorageNode::RequireThat(bool condition, const std::string& expected) const {
  if (condition) return true;
  Fail(Exists() ? "must be " + expected : "is missing");
  return false;
}

void StorageNode::AllowKeys(const std::vector<std::string>& keys) const {
  if (!RequireThat(node_.isMap(), "a map of keys and values")) return;
  std::set<std::string> seen;
  for (const std::string& key : node_.keys()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      Fail("unknown key '" + key + "'" + DidYouMean(key, keys));
    } else if (!seen.insert(key).second) {
      Fail("key '" + key + "' stands there twice");
    }
  }
}

StorageNode StorageNode::Get(const std::string& key) const {
  const std::string place = place_.empty() ? key : place_ + "." + key;
  return {node_.isMap() ? node_[key] : cv::FileNode(), place, status_};
}

StorageNode StorageNode::Require(const std::string& key) const {
  const StorageNode node = Get(key);
  if (!node.Exists()) Fail("'" + key + "' is missing");
  return node;
}

std::vector<StorageNode> StorageNode::Items() const {
  std::vector<StorageNode> items;
  if (!Exists() || !RequireThat(node_.isSeq(), "a list")) return items;
  for (const cv::FileNode& item : node_) {
    items.emplace_back(item, place_ + "[" + std::to_string(items.size()) + "]", status_);
  }
  return items;
}

std::string StorageNode::Text() const {
  if (!RequireThat(node_.isString() || node_.isInt(), "text")) return "";
  return node_.isInt() ? std::to_string(static_cast<int>(node_.real())) : node_.string();
}

double StorageNode::Number() const {
  if (!RequireThat(node_.isInt() || node_.isReal(), "a number")) return 0.0;
  const double value = node_.real();
  return RequireThat(std::isfinite(value), "a finite number") ? value : 0.0;
}

int StorageNode::Integer() const {
  const double value = Number();
  RequireThat(value == std::floor(value) && std::abs(value) < 1e9, "a whole number");
  return ok() ? static_cast<int>(value) : 0;
}

std::vector<double> StorageNode::Numbers(std::size_t count, std::size_t multiple_of) const {
  std::vector<double> values;
  if (node_.isMap()) {  // A matrix.
    try {
      cv::Mat matrix;
      node_.mat().convertTo(matrix, CV_64F);
      matrix = matrix.reshape(1, 1);
      values.assign(matrix.begin<double>(), matrix.end<double>());
    } catch (const std::exception&) {
      Fail("must be a list of numbers");
    }
    for (const double value : values) RequireThat(std::isfinite(value), "a list of finite numbers");
  } else if (RequireThat(node_.isSeq(), "a list of numbers")) {
    values.reserve(node_.size());
    for (const StorageNode& item : Items()) values.push_back(item.Number());
  }
  if (!ok()) return {};
  if (count != 0 && values.size() != count) {
    Fail("must have " + std::to_string(count) + " numbers, has " + std::to_string(values.size()));
  } else if (multiple_of != 0 && (values.empty() || values.size() % multiple_of != 0)) {
    Fail("must have " + std::to_string(multiple_of) + " numbers for each entry, has " +
         std::to_string(values.size()));
  }
  return ok() ? values : std::vector<double>{};
}

}  // namespace circline::apps
