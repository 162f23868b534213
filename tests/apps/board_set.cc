#include "tests/apps/board_set.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "circline/estimators/basics.h"

namespace circline::apps {

Board::Board(double tilt_deg) {
  rotation = Eigen::AngleAxisd(tilt_deg * kDegree, Eigen::Vector3d(1.0, 0.4, 0.1).normalized());
  translation = Eigen::Vector3d(-0.1, 0.05, 4.0);
}

Eigen::Vector2d Board::Pixel(double x, double y) const {
  const Eigen::Vector3d p = rotation * Eigen::Vector3d(x, y, 0.0) + translation;
  return {kFocal * p.x() / p.z() + (kWidth - 1) / 2.0,
          kFocal * p.y() / p.z() + (kHeight - 1) / 2.0};
}

double Board::Brightness(double u, double v) const {
  const Eigen::Vector3d ray((u - (kWidth - 1) / 2.0) / kFocal, (v - (kHeight - 1) / 2.0) / kFocal,
                            1.0);
  const Eigen::Vector3d normal = rotation.col(2);
  const Eigen::Vector3d p =
      rotation.transpose() * (normal.dot(translation) / normal.dot(ray) * ray - translation);
  if (p.head<2>().norm() < 0.5) return 40.0;  // The disc.
  const double away = std::max(std::abs(p.x()), std::abs(p.y()));
  return away > 0.7 && away < 0.9 ? 70.0 : 210.0;  // A square frame about it.
}

void PaintPhoto(const std::string& path, int width, int height, int finer,
                const std::function<double(double, double)>& brightness) {
  cv::Mat photo(height, width, CV_8U);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      double sum = 0.0;
      for (int i = 0; i < finer * finer; ++i) {
        sum += brightness(u + (i % finer + 0.5) / finer - 0.5, v + (i / finer + 0.5) / finer - 0.5);
      }
      photo.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(std::lround(sum / (finer * finer)));
    }
  }
  cv::imwrite(path, photo);
}

void Board::Paint(const std::string& path) const {
  PaintPhoto(path, kWidth, kHeight, 4, [this](double u, double v) { return Brightness(u, v); });
}

std::string BoardCamera() {
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

std::string TruthText(const Board& board, const std::string& symmetry) {
  std::ostringstream text;
  text << std::setprecision(12) << "    truth: { rotation: [";
  for (int i = 0; i < 9; ++i) text << (i == 0 ? "" : ", ") << board.rotation(i / 3, i % 3);
  text << "], translation: [" << board.translation.x() << ", " << board.translation.y() << ", "
       << board.translation.z() << "], symmetry: \"" << symmetry << "\" }\n";
  return text.str();
}

std::string AnnotatedImage(const Board& board, const std::string& file) {
  std::vector<Eigen::Vector2d> contour;
  for (int i = 0; i < 40; ++i) {
    const double t = 2.0 * kPi * i / 40;
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
       << TruthText(board, "none");
  return text.str();
}

std::string DetectedImage(const Board& board, const std::string& file) {
  return "  - file: \"" + file + "\"\n    camera: \"k\"\n" + TruthText(board, "D4");
}

std::string MakeSet(const TestFolder& folder, const std::string& more) {
  std::string scene = "%YAML:1.0\n---\n" + BoardCamera() + "images:\n";
  for (const double tilt : {25.0, 40.0, 55.0}) {
    const Board board(tilt);
    const std::string name = "tilt" + std::to_string(static_cast<int>(tilt)) + ".png";
    board.Paint(folder / name);
    scene += AnnotatedImage(board, name) + DetectedImage(board, name);
  }
  return folder.Write("scene.yaml", scene + more);
}

std::set<std::string> FilesIn(const std::string& folder) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files.insert(std::filesystem::relative(entry.path(), folder).string());
  }
  return files;
}

std::set<std::string> RepeatableFilesIn(const std::string& folder) {
  std::set<std::string> files = FilesIn(folder);
  files.erase("timings.jsonl");
  files.erase("report.html");
  return files;
}

void ExpectSameFiles(const std::string& expected, const std::string& actual) {
  EXPECT_EQ(FilesIn(actual), FilesIn(expected));
  for (const std::string& file : RepeatableFilesIn(expected)) {
    const std::string bytes = ReadAll(expected + "/" + file);
    EXPECT_FALSE(bytes.empty()) << file;
    EXPECT_TRUE(ReadAll(actual + "/" + file) == bytes) << file << " differs";
  }
}

}  // namespace circline::apps
