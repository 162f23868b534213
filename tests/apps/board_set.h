// Photos that the tests of circline_compare paint for themselves, and their scene file.
#ifndef CIRCLINE_TESTS_APPS_BOARD_SET_H_
#define CIRCLINE_TESTS_APPS_BOARD_SET_H_

#include <Eigen/Core>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tests/apps/test_files.h"

namespace circline::apps {

// A disc in a frame on a tilted board, no distortion.

inline constexpr int kWidth = 320, kHeight = 240;
inline constexpr double kFocal = 300.0;

// A photo whose pixels are means of finer x finer samples of brightness(u, v).
void PaintPhoto(const std::string& path, int width, int height, int finer,
                const std::function<double(double, double)>& brightness);

struct Board {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;

  explicit Board(double tilt_deg);
  Eigen::Vector2d Pixel(double x, double y) const;
  // Brightness where the pixel's ray meets the board.
  double Brightness(double u, double v) const;
  void Paint(const std::string& path) const;
};

std::string BoardCamera();
std::string Numbers(const std::vector<Eigen::Vector2d>& points);
std::string TruthText(const Board& board, const std::string& symmetry);
// The board's evidence, exact: the disc with its centre, two lines along X and two along Y.
std::string AnnotatedImage(const Board& board, const std::string& file);
std::string DetectedImage(const Board& board, const std::string& file);
// Photos with evidence given and with evidence to detect, and `more` images; returns the scene
// file.
std::string MakeSet(const TestFolder& folder, const std::string& more = "");
// A photo that is not there.
inline constexpr char kMissingImage[] = "  - { file: \"gone.png\", camera: \"k\" }\n";

std::set<std::string> FilesIn(const std::string& folder);
// The files whose bytes a run must repeat: all but those with times.
std::set<std::string> RepeatableFilesIn(const std::string& folder);
void ExpectSameFiles(const std::string& expected, const std::string& actual);

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_BOARD_SET_H_
