// Readers that are given a path: calibrations, noise models, models of COLMAP's. The input is one
// file; of a model, what is before and behind kBetween.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/common/camera_file.h"
#include "apps/common/colmap_file.h"
#include "apps/common/noise_file.h"
#include "tests/fuzz/fuzz.h"

namespace circline::fuzz {
namespace {

constexpr char kBetween[] = "\n==\n";

// One for the whole run.
const std::string& Folder() {
  static const std::string* const folder = [] {
    std::string made = std::filesystem::temp_directory_path() / "circline_fuzz_XXXXXX";
    Expect(mkdtemp(made.data()) != nullptr, "a folder can be made");
    std::atexit([] { std::filesystem::remove_all(Folder()); });
    return new std::string(made);
  }();
  return *folder;
}

std::string Write(const std::string& name, const std::string& content) {
  const std::string path = Folder() + "/" + name;
  std::ofstream(path, std::ios::binary) << content;
  return path;
}

void ExpectSentence(const Status& status) {
  Expect(status.ok() || !status.message.empty(), "what is refused says why");
}

void ReadModel(const std::string& cameras, const std::string& images, const std::string& suffix) {
  const std::string first = Write("cameras" + suffix, cameras);
  const std::string second = Write("images" + suffix, images);
  apps::ColmapModel model;
  const Status status = apps::ReadColmapModel(Folder(), &model);
  ExpectSentence(status);
  for (const apps::ColmapImage& image : model.images)
    Expect(image.camera < model.cameras.size(), "an image has a camera");
  if (status.ok()) {
    for (const Camera& camera : model.cameras)
      Expect(camera.Validate().ok(), "a camera of a model is valid");
  }
  std::filesystem::remove(first);
  std::filesystem::remove(second);
}

}  // namespace
}  // namespace circline::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::size_t between = text.find(fuzz::kBetween);
  if (between != std::string::npos) {
    const std::string images = text.substr(between + sizeof(fuzz::kBetween) - 1);
    fuzz::ReadModel(text.substr(0, between), images, ".txt");
    fuzz::ReadModel(text.substr(0, between), images, ".bin");
    return 0;
  }
  const std::string path = fuzz::Write("file", text);
  std::vector<Camera> cameras;
  const Status status = apps::ReadCameraFile(path, &cameras);
  fuzz::ExpectSentence(status);
  fuzz::Expect(status.ok() == !cameras.empty(), "a camera file has cameras, or is refused");
  for (const Camera& camera : cameras)
    fuzz::Expect(camera.Validate().ok(), "the camera of a file is valid");
  NoiseModel noise;
  fuzz::ExpectSentence(apps::ReadNoiseModel(path, &noise));
  fuzz::Expect(noise.Validate().ok(), "a noise model that was read is valid");
  return 0;
}
