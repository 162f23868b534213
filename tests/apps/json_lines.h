// The files of JSON lines that the programs write.
#ifndef CIRCLINE_TESTS_APPS_JSON_LINES_H_
#define CIRCLINE_TESTS_APPS_JSON_LINES_H_

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace circline::apps {

// One value a line.
std::vector<nlohmann::json> ReadJsonLines(const std::string& path);

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_JSON_LINES_H_
