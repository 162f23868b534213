#include "tests/apps/run_compare.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

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

pid_t StartProgram(const std::string& program, const std::vector<std::string>& arguments) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  const int null = open("/dev/null", O_RDWR);
  for (const int stream : {0, 1, 2}) dup2(null, stream);
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(127);
}

}  // namespace circline::apps
