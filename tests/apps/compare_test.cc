// circline_compare as its users run it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

using Json = nlohmann::json;

// ---- A set of photos made for the test: a disc in a frame on a tilted board, no distortion.

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal = 300.0;

struct Board {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;

  explicit Board(double tilt_deg) {
    rotation =
        Eigen::AngleAxisd(tilt_deg * 0.0174532925, Eigen::Vector3d(1.0, 0.4, 0.1).normalized());
    translation = Eigen::Vector3d(-0.1, 0.05, 4.0);
  }
  Eigen::Vector2d Pixel(double x, double y) const {
    const Eigen::Vector3d p = rotation * Eigen::Vector3d(x, y, 0.0) + translation;
    return {kFocal * p.x() / p.z() + (kWidth - 1) / 2.0,
            kFocal * p.y() / p.z() + (kHeight - 1) / 2.0};
  }
  // Brightness where the pixel's ray meets the board.
  double Brightness(double u, double v) const {
    const Eigen::Vector3d ray((u - (kWidth - 1) / 2.0) / kFocal, (v - (kHeight - 1) / 2.0) / kFocal,
                              1.0);
    const Eigen::Vector3d normal = rotation.col(2);
    const Eigen::Vector3d p =
        rotation.transpose() * (normal.dot(translation) / normal.dot(ray) * ray - translation);
    if (p.head<2>().norm() < 0.5) return 40.0;  // The disc.
    const double away = std::max(std::abs(p.x()), std::abs(p.y()));
    return away > 0.7 && away < 0.9 ? 70.0 : 210.0;  // A square frame about it.
  }
  void Paint(const std::string& path) const {
    constexpr int kSub = 4;
    cv::Mat photo(kHeight, kWidth, CV_8U);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        double sum = 0.0;
        for (int i = 0; i < kSub * kSub; ++i) {
          sum += Brightness(u + (i % kSub + 0.5) / kSub - 0.5, v + (i / kSub + 0.5) / kSub - 0.5);
        }
        photo.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(std::lround(sum / (kSub * kSub)));
      }
    }
    cv::imwrite(path, photo);
  }
};

std::string Camera() {
  std::ostringstream text;
  text << "cameras:\n  - { id: \"k\", model: \"pinhole\", width: " << kWidth
       << ", height: " << kHeight << ", camera_matrix: [" << kFocal << ", 0, " << (kWidth - 1) / 2.0
       << ", 0, " << kFocal << ", " << (kHeight - 1) / 2.0 << ", 0, 0, 1] }\n";
  return text.str();
}

std::string Numbers(const std::vector<Eigen::Vector2d>& points) {
  std::ostringstream text;
  text << std::setprecision(12) << "[";
  for (std::size_t i = 0; i < points.size(); ++i) {
    text << (i == 0 ? "" : ", ") << points[i].x() << ", " << points[i].y();
  }
  return text.str() + "]";
}

std::string Truth(const Board& board, const std::string& symmetry) {
  std::ostringstream text;
  text << std::setprecision(12) << "    truth: { rotation: [";
  for (int i = 0; i < 9; ++i) text << (i == 0 ? "" : ", ") << board.rotation(i / 3, i % 3);
  text << "], translation: [" << board.translation.x() << ", " << board.translation.y() << ", "
       << board.translation.z() << "], symmetry: \"" << symmetry << "\" }\n";
  return text.str();
}

