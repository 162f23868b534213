#include "tests/apps/run_compare.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <thread>

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

Outcome CompareScene(const std::string& scene, const std::string& output,
                     const std::string& flags) {
  return RunCompare("--scene='" + scene + "' --output='" + output + "' " + flags);
}

std::vector<nlohmann::json> ReadJsonLines(const std::string& path) {
  std::vector<nlohmann::json> lines;
  std::istringstream text(ReadAll(path));
  for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

std::map<std::string, MeasuredRow> ReadMeasurements(const std::string& path) {
  std::map<std::string, MeasuredRow> rows;
  std::istringstream csv(ReadAll(path));
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line, "what,id,value,sigma,unit,truth,relative_error");
  while (std::getline(csv, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line + ",");  // An empty last cell is one, too.
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    EXPECT_EQ(cells.size(), 7U) << line;
    if (cells.size() != 7) continue;
    const auto number = [](const std::string& cell) {
      return cell.empty() ? 0.0 : std::stod(cell);
    };
    rows[cells[0] + " " + cells[1].substr(1, cells[1].size() - 2)] = {
        number(cells[2]), number(cells[3]), number(cells[5]), number(cells[6]), cells[4]};
  }
  return rows;
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

bool RandomKiller::Kill(pid_t pid) {
  if (pid <= 0) return false;  // It was never started.
  using Clock = std::chrono::steady_clock;
  constexpr double kSlower = 1.1;  // Whoever was killed might have taken longer.
  const Clock::time_point begin = Clock::now();
  const double share = std::generate_canonical<double, 32>(random_);
  double ms = 0.0;
  while (ms < share * whole_ms_) {
    std::this_thread::sleep_for(std::chrono::microseconds(500));
    ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    if (waitpid(pid, nullptr, WNOHANG) == pid) {
      whole_ms_ = ms;
      return false;
    }
  }
  kill(pid, SIGKILL);
  whole_ms_ *= kSlower;
  int status = 0;
  return waitpid(pid, &status, 0) == pid && WIFSIGNALED(status);
}

}  // namespace circline::apps
