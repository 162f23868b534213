#include "tests/apps/json_lines.h"

#include <sstream>

#include "tests/apps/test_files.h"

namespace circline::apps {

std::vector<nlohmann::json> ReadJsonLines(const std::string& path) {
  std::vector<nlohmann::json> lines;
  std::istringstream text(ReadAll(path));
  for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

}  // namespace circline::apps
