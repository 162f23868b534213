// What --help says of the flags of a program.
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

// The names of the flags that it lists.
std::set<std::string> ListedFlags(const std::string& help) {
  static const auto* const flag = new std::regex("\n  --([a-z_0-9]+) \\(");
  std::set<std::string> names;
  for (std::sregex_iterator i(help.begin(), help.end(), *flag), end; i != end; ++i)
    names.insert((*i)[1]);
  return names;
}

// Of the flags of circline_compare it lists those that it does not refuse.
TEST(Help, ListsTheFlagsThatAProgramTakes) {
  for (const char* program :
       {CIRCLINE_CALIBRATE, CIRCLINE_TRACK, CIRCLINE_RECONSTRUCT, CIRCLINE_STUDIO}) {
    const std::set<std::string> listed = ListedFlags(RunProgram(program, "--help").out);
    EXPECT_EQ(listed.count("images"), 1U) << program;
    for (const std::string flag :
         {"merge", "plugin", "resume", "shard", "solvers", "peers", "export_as", "save_options",
          "list_solvers", "conic_distance", "overlays", "threads", "scene", "output", "roi",
          "circle_radius", "camera", "seed"}) {
      const std::string value = flag == "overlays" ? "false" : "1";
      const Outcome outcome = RunProgram(program, "--" + flag + "=" + value + " --images=");
      EXPECT_EQ(outcome.exit_code, 2) << program << " --" << flag;
      const bool refused = outcome.err.find("is not a flag of") != std::string::npos;
      EXPECT_EQ(listed.count(flag), refused ? 0U : 1U) << program << " --" << flag << outcome.err;
    }
  }
}

TEST(Help, WritesDefaultsAsAPersonDoes) {
  for (const char* program : {CIRCLINE_COMPARE, CIRCLINE_CALIBRATE, CIRCLINE_TRACK,
                              CIRCLINE_RECONSTRUCT, CIRCLINE_STUDIO, CIRCLINE_SIMULATE}) {
    const std::string help = RunProgram(program, "--help").out;
    EXPECT_FALSE(std::regex_search(help, std::regex("\\([0-9.]{10,}\\)"))) << help;
  }
  EXPECT_CONTAINS(RunProgram(CIRCLINE_RECONSTRUCT, "--help").out, "--point_sigma_px (0.3)");
  EXPECT_CONTAINS(RunCompare("--help").out, "--output (\"\")");
}

}  // namespace
}  // namespace circline::apps
