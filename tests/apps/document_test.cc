#include "apps/common/document.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson Parsed(const std::string& text) {
  OrderedJson root;
  const Status status = ParseDocument(text, &root);
  EXPECT_TRUE(status.ok()) << status.message;
  return root;
}

std::string ErrorOfText(const std::string& text) {
  OrderedJson root;
  const Status status = ParseDocument(text, &root);
  EXPECT_FALSE(status.ok()) << root.dump().substr(0, 200);
  EXPECT_EQ(status.message.find('\n'), std::string::npos) << status.message;
  return status.message;
}

std::string Repeat(const std::string& text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

TEST(Document, ScalarsAreNumbersWherePlain) {
  EXPECT_EQ(
      Parsed("a: [ 3, -2.5, 1., .5, 1e3, +7, \"3\", '4', x3, 1.2.3, ., e, -, 0x10 ]\nb:\n"),
      OrderedJson::parse(R"({"a": [3, -2.5, 1.0, 0.5, 1000.0, 7, "3", "4", "x3", "1.2.3", ".", "e",
                                   "-", "0x10"], "b": null})"));
  EXPECT_EQ(Parsed("a: [ 007, -01, 00.5, 0, 0.5, -0.5, 0e1, 10 ]"),
            OrderedJson::parse(R"({"a": ["007", "-01", "00.5", 0, 0.5, -0.5, 0, 10]})"));
  EXPECT_TRUE(std::isinf(Parsed("a: -.Inf")["a"].get<double>()));
  EXPECT_TRUE(std::isnan(Parsed("a: .nan")["a"].get<double>()));
  EXPECT_EQ(Parsed("a: 4294967680")["a"].get<double>(), 4294967680.0);
}

TEST(Document, JsonAndYamlOfOneSceneAreTheSame) {
  const OrderedJson value = {{"file", "name with \"quotes\", \\ and \xC3\xA9"},
                             {"points", {1.25, 0.1, 1e-300, 12345678}},
                             {"maps", {{{"x", 1}}, {{"x", OrderedJson::array()}}}}};
  EXPECT_EQ(Parsed(JsonText(value)), value);
  EXPECT_EQ(Parsed(DocumentText(value)), value);
  EXPECT_EQ(Parsed("%YAML:1.0\n---\n" + DocumentText(value)), value);
  EXPECT_EQ(Parsed(R"({"smile": "\ud83d\ude00"})")["smile"], "\xF0\x9F\x98\x80");
}

// All three of its formats, from its own writer.
TEST(Document, ReadsWhatOpenCvWrites) {
  const std::vector<double> numbers = {552.25, 0.0, -1e-9, 3.0};
  for (const std::string name : {"x.yml", "x.json", "x.xml"}) {
    cv::FileStorage file(name, cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    file << "matrix" << cv::Mat(numbers).reshape(1, 2) << "count" << 3 << "size" << 2.5 << "time"
         << "Mon 23 Nov"
         << "list"
         << "[" << 1 << 2 << "]"
         << "maps"
         << "["
         << "{"
         << "x" << 1 << "}"
         << "{"
         << "x" << 2 << "}"
         << "]";
    const OrderedJson root = Parsed(file.releaseAndGetString());
    EXPECT_EQ(root["matrix"]["data"].get<std::vector<double>>(), numbers) << name;
    EXPECT_EQ(root["matrix"]["rows"], 2) << name;
    EXPECT_EQ(root["count"], 3) << name;
    EXPECT_EQ(root["size"], 2.5) << name;
    EXPECT_EQ(root["time"], "Mon 23 Nov") << name;
    EXPECT_EQ(root["list"], OrderedJson::parse("[1, 2]")) << name;
    EXPECT_EQ(root["maps"], OrderedJson::parse(R"([{"x": 1}, {"x": 2}])")) << name;
  }
}

// 21 bytes for which FileStorage never comes back, and what overflows a stack that recurses.
TEST(Document, HostileTextIsRefused) {
  EXPECT_EQ(Parsed("%YAML:1.0\n a:\"\"\n6, -\n "), "a:\"\" 6, -");  // One text, to YAML.
  for (const char* opening : {"[", "{a: ", "- ", "? ", "\"a\": ["}) {
    EXPECT_NE(ErrorOfText("a: " + Repeat(opening, 60000)), "") << opening;
    EXPECT_NE(ErrorOfText("{\"a\": " + Repeat(opening, 60000)), "") << opening;
  }
  EXPECT_NE(ErrorOfText("<opencv_storage>" + Repeat("<a>", 60000)), "");
  EXPECT_CONTAINS(ErrorOfText("a: " + Repeat("[", 40) + Repeat("]", 40)), "too deeply");
  EXPECT_CONTAINS(ErrorOfText("a: \"\\"), "line 1");
  EXPECT_CONTAINS(ErrorOfText("a: &x [1]\nb: *x\n"), "line 2: aliases");
  EXPECT_CONTAINS(ErrorOfText("a: 1\n---\nb: 1\n"), "second document");
  EXPECT_CONTAINS(ErrorOfText("? [a]\n: 1\n"), "a key must be text");
  EXPECT_NE(ErrorOfText("a: \xFF\xFE\n"), "");
  EXPECT_NE(ErrorOfText(std::string("a: b\0c", 6)), "");
}

TEST(Document, AKeyThatStandsTwiceIsNamed) {
  EXPECT_CONTAINS(ErrorOfText("a: 1\nb: 2\na: 3\n"), "line 3: key 'a' stands there twice");
  EXPECT_CONTAINS(ErrorOfText(R"({"b": {"a": 1}, "c": {"a": 2, "a": 3}})"),
                  "key 'a' stands there twice");
  EXPECT_CONTAINS(ErrorOfText("<opencv_storage><a>1</a><a>2</a></opencv_storage>"), "key 'a'");
  std::string many, lines;
  for (int i = 0; i < 1001; ++i) {
    many += (i == 0 ? "{\"k" : ", \"k") + std::to_string(i) + "\": 1";
    lines += "k" + std::to_string(i) + ": 1\n";
  }
  EXPECT_CONTAINS(ErrorOfText(many + "}"), "too many keys");
  EXPECT_CONTAINS(ErrorOfText(lines), "line 1001: a map has too many keys");
}

}  // namespace
}  // namespace circline::apps
