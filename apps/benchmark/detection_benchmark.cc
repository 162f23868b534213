// What detection finds on photographs with truth: prints one table a kind of truth.
//
//     circline_detection_benchmark --data=DIR [--set=NAME]
//
// DIR holds folders with a groundtruth.yml (camera, and per photo what is true of it) or, for
// renderings, a truth.csv; each is measured by what its truth offers.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/detection_tables.h"

namespace circline::benchmark {
namespace {

void MeasureFolder(const std::string& folder) {
  if (std::ifstream(folder + "/truth.csv").good()) {
    MeasureRenderings(folder);
    return;
  }
  cv::FileStorage file;
  if (!std::ifstream(folder + "/groundtruth.yml").good() ||
      !file.open(folder + "/groundtruth.yml", cv::FileStorage::READ)) {
    return;
  }
  const cv::FileNode root = file.root();
  const bool calibrated = !root["camera_matrix"].empty() || !root["cameras"].empty();
  if (calibrated) {
    MeasurePhotographs(folder, root);
    MeasureSegments(folder, root);
  } else {
    MeasureLabels(folder, root);
  }
}

std::string Flag(int argc, char** argv, const std::string& name) {
  const std::string prefix = "--" + name + "=";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind(prefix, 0) == 0) return argument.substr(prefix.size());
  }
  return std::string();
}

int Main(int argc, char** argv) {
  const std::string data = Flag(argc, argv, "data"), set = Flag(argc, argv, "set");
  if (data.empty()) {
    std::fprintf(stderr, "usage: %s --data=DIR [--set=NAME]\n", argv[0]);
    return 2;
  }
  cv::setNumThreads(1);
  if (!set.empty()) {
    MeasureFolder(data + "/" + set);
    return 0;
  }
  std::vector<cv::String> files;
  cv::glob(data + "/*", files, true);
  std::vector<std::string> folders;
  for (const std::string& f : files) {
    const std::string folder = f.substr(0, f.find_last_of('/'));
    if (folders.empty() || folders.back() != folder) folders.push_back(folder);
  }
  std::sort(folders.begin(), folders.end());
  folders.erase(std::unique(folders.begin(), folders.end()), folders.end());
  for (const std::string& folder : folders) MeasureFolder(folder);
  return 0;
}

}  // namespace
}  // namespace circline::benchmark

int main(int argc, char** argv) { return circline::benchmark::Main(argc, argv); }
