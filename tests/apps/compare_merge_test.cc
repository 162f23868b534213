// Shards joined, losses swept, poses in other programs' formats.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using nlohmann::json;

class CompareMerge : public testing::Test {
 protected:
  Outcome Run(const std::string& flags, const std::string& output) {
    return CompareScene(scene_, folder_ / output, flags);
  }
  Outcome Merge(const std::string& inputs) {
    std::istringstream names(inputs);
    std::string list;
    for (std::string name; names >> name;) list += (list.empty() ? "" : ",") + (folder_ / name);
    return RunCompare("--merge='" + list + "' --output='" + folder_ / "merged" + "'");
  }
  const TestFolder folder_;
  std::string scene_ = MakeSet(folder_, kMissingImage);
};

TEST_F(CompareMerge, ShardsGiveTheFilesOfTheWhole) {
  ASSERT_EQ(Run("", "whole").exit_code, 1);  // One photo is not there.
  for (const char* i : {"0", "1", "2"}) {
    EXPECT_NE(Run(std::string("--shard=") + i + "/3", std::string("shard") + i).exit_code, 2);
  }
  const Outcome outcome = Merge("shard2 shard0 shard1");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_CONTAINS(outcome.err, "gone.png: the file does not exist");
  ExpectSameFiles(folder_ / "whole", folder_ / "merged");
}

TEST_F(CompareMerge, RefusesWhatIsNotOneSet) {
  ASSERT_EQ(Run("--shard=0/2 --overlays=false", "a").exit_code, 1);
  ASSERT_EQ(Run("--shard=1/2 --overlays=false", "b").exit_code, 0);
  ASSERT_EQ(Run("--shard=1/2 --overlays=false --solvers=joint", "other").exit_code, 0);
  ASSERT_EQ(Run("--shard=1/2 --overlays=false --seed=2", "seed").exit_code, 0);
  ASSERT_EQ(Run("--shard=0/7 --overlays=false", "first").exit_code, 0);
  std::filesystem::copy(folder_ / "b", folder_ / "unfinished");
  folder_.Write("unfinished/unfinished.flags", "--seed=1\n");
  const std::map<std::string, std::string> cases = {{"first", "image 1 of 7 is missing"},
                                                    {"a", "image 1 is missing"},
                                                    {"b", "image 0 is missing"},
                                                    {"a b b", "is there twice"},
                                                    {"a other", "ran other solvers or losses"},
                                                    {"a seed", "seed ran with --seed=2, others"},
                                                    {"a unfinished", "is not finished"},
                                                    {"a nothing", "nothing has no results.jsonl"}};
  for (const auto& [inputs, words] : cases) {
    const Outcome outcome = Merge(inputs);
    EXPECT_EQ(outcome.exit_code, 2) << inputs;
    EXPECT_CONTAINS(outcome.err, words);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "merged")) << inputs;
  }
}

// Where all photos are done: another run was stopped in the folder, or there was no flag to save.
TEST_F(CompareMerge, AFolderWithAllPhotosIsFinished) {
  const std::string flags = "--overlays=false --solvers=parallel_circles ";
  for (const std::string i : {"0", "1"}) {
    const Outcome outcome =
        Run(flags + "--shard=" + i + "/2 --save_options='" + folder_ / "best'", i);
    EXPECT_CONTAINS(outcome.err, "--save_options: no refined solver has an answer");
    EXPECT_FALSE(std::filesystem::exists(folder_ / i + "/unfinished.flags"));
  }
  std::filesystem::create_directory(folder_ / "merged");
  folder_.Write("merged/unfinished.flags", "--seed=7\n");
  EXPECT_EQ(Merge("0 1").exit_code, 1);  // One photo is not there.
  EXPECT_FALSE(std::filesystem::exists(folder_ / "merged/unfinished.flags"));
}

