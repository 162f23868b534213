// What detection finds on photographs with truth: prints one table a kind of truth.
//
//     circline_detection_benchmark --data=DIR [--set=NAME]
//     circline_detection_benchmark --data=DIR [--set=NAME] --speed
//     circline_detection_benchmark --render_seed=1 [--render_seeds=5] [--render_count=60]
//         [--render_textures=DIR] [--render_output=DIR]
//
// DIR holds folders with a groundtruth.yml (camera, and per photo what is true of it) or, for
// renderings, a truth.csv; each is measured by what its truth offers. --speed prints times only.
// The third form renders sets of 60 images of its own, one a seed, and prints a row for each and
// their mean; or writes the first of them as such a folder. Its textures are the photographs of the
// package opencv-doc.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/detection_tables.h"

namespace circline::benchmark {
namespace {

void MeasureFolder(const std::string& folder, bool speed) {
  if (std::ifstream(folder + "/truth.csv").good()) {
    if (!speed) MeasureRenderings(folder);
    return;
  }
  cv::FileStorage file;
  if (!std::ifstream(folder + "/groundtruth.yml").good() ||
      !file.open(folder + "/groundtruth.yml", cv::FileStorage::READ)) {
    return;
  }
  const cv::FileNode root = file.root();
  const bool calibrated = !root["camera_matrix"].empty() || !root["cameras"].empty();
  if (speed) {
    if (calibrated) MeasureSpeed(folder, root);
  } else if (calibrated) {
    MeasurePhotographs(folder, root);
    MeasureSegments(folder, root);
  } else {
    MeasureLabels(folder, root);
  }
}

std::vector<std::string> FoldersBelow(const std::string& data) {
  std::vector<cv::String> files;
  cv::glob(data + "/*", files, true);
  std::vector<std::string> folders;
  for (const std::string& f : files) folders.push_back(f.substr(0, f.find_last_of('/')));
  std::sort(folders.begin(), folders.end());
  folders.erase(std::unique(folders.begin(), folders.end()), folders.end());
  return folders;
}

std::string Flag(int argc, char** argv, const std::string& name) {
  const std::string prefix = "--" + name + "=";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind(prefix, 0) == 0) return argument.substr(prefix.size());
  }
  return std::string();
}

int NumberFlag(int argc, char** argv, const std::string& name, int preset) {
  const std::string value = Flag(argc, argv, name);
  return value.empty() ? preset : std::atoi(value.c_str());
}

int Render(int argc, char** argv) {
  std::string textures = Flag(argc, argv, "render_textures");
  if (textures.empty()) textures = "/usr/share/doc/opencv-doc/examples/data";
  const std::string output = Flag(argc, argv, "render_output");
  const int seed = NumberFlag(argc, argv, "render_seed", 1);
  const int count = NumberFlag(argc, argv, "render_count", 60);
  const bool done =
      output.empty()
          ? MeasureFreshRenderings(textures, seed, NumberFlag(argc, argv, "render_seeds", 1), count)
          : WriteRenderings(textures, seed, count, output);
  if (!done) std::fprintf(stderr, "no photographs in %s, or no output\n", textures.c_str());
  return done ? 0 : 1;
}

int Main(int argc, char** argv) {
  const std::string data = Flag(argc, argv, "data"), set = Flag(argc, argv, "set");
  cv::setNumThreads(1);
  if (!Flag(argc, argv, "render_seed").empty()) return Render(argc, argv);
  if (data.empty()) {
    std::fprintf(stderr, "usage: %s --data=DIR [--set=NAME] [--speed] | --render_seed=N\n",
                 argv[0]);
    return 2;
  }
  const bool speed = std::find(argv + 1, argv + argc, std::string("--speed")) != argv + argc;
  const std::vector<std::string> folders =
      set.empty() ? FoldersBelow(data) : std::vector<std::string>{data + "/" + set};
  if (speed) {
    MeasureRingSpeed();
    std::printf("photographs              640 x 480 ms     worst     12 MP  12 MP tiled\n");
  }
  for (const std::string& folder : folders) MeasureFolder(folder, speed);
  return 0;
}

}  // namespace
}  // namespace circline::benchmark

int main(int argc, char** argv) { return circline::benchmark::Main(argc, argv); }