// The board's evidence, exact: the disc with its centre, two lines along X and two along Y.
std::string AnnotatedImage(const Board& board, const std::string& file) {
  std::vector<Eigen::Vector2d> contour;
  for (int i = 0; i < 40; ++i) {
    const double t = 2.0 * 3.14159265358979 * i / 40;
    contour.push_back(board.Pixel(0.5 * std::cos(t), 0.5 * std::sin(t)));
  }
  const auto p = [&board](double x, double y) { return board.Pixel(x, y); };
  std::ostringstream text;
  text << "  - file: \"" << file
       << "\"\n    camera: \"k\"\n    circles:\n      - { id: \"c\", contour: " << Numbers(contour)
       << ", center: " << Numbers({p(0, 0)}) << ", plane: \"p\" }\n    pencils:\n"
       << "      - { id: \"X\", segments: "
       << Numbers({p(-.9, -.9), p(.9, -.9), p(-.9, .9), p(.9, .9)})
       << ", direction: \"x\", plane: \"p\" }\n      - { id: \"Y\", segments: "
       << Numbers({p(-.9, -.9), p(-.9, .9), p(.9, -.9), p(.9, .9)})
       << ", direction: \"y\", plane: \"p\" }\n    frame: { plane: \"p\", origin_is_center: \"c\", "
          "x_axis: "
       << Numbers({p(0, 0), p(.9, 0)}) << ", y_axis: " << Numbers({p(0, 0), p(0, .9)}) << " }\n"
       << Truth(board, "none");
  return text.str();
}

std::string DetectedImage(const Board& board, const std::string& file) {
  return "  - file: \"" + file + "\"\n    camera: \"k\"\n" + Truth(board, "D4");
}

// Photos with evidence given and with evidence to detect; returns the scene file.
std::string MakeSet(const TestFolder& folder) {
  std::string scene = "%YAML:1.0\n---\n" + Camera() + "images:\n";
  for (const double tilt : {25.0, 40.0, 55.0}) {
    const Board board(tilt);
    const std::string name = "tilt" + std::to_string(static_cast<int>(tilt)) + ".png";
    board.Paint(folder / name);
    scene += AnnotatedImage(board, name) + DetectedImage(board, name);
  }
  return folder.Write("scene.yaml", scene);
}

std::set<std::string> FilesIn(const std::string& folder) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files.insert(std::filesystem::relative(entry.path(), folder).string());
  }
  return files;
}

TEST(Compare, WritesWhatItPromises) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  const Outcome outcome = RunCompare("--scene='" + scene + "' --output='" + folder / "out" + "'");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_CONTAINS(outcome.out, "joint");
  // The same photo twice: two pictures.
  EXPECT_EQ(
      FilesIn(folder / "out"),
      (std::set<std::string>{"observations.jsonl", "report.html", "results.jsonl", "summary.csv",
                             "timings.jsonl", "overlays/tilt25.png", "overlays/tilt25_2.png",
                             "overlays/tilt40.png", "overlays/tilt40_2.png", "overlays/tilt55.png",
                             "overlays/tilt55_2.png"}));

  const std::vector<Json> results = ReadJsonLines(folder / "out/results.jsonl");
  int num_joint = 0;
  for (const Json& line : results) {
    for (const char* key :
         {"image", "solver", "stage", "loss", "loss_scale_px", "status", "message", "hypothesis",
          "num_hypotheses", "probability", "rotation", "translation", "metric", "rms_px",
          "num_inliers", "num_observations", "sigma_rotation_deg", "free_directions"}) {
      ASSERT_TRUE(line.contains(key)) << key << " in " << line;
    }
    if (line["status"] != "ok") {
      EXPECT_NE(line["message"], "");
      continue;
    }
    EXPECT_EQ(line["rotation"].size(), 9U);
    EXPECT_TRUE(line.contains("normal_error_deg"));
    EXPECT_EQ(line.contains("rotation_error_deg"), line["free_directions"].empty()) << line;
    if (line["solver"] == "joint" && line["hypothesis"] == 0) ++num_joint;
  }
  EXPECT_EQ(num_joint, 6);

  const std::vector<Json> observations = ReadJsonLines(folder / "out/observations.jsonl");
  ASSERT_EQ(observations.size(), 6U);
  for (std::size_t i = 0; i < observations.size(); i += 2) {
    const Json& ellipse = observations[i]["ellipses"].at(0);
    EXPECT_EQ(ellipse["id"], "c");
    EXPECT_EQ(ellipse["conic"].size(), 6U);
    EXPECT_NEAR(ellipse["coverage"], 1.0, 1e-9);
    EXPECT_EQ(observations[i]["segments"].size(), 4U);
    EXPECT_EQ(observations[i]["segments"][0][4], "X");
    EXPECT_EQ(observations[i]["pencils"][0]["num_segments"], 2);
  }
  const std::string csv = ReadAll(folder / "out/summary.csv");
  EXPECT_EQ(csv.compare(0, 30, "solver,stage,loss,loss_scale_p"), 0) << csv;
  const std::string report = ReadAll(folder / "out/report.html");
  for (const char* reference :
       {"http:", "https:", "<link", "url(", "@import", "src='/", "src=\"/"}) {
    EXPECT_EQ(report.find(reference), std::string::npos) << reference;  // Nothing from elsewhere.
  }
  EXPECT_CONTAINS(report, "data:image/jpeg;base64,");
}

