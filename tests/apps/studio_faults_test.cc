// What the studio keeps where its disk is full, and where it is killed.
// clang-format off: httplib.h includes resolv.h, which has a macro _res, a name of Eigen's.
#include "apps/studio/studio.h"
// clang-format on

#include <gtest/gtest.h>
#include <httplib.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <thread>

#include "tests/apps/run_compare.h"
#include "tests/apps/small_disk.h"
#include "tests/apps/studio_disc.h"
#include "tests/apps/test_files.h"
#include "tests/trials.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

// A scene that can be told from others by a radius.
Json SceneOfRadius(double radius) {
  const Json circle = {{"id", "c"},
                       {"contour", {30, 36, 36, 28, 48, 26, 60, 28, 66, 36, 48, 46}},
                       {"radius", radius}};
  return {{"circles", Json::array({circle})}};
}

double SavedRadius(const std::string& folder) {
  const Json scene = Json::parse(ReadAll(folder + "/scene.json"), nullptr, false);
  return scene.is_object() ? scene["images"][0]["circles"][0]["radius"].get<double>() : -1.0;
}

double DraftedRadius(const std::string& folder) {
  const Json draft = Json::parse(ReadAll(folder + "/scene.draft.json"), nullptr, false);
  return draft.is_object() ? draft["disc.png"]["circles"][0]["radius"].get<double>() : -1.0;
}

TEST(StudioFaults, AFullDiskLeavesWhatWasSaved) {
  const TestFolder folder;
  const SmallDisk disk(folder / "disk");
  if (!disk.mounted()) GTEST_SKIP() << "no file system can be mounted here (root may)";
  ASSERT_TRUE(disk.Renew(64));
  cv::imwrite(disk / "disc.png", DiscPhoto(96, 72));
  const auto studio = OpenStudio(folder / "disk");
  studio->Save({{"image", 0}, {"scene", SceneOfRadius(1.0)}});
  studio->Draft({{"image", 0}, {"state", SceneOfRadius(1.0)}});
  std::ofstream(disk / "filler") << std::string(1 << 17, 'x');
  const auto expect_refused = [&](Json (Studio::*ask)(const Json&), const Json& request,
                                  const std::string& file) {
    try {
      ((*studio).*ask)(request);
      ADD_FAILURE() << file;
    } catch (const RequestError& error) {
      EXPECT_CONTAINS(std::string(error.what()), "/disk/" + file + ": cannot be written");
    }
  };
  expect_refused(&Studio::Save, {{"image", 0}, {"scene", SceneOfRadius(2.0)}}, "scene.json");
  expect_refused(&Studio::Draft, {{"image", 0}, {"state", SceneOfRadius(2.0)}}, "scene.draft.json");
  EXPECT_EQ(SavedRadius(folder / "disk"), 1.0);
  EXPECT_EQ(DraftedRadius(folder / "disk"), 1.0);
  fs::remove(disk / "filler");
  studio->Save({{"image", 0}, {"scene", SceneOfRadius(3.0)}});
  EXPECT_EQ(SavedRadius(folder / "disk"), 3.0);
}

TEST(StudioFaults, KilledAtRandomKeepsWhatItSaidWasSaved) {
  const TestFolder folder, log;
  cv::imwrite(folder / "disc.png", DiscPhoto(96, 72));
  std::mt19937 random(11);
  int saved = 0, drafted = 0;
  constexpr int kRuns = Trials(8);
  for (int run = 0; run < kRuns; ++run) {
    fs::remove(log / "out");
    const pid_t pid =
        StartProgram("/bin/sh", {"-c", "exec '" CIRCLINE_STUDIO "' --port=0 --images='" +
                                           folder.path() + "' > '" + log / "out" + "'"});
    std::string said;
    const std::string before_port = "http://127.0.0.1:";
    while (said.find("/ (") == std::string::npos) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      ASSERT_EQ(waitpid(pid, nullptr, WNOHANG), 0) << "it ended: " << said;
      said = ReadAll(log / "out");
    }
    const int port = std::stoi(said.substr(said.find(before_port) + before_port.size()));
    httplib::Client client("127.0.0.1", port);
    const auto post = [&](const std::string& address, const char* key, int radius) {
      const Json body = {{"image", 0}, {key, SceneOfRadius(radius)}};
      const httplib::Result result = client.Post(address, body.dump(), "application/json");
      return result && result->status == 200;
    };
    // Once it has saved: how long that takes is up to the machine.
    ASSERT_TRUE(post("/api/save", "scene", ++saved));
    ASSERT_TRUE(post("/api/draft", "state", ++drafted));
    std::thread killer([pid, wait = std::chrono::milliseconds(random() % 200)] {
      std::this_thread::sleep_for(wait);
      kill(pid, SIGKILL);
    });
    while (post("/api/save", "scene", saved + 1)) {
      ++saved;
      if (!post("/api/draft", "state", drafted + 1)) break;
      ++drafted;
    }
    killer.join();
    ASSERT_EQ(waitpid(pid, nullptr, 0), pid);
    // The last one may have been written and not answered.
    const double scene = SavedRadius(folder.path()), draft = DraftedRadius(folder.path());
    EXPECT_TRUE(scene == saved || scene == saved + 1) << scene << " " << saved;
    EXPECT_TRUE(draft == drafted || draft == drafted + 1) << draft << " " << drafted;
    saved = static_cast<int>(scene);
    drafted = static_cast<int>(draft);
  }
}

}  // namespace
}  // namespace circline::apps
