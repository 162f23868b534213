// Runs circline_compare, and other programs, as their users do.
#ifndef CIRCLINE_TESTS_APPS_RUN_COMPARE_H_
#define CIRCLINE_TESTS_APPS_RUN_COMPARE_H_

#include <sys/wait.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/apps/test_files.h"

// The program's path, from the build.
#ifndef CIRCLINE_COMPARE_BINARY
#define CIRCLINE_COMPARE_BINARY CIRCLINE_COMPARE
#endif

namespace circline::apps {

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

inline Outcome RunProgram(const std::string& program, const std::string& arguments) {
  const TestFolder folder;
  const std::string command = "'" + program + "' " + arguments + " >'" + folder / "out" + "' 2>'" +
                              folder / "err" + "' </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadAll(folder / "out"),
          ReadAll(folder / "err")};
}

inline Outcome RunCompare(const std::string& arguments) {
  return RunProgram(CIRCLINE_COMPARE_BINARY, arguments);
}

inline std::vector<nlohmann::json> ReadJsonLines(const std::string& path) {
  std::vector<nlohmann::json> lines;
  std::istringstream text(ReadAll(path));
  for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_RUN_COMPARE_H_
