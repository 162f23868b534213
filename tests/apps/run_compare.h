// Runs circline_compare, and other programs, as their users do.
#ifndef CIRCLINE_TESTS_APPS_RUN_COMPARE_H_
#define CIRCLINE_TESTS_APPS_RUN_COMPARE_H_

#include <sys/types.h>

#include <string>
#include <vector>

// The program's path, from the build.
#ifndef CIRCLINE_COMPARE_BINARY
#define CIRCLINE_COMPARE_BINARY CIRCLINE_COMPARE
#endif

namespace circline::apps {

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

Outcome RunProgram(const std::string& program, const std::string& arguments);
Outcome RunCompare(const std::string& arguments);

// As a process of ours that goes on, silent.
pid_t StartProgram(const std::string& program, const std::vector<std::string>& arguments);

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_RUN_COMPARE_H_
