// What detection finds on photographs with truth: prints one table a kind of truth.
//
//     circline_detection_benchmark --data=DIR [--set=NAME]
//     circline_detection_benchmark --data=DIR [--set=NAME] --speed
//     circline_detection_benchmark --render_seed=1 [--render_seeds=5] [--render_count=60]
//
// DIR holds folders with a groundtruth.yml (camera, and per photo what is true of it); each is
// measured by what its truth offers. The third form renders sets of 60 images of its own, one a
// seed, and prints a row for each and their mean.
#include <gflags/gflags.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/detection_tables.h"
#include "apps/common/flags_util.h"

DEFINE_string(data, "", "A folder with a folder for each set of photographs.");
DEFINE_string(set, "", "Only this set.");
DEFINE_bool(speed, false, "Times only.");
DEFINE_int32(render_seed, -1, "Measure renderings of this and the following seeds instead.");
DEFINE_int32(render_seeds, 1, "How many seeds.");
DEFINE_int32(render_count, 60, "Images of each seed.");
DEFINE_string(render_textures, "/usr/share/doc/opencv-doc/examples/data",
              "The sample photographs of OpenCV, for the ground.");

namespace circline::apps {
namespace {

void MeasureFolder(const std::string& folder) {
  cv::FileStorage file;
  if (!std::ifstream(folder + "/groundtruth.yml").good() ||
      !file.open(folder + "/groundtruth.yml", cv::FileStorage::READ)) {
    return;
  }
  const cv::FileNode root = file.root();
  const bool calibrated = !root["camera_matrix"].empty() || !root["cameras"].empty();
  if (FLAGS_speed) {
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

int Run() {
  cv::setNumThreads(1);
  if (FLAGS_render_seed >= 0) {
    if (MeasureRenderings(FLAGS_render_textures, FLAGS_render_seed, FLAGS_render_seeds,
                          FLAGS_render_count)) {
      return kExitOk;
    }
    SayOnStderr("circline_detection_benchmark: no photographs in " + FLAGS_render_textures);
    return kExitUnreadable;
  }
  if (FLAGS_data.empty()) {
    SayOnStderr("circline_detection_benchmark: --data or --render_seed is missing");
    return kExitUsage;
  }
  if (FLAGS_speed) {
    MeasureRingSpeed();
    std::printf("photographs              640 x 480 ms     worst     12 MP  12 MP tiled\n");
  }
  const std::vector<std::string> folders =
      FLAGS_set.empty() ? FoldersBelow(FLAGS_data)
                        : std::vector<std::string>{FLAGS_data + "/" + FLAGS_set};
  for (const std::string& folder : folders) MeasureFolder(folder);
  return kExitOk;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunApp(
      argc, argv, "circline_detection_benchmark",
      "circline_detection_benchmark: what detection finds on photographs with truth.",
      circline::apps::Run);
}