TEST_F(CompareMerge, RefusesOtherCameras) {
  for (const char* name : {"0.png", "1.png"}) Board(35.0).Paint(folder_ / name);
  const auto run = [&](const std::string& flags, const std::string& output) {
    return RunCompare("--overlays=false --images='" + folder_ / "?.png" + "' " + flags +
                      " --output='" + folder_ / output + "'");
  };
  const auto camera = [&](const std::string& focal) {
    return " --camera='" +
           folder_.Write(focal + ".txt", "1 SIMPLE_PINHOLE 320 240 " + focal + " 160 120\n") + "'";
  };
  ASSERT_EQ(run("--shard=0/2" + camera("300"), "a").exit_code, 0);
  ASSERT_EQ(run("--shard=1/2" + camera("301"), "longer").exit_code, 0);
  ASSERT_EQ(run("--shard=1/2", "guess").exit_code, 0);
  ASSERT_EQ(run("--shard=1/2" + camera("300"), "b").exit_code, 0);
  for (const char* other : {"longer", "guess"}) {
    const Outcome outcome = Merge(std::string("a ") + other);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_CONTAINS(outcome.err, std::string(other) + " ran with another camera");
  }
  EXPECT_EQ(Merge("a b").exit_code, 0);
}

TEST_F(CompareMerge, SweepNamesTheBestAndSavesItsFlags) {
  const std::string best = folder_ / "best.flags";
  const Outcome outcome =
      Run("--overlays=false --robust_loss=huber,tukey --loss_scale_px=0.5,auto --max_pencils=3 "
          "--save_options='" +
              best + "'",
          "sweep");
  EXPECT_CONTAINS(outcome.out, "best: ");
  const std::string flags = ReadAll(best);
  EXPECT_CONTAINS(flags, "--robust_loss=");
  EXPECT_CONTAINS(flags, "--max_pencils=3\n");
  EXPECT_EQ(Run("--overlays=false --flagfile='" + best + "'", "again").exit_code, 1);
  // The chosen rows repeat the sweep's.
  const std::string csv = ReadAll(folder_ / "sweep/summary.csv");
  std::istringstream lines(ReadAll(folder_ / "again/summary.csv"));
  for (std::string line; std::getline(lines, line);) EXPECT_CONTAINS(csv, line);
}

