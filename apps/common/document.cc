#include "apps/common/document.h"

#include <tinyxml2.h>
#include <yaml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

// Ends the reading of a document; what() is the sentence.
class DocumentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

constexpr char kTooManyKeys[] = "a map has too many keys", kTooDeep[] = "is nested too deeply";

std::string DuplicateKey(const std::string& key) { return "key '" + key + "' stands there twice"; }

// "007" is a name: as a number it would lose its zeros.
bool HasLeadingZero(const std::string& text) {
  const std::size_t first = text.find_first_not_of("+-");
  return first != std::string::npos && text[first] == '0' &&
         text.find_first_of("0123456789", first + 1) == first + 1;
}

// YAML 1.1 writes what is no number as ".inf" and ".nan", which the reader of values then refuses.
Json PlainScalar(const std::string& text) {
  int whole = 0;
  double number = 0.0;
  if (text.empty() || text == "~" || text == "null") return {};
  if (HasLeadingZero(text)) return text;
  if (ParseInt(text, &whole)) return whole;
  if (text.find_first_not_of("+-.0123456789eE") == std::string::npos) {
    if (ParseDouble(text, &number)) return number;
  }
  const std::size_t sign = text.find_first_not_of("+-");
  const std::string name = sign <= 1 ? text.substr(sign) : "";
  if (name == ".inf" || name == ".Inf" || name == ".INF")
    return std::numeric_limits<double>::infinity();
  if (name == ".nan" || name == ".Nan" || name == ".NaN" || name == ".NAN")
    return std::numeric_limits<double>::quiet_NaN();
  return text;
}

// Builds the tree from the events of libyaml, which keeps a stack of its own instead of recursing.
class YamlReader {
 public:
  YamlReader(const std::string& text, const DocumentLimits& limits) : limits_(limits) {
    if (yaml_parser_initialize(&parser_) == 0) throw DocumentError("out of memory");
    yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text.data()),
                                 text.size());
  }
  ~YamlReader() { yaml_parser_delete(&parser_); }
  YamlReader(const YamlReader&) = delete;
  YamlReader& operator=(const YamlReader&) = delete;

  Json Read() {
    for (bool more = true; more;) {
      yaml_event_t event;
      if (yaml_parser_parse(&parser_, &event) == 0) Fail(parser_.problem, parser_.problem_mark);
      try {
        more = ReadEvent(event);
      } catch (...) {
        yaml_event_delete(&event);
        throw;
      }
      yaml_event_delete(&event);
    }
    return std::move(root_);
  }

 private:
  struct Open {
    Json* node;  // Of its parent's last value: stays where it is until the parent grows.
    bool has_key = false;
    std::string key = {};
    std::set<std::string> keys = {};
  };

  [[noreturn]] static void Fail(const char* problem, const yaml_mark_t& mark) {
    throw DocumentError("line " + std::to_string(mark.line + 1) + ": " +
                        (problem == nullptr ? "cannot be read" : problem));
  }

  bool ReadEvent(const yaml_event_t& event) {
    const yaml_mark_t& mark = event.start_mark;
    switch (event.type) {
      case YAML_STREAM_END_EVENT:
        return false;
      case YAML_DOCUMENT_START_EVENT:
        if (++num_documents_ > 1) Fail("a second document begins", mark);
        break;
      case YAML_ALIAS_EVENT:
        Fail("aliases (*name) are not read", mark);
      case YAML_SCALAR_EVENT:
        ReadScalar(event);
        break;
      case YAML_SEQUENCE_START_EVENT:
        Begin(Json::array(), mark);
        break;
      case YAML_MAPPING_START_EVENT:
        Begin(Json::object(), mark);
        break;
      case YAML_SEQUENCE_END_EVENT:
      case YAML_MAPPING_END_EVENT:
        open_.pop_back();
        break;
      default:
        break;
    }
    return true;
  }

  void ReadScalar(const yaml_event_t& event) {
    const auto& scalar = event.data.scalar;
    std::string text(reinterpret_cast<const char*>(scalar.value), scalar.length);
    if (!open_.empty() && open_.back().node->is_object() && !open_.back().has_key) {
      ReadKey(std::move(text), event.start_mark);
    } else {
      const bool is_plain = scalar.style == YAML_PLAIN_SCALAR_STYLE && scalar.plain_implicit != 0;
      Add(is_plain ? PlainScalar(text) : Json(std::move(text)), event.start_mark);
    }
  }

  void ReadKey(std::string key, const yaml_mark_t& mark) {
    Open& map = open_.back();
    if (!map.keys.insert(key).second) Fail(DuplicateKey(key).c_str(), mark);
    if (map.keys.size() > limits_.keys_of_a_map) Fail(kTooManyKeys, mark);
    map.key = std::move(key);
    map.has_key = true;
  }

  Json* Add(Json value, const yaml_mark_t& mark) {
    if (open_.empty()) return &(root_ = std::move(value));
    Open& parent = open_.back();
    if (parent.node->is_array()) return &parent.node->emplace_back(std::move(value));
    if (!parent.has_key) Fail("a key must be text", mark);
    parent.has_key = false;
    Json& place = (*parent.node)[parent.key];
    place = std::move(value);
    return &place;
  }

  void Begin(Json empty, const yaml_mark_t& mark) {
    if (open_.size() >= static_cast<std::size_t>(limits_.depth)) Fail(kTooDeep, mark);
    Json* node = Add(std::move(empty), mark);
    open_.push_back({node});
  }

  DocumentLimits limits_;
  yaml_parser_t parser_ = {};
  Json root_;
  std::vector<Open> open_;
  int num_documents_ = 0;
};