TEST(Compare, ExactEvidenceGivesTheTruth) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  ASSERT_EQ(RunCompare("--scene='" + scene + "' --overlays=false --output='" + folder / "out" + "'")
                .exit_code,
            0);
  const std::vector<Json> results = ReadJsonLines(folder / "out/results.jsonl");
  std::set<std::string> solvers;
  for (const Json& line : results) {
    if (line["status"] != "ok" || line["hypothesis"] != 0 ||
        !line.contains("translation_error_deg"))
      continue;
    if (!line.contains("rotation_error_deg")) continue;
    EXPECT_LT(line["rotation_error_deg"], 1e-3) << line;
    EXPECT_LT(line["translation_error_deg"], 1e-3) << line;
    solvers.insert(line["solver"]);
  }
  EXPECT_EQ(solvers.count("circle_frame"), 1U);
  EXPECT_EQ(solvers.count("line_pairs"), 1U);
  EXPECT_EQ(solvers.count("joint"), 1U);
}

TEST(Compare, SameBytesForAnyNumberOfThreads) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  for (const char* threads : {"1", "2", "3"}) {
    const Outcome outcome = RunCompare("--scene='" + scene + "' --threads=" + threads +
                                       " --robust_loss=huber,tukey --output='" +
                                       folder / (std::string("out") + threads) + "'");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  for (const std::string& file : FilesIn(folder / "out1")) {
    if (file == "timings.jsonl" || file == "report.html") continue;
    const std::string expected = ReadAll(folder / "out1/" + file);
    EXPECT_FALSE(expected.empty()) << file;
    EXPECT_EQ(ReadAll(folder / "out2/" + file), expected) << file;
    EXPECT_EQ(ReadAll(folder / "out3/" + file), expected) << file;
  }
  EXPECT_EQ(FilesIn(folder / "out1"), FilesIn(folder / "out3"));
}

TEST(Compare, ShardsPartTheImages) {
  const TestFolder folder;
  const std::string scene = MakeSet(folder);
  const auto lines = [&](const std::string& shard) {
    EXPECT_EQ(RunCompare("--scene='" + scene + "' --overlays=false --shard=" + shard +
                         " --output='" + folder / "out" + "'")
                  .exit_code,
              0);
    return ReadAll(folder / "out/observations.jsonl");
  };
  const std::vector<std::string> whole = [&] {
    std::vector<std::string> parts;
    std::istringstream text(lines("0/1"));
    for (std::string line; std::getline(text, line);) parts.push_back(line + "\n");
    return parts;
  }();
  ASSERT_EQ(whole.size(), 6U);
  EXPECT_EQ(lines("0/2"), whole[0] + whole[2] + whole[4]);
  EXPECT_EQ(lines("1/2"), whole[1] + whole[3] + whole[5]);
  EXPECT_EQ(lines("2/2"), whole[0] + whole[2] + whole[4]);
}

// ---- Bad input: the exit code, one line that names the thing, nothing half-written.

