#include "tests/apps/run_compare.h"

#include <sys/wait.h>

#include <cstdlib>

#include "tests/apps/test_files.h"

namespace circline::apps {

Outcome RunProgram(const std::string& program, const std::string& arguments) {
  const TestFolder folder;
  const std::string command = "'" + program + "' " + arguments + " >'" + folder / "out" + "' 2>'" +
                              folder / "err" + "' </dev/null";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadAll(folder / "out"),
          ReadAll(folder / "err")};
}

Outcome RunCompare(const std::string& arguments) {
  return RunProgram(CIRCLINE_COMPARE_BINARY, arguments);
}

}  // namespace circline::apps