Json ParseJson(const std::string& text, const DocumentLimits& limits) {
  std::vector<std::set<std::string>> keys;
  const auto check = [&](int depth, Json::parse_event_t event, Json& value) {
    if (depth >= limits.depth) throw DocumentError(kTooDeep);
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event != Json::parse_event_t::key) return true;
    const auto& key = value.get_ref<const std::string&>();
    if (!keys.back().insert(key).second) throw DocumentError(DuplicateKey(key));
    if (keys.back().size() > limits.keys_of_a_map) throw DocumentError(kTooManyKeys);
    return true;
  };
  try {
    return Json::parse(text, check);
  } catch (const Json::exception& error) {  // "[json.exception.parse_error.101] parse error at ..."
    const std::string what = error.what();
    const std::size_t bracket = what.find("] ");
    throw DocumentError(bracket == std::string::npos ? what : what.substr(bracket + 2));
  }
}

// Numbers stand side by side in the text of an element; anything else there is one text.
Json XmlText(const char* text) {
  if (text == nullptr) return {};
  Json values = Json::array();
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    values.push_back(PlainScalar(word));
    if (!values.back().is_number()) {
      const std::string all = text;
      const std::size_t quote = all.find('"'), last = all.rfind('"');
      return quote == last ? all : all.substr(quote + 1, last - quote - 1);
    }
  }
  return values.size() == 1 ? values.front() : values;
}

// What OpenCV's FileStorage writes: items of lists are called "_". The parser bounds the depth.
Json XmlValue(const tinyxml2::XMLElement& element, const DocumentLimits& limits) {
  const tinyxml2::XMLElement* child = element.FirstChildElement();
  if (child == nullptr) return XmlText(element.GetText());
  Json value;
  for (; child != nullptr; child = child->NextSiblingElement()) {
    const std::string key = child->Name();
    if (key == "_") {
      if (!value.is_object()) value.push_back(XmlValue(*child, limits));
    } else if (!value.is_array()) {
      if (value.contains(key)) throw DocumentError(DuplicateKey(key));
      if (value.size() >= limits.keys_of_a_map) throw DocumentError(kTooManyKeys);
      value[key] = XmlValue(*child, limits);
    }
    if (value.is_object() == (key == "_")) throw DocumentError("mixes a list with keys");
  }
  return value;
}

Json ParseXml(const std::string& text, const DocumentLimits& limits) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw DocumentError("line " + std::to_string(document.ErrorLineNum()) + ": " +
                        document.ErrorName());
  }
  const tinyxml2::XMLElement* root = document.FirstChildElement("opencv_storage");
  if (root == nullptr) throw DocumentError("has no opencv_storage");
  return XmlValue(*root, limits);
}

// OpenCV writes "%YAML:1.0", which is no directive of YAML: blanked, so that lines keep their
// numbers.
std::string WithoutOpenCvHeader(std::string text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin != std::string::npos && text.compare(begin, 6, "%YAML:") == 0) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    text.replace(begin, end - begin, end - begin, ' ');
  }
  return text;
}

std::string Lines(const Json& value, const std::string& indent, int depth) {
  const bool is_map = value.is_object(), is_list = value.is_array();
  if (depth == 0 || !(is_map || is_list) || value.empty()) return JsonText(value);
  if (is_list && !value.front().is_structured()) return JsonText(value);
  std::string text = is_map ? "{" : "[", separator = "\n";
  for (const auto& [key, item] : value.items()) {
    text += separator + indent + "  ";
    if (is_map) text += JsonText(key) + ": ";
    text += Lines(item, indent + "  ", depth - 1);
    separator = ",\n";
  }
  return text + "\n" + indent + (is_map ? "}" : "]");
}

}  // namespace

Status ParseDocument(const std::string& text, Json* root, const DocumentLimits& limits) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return Status::Invalid("is empty");
  try {
    *root = text[begin] == '{'   ? ParseJson(text, limits)
            : text[begin] == '<' ? ParseXml(text, limits)
                                 : YamlReader(WithoutOpenCvHeader(text), limits).Read();
    return Status::Ok();
  } catch (const DocumentError& error) {
    return Status::Invalid(std::string("not valid YAML, JSON or XML: ") + error.what());
  }
}

Json JsonNumbers(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Json numbers = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j)
      numbers.push_back(std::isfinite(matrix(i, j)) ? Json(matrix(i, j)) : Json());
  }
  return numbers;
}

std::string JsonText(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string DocumentText(const Json& root, int depth) { return Lines(root, "", depth) + "\n"; }

std::string TextAsWritten(const std::string& text) {
  return Json::parse(JsonText(text)).get<std::string>();
}

}  // namespace circline::apps