class CompareBadInput : public testing::Test {
 protected:
  CompareBadInput() {
    Board(30.0).Paint(folder_ / "good.png");
    folder_.Write("words.jpg", "these are words");
    folder_.Write("empty.jpg", "");
  }
  std::string SceneOf(const std::string& images) {
    return folder_.Write("scene.yaml", "%YAML:1.0\n---\n" + Camera() + "images:\n" + images);
  }
  std::string Image(const std::string& file) {
    return "  - { file: \"" + file + "\", camera: \"k\" }\n";
  }
  std::string Arguments(const std::string& scene) {
    return "--scene='" + scene + "' --output='" + folder_ / "out" + "' ";
  }
  // Exit code 2, one line on stderr with these words in it, no output.
  void ExpectUnusable(const std::string& arguments, const std::string& words) {
    const Outcome outcome = RunCompare(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << "\n" << outcome.err;
    EXPECT_CONTAINS(outcome.err, words.c_str());
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
  const TestFolder folder_;
};

TEST_F(CompareBadInput, UnreadablePhotosAreNamedAndTheRestIsDone) {
  const std::string scene =
      SceneOf(Image("missing.jpg") + Image("good.png") + Image("words.jpg") + Image("empty.jpg"));
  const Outcome outcome = RunCompare(Arguments(scene));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_CONTAINS(outcome.err, "missing.jpg: the file does not exist\n");
  EXPECT_CONTAINS(outcome.err, "words.jpg: is not an image that can be read\n");
  EXPECT_CONTAINS(outcome.err, "empty.jpg: the file is empty\n");
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 3) << outcome.err;
  for (const Json& line : ReadJsonLines(folder_ / "out/results.jsonl"))
    EXPECT_EQ(line["image"], "good.png");
  const std::vector<Json> observations = ReadJsonLines(folder_ / "out/observations.jsonl");
  ASSERT_EQ(observations.size(), 4U);
  EXPECT_TRUE(observations[0].contains("error"));
  EXPECT_FALSE(observations[1].contains("error"));
  EXPECT_FALSE(ReadJsonLines(folder_ / "out/results.jsonl").empty());
}

TEST_F(CompareBadInput, PhotoOfAnotherSizeThanItsCamera) {
  cv::imwrite(folder_ / "small.png", cv::Mat::zeros(20, 30, CV_8U));
  const Outcome outcome = RunCompare(Arguments(SceneOf(Image("small.png"))));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_CONTAINS(outcome.err, "30 x 20");
}

TEST_F(CompareBadInput, SceneFile) {
  const std::string good = Image("good.png");
  ExpectUnusable(Arguments(folder_ / "none.yaml"), "none.yaml: cannot be opened");
  ExpectUnusable(Arguments(folder_.path()), "is a folder");
  ExpectUnusable(Arguments(SceneOf("  - { file: \"good.png\", camera: \"k\", circels: [] }\n")),
                 "unknown key 'circels'; did you mean 'circles'?");
  ExpectUnusable(Arguments(SceneOf("  - { file: \"good.png\", camera: \"K2\" }\n")),
                 "there is no camera 'K2'");
  ExpectUnusable(Arguments(folder_.Write("broken.yaml", "%YAML:1.0\n---\nimages: [ {\n")),
                 "broken.yaml: not valid");
  ExpectUnusable(
      Arguments(folder_.Write("s.yaml",
                              "cameras:\n  - { id: \"k\", model: \"pinhole\" }\nimages:\n" + good)),
      "'camera_matrix' is missing: a camera needs its focal length");
}

TEST_F(CompareBadInput, Flags) {
  const std::string good = Arguments(SceneOf(Image("good.png")));
  ExpectUnusable(good + "--robust_los=huber",
                 "unknown flag --robust_los; did you mean 'robust_loss'?");
  ExpectUnusable(good + "--robust_loss=hubert", "--robust_loss: 'hubert' is not one of");
  ExpectUnusable(good + "--loss_scale_px=0", "--loss_scale_px: '0'");
  ExpectUnusable(good + "--loss_scale_px=1,-2", "--loss_scale_px: '-2'");
  ExpectUnusable(good + "--conic_loss=x", "--conic_loss: 'x'");
  ExpectUnusable(good + "--line_loss_scale_px=x", "--line_loss_scale_px: 'x'");
  ExpectUnusable(good + "--inlier_threshold_px=-1", "--inlier_threshold_px=-1");
  ExpectUnusable(good + "--inlier_threshold_px=two", "--inlier_threshold_px=two: must be a number");
  ExpectUnusable(good + "--inlier_threshold_px=nan", "--inlier_threshold_px=nan");
  ExpectUnusable(good + "--ransac_confidence=1.5", "--ransac_confidence=1.5");
  ExpectUnusable(good + "--ransac_max_iterations=0", "--ransac_max_iterations=0");
  ExpectUnusable(good + "--min_arc_deg=400", "--min_arc_deg=400");
  ExpectUnusable(good + "--seed=-1", "--seed=-1");
  ExpectUnusable(good + "--threads=-2", "--threads=-2");
  ExpectUnusable(good + "--threads", "--threads: its value is missing");
  ExpectUnusable(good + "--shard=3/2", "--shard=3/2");
  ExpectUnusable(good + "--solvers=joint,line_pair",
                 "there is no solver 'line_pair'; did you mean 'line_pairs'?");
  ExpectUnusable(good + "stray", "unexpected argument 'stray'");
  ExpectUnusable("--output='" + folder_ / "out" + "'", "give --scene");
  ExpectUnusable("--scene='" + folder_ / "scene.yaml" + "'", "--output is missing");
  ExpectUnusable(good + "--images=x.jpg", "not both");
  ExpectUnusable("--images='" + folder_ / "good.png" + "' --output='" + folder_ / "out" + "'",
                 "--images needs --camera");
}

TEST_F(CompareBadInput, CameraFile) {
  const std::string photos =
      "--images='" + folder_ / "good.png" + "' --output='" + folder_ / "out" + "' --camera=";
  ExpectUnusable(photos + "'" + folder_ / "none.yml" + "'", "none.yml: cannot be opened");
  ExpectUnusable(
      photos + "'" +
          folder_.Write("c.yml", "%YAML:1.0\n---\nimage_width: 320\nimage_height: 240\n") + "'",
      "'camera_matrix' is missing: a camera needs its focal length");
  ExpectUnusable("--images='" + folder_ / "*.tif" + "' --output='" + folder_ / "out" +
                     "' --camera='" +
                     folder_.Write("cameras.txt", "1 SIMPLE_PINHOLE 320 240 300 160 120\n") + "'",
                 "nothing matches");
}

TEST_F(CompareBadInput, OutputThatCannotBe) {
  folder_.Write("file", "x");
  const Outcome outcome = RunCompare("--scene='" + SceneOf(Image("good.png")) + "' --output='" +
                                     folder_ / "file" + "'");
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_EQ(ReadAll(folder_ / "file"), "x");
}

TEST_F(CompareBadInput, HelpAndVersionAndSolvers) {
  Outcome outcome = RunCompare("--help");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_CONTAINS(outcome.out, "--loss_scale_px");
  outcome = RunCompare("--version");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_CONTAINS(outcome.out, "circline_compare ");
  outcome = RunCompare("--list_solvers");
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* name : {"circle_center", "circle_frame", "line_pairs", "joint"}) {
    EXPECT_CONTAINS(outcome.out, name);
  }
}

TEST_F(CompareBadInput, PhotosWithoutASceneFile) {
  const std::string camera = folder_.Write("cameras.txt", "1 SIMPLE_PINHOLE 320 240 300 160 120\n");
  const Outcome outcome =
      RunCompare("--images='" + folder_ / "g*.png" + "' --camera='" + camera +
                 "' --solvers=joint,line_pairs --output='" + folder_ / "out" + "'");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::set<std::string> solvers;
  for (const Json& line : ReadJsonLines(folder_ / "out/results.jsonl"))
    solvers.insert(line["solver"]);
  EXPECT_EQ(solvers, (std::set<std::string>{"joint", "line_pairs"}));
}

}  // namespace
}  // namespace circline::apps
