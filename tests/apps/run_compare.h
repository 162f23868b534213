// Runs circline_compare, and other programs, as their users do, and reads what they write.
#ifndef CIRCLINE_TESTS_APPS_RUN_COMPARE_H_
#define CIRCLINE_TESTS_APPS_RUN_COMPARE_H_

#include <sys/types.h>

#include <map>
#include <nlohmann/json.hpp>
#include <random>
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
// Of a scene file, into a folder.
Outcome CompareScene(const std::string& scene, const std::string& output,
                     const std::string& flags = "");

// The values of a file of JSON lines.
std::vector<nlohmann::json> ReadJsonLines(const std::string& path);

// A row of measurements.csv; truth and relative error 0 where it has none.
struct MeasuredRow {
  double value = 0.0, sigma = 0.0, truth = 0.0, relative_error = 0.0;
  std::string unit;
};
// By what was measured and its id: "length carton x".
std::map<std::string, MeasuredRow> ReadMeasurements(const std::string& path);

// As a process of ours that goes on, silent.
pid_t StartProgram(const std::string& program, const std::vector<std::string>& arguments);

// Kills programs at moments uniform over the time that they take. Of that time it keeps track, as
// it changes by itself on a machine that does other things, too: most are killed, whatever it does.
class RandomKiller {
 public:
  explicit RandomKiller(double whole_ms) : whole_ms_(whole_ms) {}
  // Waits for the program's end; whether it was killed, and did not end by itself before.
  bool Kill(pid_t pid);

 private:
  double whole_ms_;
  std::mt19937 random_{7};
};

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_RUN_COMPARE_H_
