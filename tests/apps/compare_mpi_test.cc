// circline_compare under mpirun: the same bytes as alone.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

class CompareMpi : public testing::Test {
 protected:
  void SetUp() override {
    if (RunCompare("--version").out.find("MPI") == std::string::npos) {
      GTEST_SKIP() << "built without -DCIRCLINE_WITH_MPI=ON";
    }
    scene_ = MakeSet(folder_, kMissingImage);
    // Open MPI asks before it runs as root, and wants a core for each rank.
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  }
  Outcome Run(int ranks, const std::string& flags) {
    return RunProgram("mpirun", "--oversubscribe -np " + std::to_string(ranks) + " '" +
                                    CIRCLINE_COMPARE_BINARY + "' " + flags);
  }
  std::string Arguments(const std::string& output) {
    return "--scene='" + scene_ + "' --output='" + folder_ / output + "' ";
  }
  const TestFolder folder_;
  std::string scene_;
};

TEST_F(CompareMpi, AnyNumberOfRanksGivesTheSameBytes) {
  const Outcome alone = RunCompare(Arguments("one"));
  ASSERT_EQ(alone.exit_code, 1);  // One photo is not there.
  for (const int ranks : {2, 3}) {
    const std::string name = "ranks" + std::to_string(ranks);
    const Outcome outcome = Run(ranks, Arguments(name) + "--threads=1");
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_CONTAINS(outcome.err, "gone.png: the file does not exist");
    EXPECT_EQ(outcome.out.substr(0, outcome.out.find("report:")),
              alone.out.substr(0, alone.out.find("report:")));
    ExpectSameFiles(folder_ / "one", folder_ / name);
  }
}

TEST_F(CompareMpi, GoesOnWhereItWasStopped) {
  ASSERT_EQ(RunCompare(Arguments("one")).exit_code, 1);
  std::filesystem::copy(folder_ / "one", folder_ / "cut", std::filesystem::copy_options::recursive);
  std::filesystem::resize_file(folder_ / "cut/results.jsonl",
                               std::filesystem::file_size(folder_ / "cut/results.jsonl") / 3);
  EXPECT_EQ(Run(2, Arguments("cut") + "--resume").exit_code, 1);
  ExpectSameFiles(folder_ / "one", folder_ / "cut");
}

TEST_F(CompareMpi, RefusesBadFlagsOnce) {
  const Outcome outcome = Run(2, Arguments("out") + "--robust_loss=hubert");
  EXPECT_EQ(outcome.exit_code, 2);
  const std::string words = "'hubert' is not one of";
  EXPECT_EQ(outcome.err.find(words), outcome.err.rfind(words));
  EXPECT_CONTAINS(outcome.err, words);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/results.jsonl"));
}

}  // namespace
}  // namespace circline::apps