// Hours of work, and then nowhere to put the flags: said before.
TEST_F(CompareMerge, FlagsThatCannotBeSavedAreNoticedFirst) {
  const std::string flags = "--overlays=false --solvers=joint --save_options=";
  for (const std::string& path : {folder_ / "none/best.flags", folder_.path()}) {
    const Outcome outcome = Run(flags + "'" + path + "'", "out");
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_CONTAINS(outcome.err, "--save_options: " + path + ": cannot be written");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
  ASSERT_EQ(Run(flags + "'" + folder_ / "out/best.flags" + "'", "out").exit_code, 1);
  EXPECT_CONTAINS(ReadAll(folder_ / "out/best.flags"), "--robust_loss=");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/best.flags.part"));
}

// Where the focal length was refined, the camera goes with the pose. That of the scene is 10 pixels
// short, so that exact evidence has something to refine; photos of equal cameras share one.
TEST_F(CompareMerge, ExportsTheRefinedFocalLength) {
  const double calibrated = kFocal - 10.0;
  std::ostringstream right, wrong;
  right << "camera_matrix: [" << kFocal << ", 0, " << (kWidth - 1) / 2.0 << ", 0, " << kFocal
        << ",";
  wrong << "camera_matrix: [" << calibrated << ", 0, " << (kWidth - 1) / 2.0 << ", 0, "
        << calibrated << ",";
  std::string scene = ReadAll(scene_);
  const std::size_t at = scene.find(right.str());
  ASSERT_NE(at, std::string::npos);
  scene_ = folder_.Write("short.yaml", scene.replace(at, right.str().size(), wrong.str()));
  ASSERT_EQ(Run("--overlays=false --solvers=joint --focal_sigma=0.05 --export_as=colmap", "out")
                .exit_code,
            1);
  std::istringstream cameras(ReadAll(folder_ / "out/cameras.txt"));
  std::istringstream images(ReadAll(folder_ / "out/images.txt"));
  std::string line, word;
  std::getline(cameras, line);
  std::map<int, double> focal_of;
  for (int id = 0; cameras >> id;) {
    cameras >> word >> word >> word >> focal_of[id];  // Model, width, height, fx.
    std::getline(cameras, line);
  }
  EXPECT_GE(focal_of.size(), 4U);
  std::getline(images, line);
  std::getline(images, line);
  int num_images = 0;
  for (const json& result : ReadJsonLines(folder_ / "out/results.jsonl")) {
    if (result["hypothesis"] != 0) continue;
    for (int i = 0; i < 8; ++i) images >> word;  // Id, rotation, translation.
    int camera = 0;
    images >> camera >> word;
    EXPECT_EQ(word, result["image"]);
    EXPECT_NEAR(focal_of[camera], calibrated * result["focal_scale"].get<double>(), 1e-9);
    // Every second photo is annotated, and its evidence tells the focal length.
    if (num_images++ % 2 == 0) {
      EXPECT_NEAR(focal_of[camera], kFocal, calibrated * result["focal_sigma"].get<double>());
      EXPECT_GT(focal_of[camera], calibrated + 5.0);
    }
  }
  EXPECT_EQ(num_images, 6);
}

TEST_F(CompareMerge, ExportsThePosesThatAreShown) {
  const Outcome outcome = Run("--overlays=false --export_as=colmap,gltf,tum", "out");
  ASSERT_EQ(outcome.exit_code, 1);
  EXPECT_CONTAINS(outcome.out, "exported poses: 0 of 6 have a scale");
  std::vector<json> shown;
  for (const json& line : ReadJsonLines(folder_ / "out/results.jsonl")) {
    if (line["solver"] == "joint" && line["hypothesis"] == 0) shown.push_back(line);
  }
  ASSERT_EQ(shown.size(), 6U);
  std::istringstream colmap(ReadAll(folder_ / "out/images.txt"));
  std::istringstream tum(ReadAll(folder_ / "out/trajectory.txt"));
  const json gltf = json::parse(ReadAll(folder_ / "out/cameras.gltf"));
  EXPECT_EQ(gltf["asset"]["version"], "2.0");
  EXPECT_EQ(gltf["nodes"][0]["children"].size(), 6U);
  std::string line;
  std::getline(colmap, line);
  std::getline(colmap, line);
  std::getline(tum, line);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::vector<double> r = shown[i]["rotation"], t_shown = shown[i]["translation"];
    const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix3d>(r.data()).transpose();
    const Eigen::Vector3d translation = Eigen::Map<const Eigen::Vector3d>(t_shown.data());
    const Eigen::Vector3d center = -rotation.transpose() * translation;

    int id = 0, camera = 0;
    double w = 0, x = 0, y = 0, z = 0;
    Eigen::Vector3d t;
    std::string name;
    colmap >> id >> w >> x >> y >> z >> t.x() >> t.y() >> t.z() >> camera >> name;
    EXPECT_EQ(id, static_cast<int>(i) + 1);
    EXPECT_EQ(name, shown[i]["image"]);
    EXPECT_LT((Eigen::Quaterniond(w, x, y, z).toRotationMatrix() - rotation).norm(), 1e-12);
    EXPECT_LT((t - translation).norm(), 1e-12);

    double time = 0;
    tum >> time >> t.x() >> t.y() >> t.z() >> x >> y >> z >> w;
    EXPECT_EQ(time, static_cast<double>(i));
    EXPECT_LT((t - center).norm(), 1e-12);
    EXPECT_LT((Eigen::Quaterniond(w, x, y, z).toRotationMatrix() - rotation.transpose()).norm(),
              1e-12);

    // What the glTF camera sees ahead of it (-Z) is what ours does (+Z); so with up (Y and -Y).
    const json& node = gltf["nodes"][i + 1];
    const json& q = node["rotation"];
    const Eigen::Matrix3d turn = Eigen::Quaterniond(q[3].get<double>(), q[0].get<double>(),
                                                    q[1].get<double>(), q[2].get<double>())
                                     .toRotationMatrix();
    EXPECT_LT((-turn.col(2) - rotation.transpose().col(2)).norm(), 1e-12);
    EXPECT_LT((turn.col(1) + rotation.transpose().col(1)).norm(), 1e-12);
    const std::vector<double> placed = node["translation"];
    EXPECT_LT((Eigen::Map<const Eigen::Vector3d>(placed.data()) - center).norm(), 1e-12);
  }
  EXPECT_NEAR(gltf["cameras"][0]["perspective"]["yfov"], 2.0 * std::atan(0.5 * kHeight / kFocal),
              1e-12);
  // The root turns the plane's normal (Z) into glTF's up (Y).
  const json& r = gltf["nodes"][0]["rotation"];
  const Eigen::Quaterniond root(r[3].get<double>(), r[0].get<double>(), r[1].get<double>(),
                                r[2].get<double>());
  EXPECT_LT((root * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_CONTAINS(ReadAll(folder_ / "out/cameras.txt"), "1 PINHOLE 320 240 300 300 160 120\n");
}

}  // namespace
}  // namespace circline::apps
