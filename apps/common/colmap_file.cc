#include "apps/common/colmap_file.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "apps/common/storage_node.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

// By COLMAP's number of a camera.
using CameraIndex = std::map<std::string, std::size_t>;

// Camera, pose and name are checked and added; `q`: w, x, y, z.
Status AddImage(const std::string& name, const std::string& camera, const CameraIndex& cameras,
                const double* q, const double* t, std::set<std::string>* names,
                ColmapModel* model) {
  ColmapImage image;
  image.name = name;
  const auto of = cameras.find(camera);
  if (name.empty()) return Status::Invalid("an image has no name");
  if (!names->insert(name).second) return Status::Invalid("image " + name + " stands there twice");
  if (of == cameras.end())
    return Status::Invalid("image " + name + ": there is no camera " + camera);
  image.camera = of->second;
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  const double norm = rotation.norm();  // 1, but for what the file rounds.
  constexpr double kRounded = 0.01;
  if (!(std::abs(norm - 1.0) < kRounded))
    return Status::Invalid("image " + name + ": its rotation is no unit quaternion");
  image.cam_from_world = {rotation.normalized().toRotationMatrix(), {t[0], t[1], t[2]}};
  if (!image.cam_from_world.translation.allFinite())
    return Status::Invalid("image " + name + ": its translation is not finite");
  model->images.push_back(std::move(image));
  return Status::Ok();
}

// Numbers as COLMAP writes them: little-endian, which this machine is taken to be, too.
class BinaryFile {
 public:
  explicit BinaryFile(const std::string& path) : file_(path, std::ios::binary) {
    std::error_code error;
    size_ = std::filesystem::file_size(path, error);
  }

  template <typename T>
  T Read() {
    T value{};
    file_.read(reinterpret_cast<char*>(&value), sizeof(T));
    return value;
  }
  std::string ReadName() {
    std::string name;
    std::getline(file_, name, '\0');
    return name;
  }
  void Skip(std::uint64_t count, std::uint64_t bytes) {
    if (count > size_ / bytes) {
      file_.setstate(std::ios::failbit);
    } else {
      file_.seekg(static_cast<std::streamoff>(count * bytes), std::ios::cur);
    }
  }
  // Whether so many things of so many bytes or more can be there.
  bool CanHave(std::uint64_t count, std::uint64_t bytes) const { return count <= size_ / bytes; }
  bool ok() const { return file_.good(); }

 private:
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

Status CutOff(const std::string& path) {
  return Status::Invalid(path + ": is cut off, or no file of COLMAP's");
}

Status ReadBinaryCameras(const std::string& path, ColmapModel* model, CameraIndex* index) {
  static constexpr const char* kModels[] = {"SIMPLE_PINHOLE",
                                            "PINHOLE",
                                            "SIMPLE_RADIAL",
                                            "RADIAL",
                                            "OPENCV",
                                            "OPENCV_FISHEYE",
                                            "FULL_OPENCV",
                                            "FOV",
                                            "SIMPLE_RADIAL_FISHEYE",
                                            "RADIAL_FISHEYE",
                                            "THIN_PRISM_FISHEYE"};
  constexpr std::size_t kNumModels = sizeof(kModels) / sizeof(kModels[0]);
  BinaryFile file(path);
  const auto count = file.Read<std::uint64_t>();
  constexpr std::uint64_t kLeastBytes = 48;
  if (!file.ok() || !file.CanHave(count, kLeastBytes)) return CutOff(path);
  for (std::uint64_t i = 0; i < count; ++i) {
    Camera camera;
    camera.id = std::to_string(file.Read<std::uint32_t>());
    const auto number = file.Read<std::uint32_t>();
    const auto width = file.Read<std::uint64_t>(), height = file.Read<std::uint64_t>();
    if (!file.ok()) return CutOff(path);
    const std::string name =
        number < kNumModels ? kModels[number] : "number " + std::to_string(number);
    std::size_t num_parameters = 0;
    Status status = NumColmapParameters(name, &num_parameters);
    constexpr std::uint64_t kMostPixels = 1U << 20;
    if (status.ok() && (width > kMostPixels || height > kMostPixels))
      status = Status::Invalid("is " + std::to_string(width) + " by " + std::to_string(height));
    if (status.ok()) {
      camera.width = static_cast<int>(width);
      camera.height = static_cast<int>(height);
      std::vector<double> parameters(num_parameters);
      for (double& p : parameters) p = file.Read<double>();
      if (!file.ok()) return CutOff(path);
      status = SetColmapCamera(name, parameters, &camera);
    }
    if (status.ok() && !index->insert({camera.id, model->cameras.size()}).second)
      status = Status::Invalid("stands there twice");
    if (!status.ok())
      return Status::Invalid(path + ": camera " + camera.id + ": " + status.message);
    model->cameras.push_back(camera);
  }
  return Status::Ok();
}

Status ReadBinaryImages(const std::string& path, const CameraIndex& cameras, ColmapModel* model) {
  BinaryFile file(path);
  const auto count = file.Read<std::uint64_t>();
  constexpr std::uint64_t kLeastBytes = 73, kPointBytes = 24;
  if (!file.ok() || !file.CanHave(count, kLeastBytes)) return CutOff(path);
  std::set<std::string> names;
  for (std::uint64_t i = 0; i < count; ++i) {
    file.Read<std::uint32_t>();  // Its number.
    double q[4], t[3];
    for (double& v : q) v = file.Read<double>();
    for (double& v : t) v = file.Read<double>();
    const std::string camera = std::to_string(file.Read<std::uint32_t>());
    const std::string name = file.ReadName();
    file.Skip(file.Read<std::uint64_t>(), kPointBytes);
    if (!file.ok()) return CutOff(path);
    const Status status = AddImage(name, camera, cameras, q, t, &names, model);
    if (!status.ok()) return Status::Invalid(path + ": " + status.message);
  }
  return Status::Ok();
}

// "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME", and the line of its points after each.
Status ReadTextImages(const std::string& path, const CameraIndex& cameras, ColmapModel* model) {
  std::ifstream file(path);
  if (!file) return Status::Invalid(path + ": cannot be opened");
  std::set<std::string> names;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    std::istringstream stream(line);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    double numbers[7] = {};
    bool good = words.size() >= 10;
    for (std::size_t k = 0; k < 7 && good; ++k) good = ParseDouble(words[k + 1], &numbers[k]);
    const Status status =
        good ? AddImage(words[9], words[8], cameras, numbers, numbers + 4, &names, model)
             : Status::Invalid("is not \"ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\"");
    if (!status.ok())
      return Status::Invalid(path + ": line " + std::to_string(number) + ": " + status.message);
    std::getline(file, line);
    ++number;
  }
  return Status::Ok();
}

bool IsFile(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

}  // namespace

Status ReadColmapModel(const std::string& folder, ColmapModel* model) {
  *model = ColmapModel();
  const std::string cameras = folder + "/cameras", images = folder + "/images";
  const bool is_binary = IsFile(cameras + ".bin") && IsFile(images + ".bin");
  if (!is_binary && !(IsFile(cameras + ".txt") && IsFile(images + ".txt"))) {
    return Status::Invalid(folder +
                           ": has no COLMAP model: cameras.bin and images.bin, or cameras.txt and "
                           "images.txt (its mapper makes numbered folders, sparse/0)");
  }
  CameraIndex index;
  Status status;
  if (is_binary) {
    status = ReadBinaryCameras(cameras + ".bin", model, &index);
  } else {
    std::string text;
    status = ReadTextFile(cameras + ".txt", &text);
    if (status.ok()) status = ParseColmapCameras(cameras + ".txt", text, &model->cameras);
    for (std::size_t i = 0; i < model->cameras.size(); ++i) index[model->cameras[i].id] = i;
  }
  if (status.ok()) {
    status = is_binary ? ReadBinaryImages(images + ".bin", index, model)
                       : ReadTextImages(images + ".txt", index, model);
  }
  if (status.ok() && model->images.empty()) status = Status::Invalid(folder + ": has no image");
  return status;
}

std::vector<std::string> FilesOfColmapModel(const std::string& folder) {
  std::vector<std::string> files;
  for (const char* name : {"cameras", "images", "points3D"}) {
    for (const char* extension : {".bin", ".txt"}) {
      const std::string path = folder + "/" + name + extension;
      if (IsFile(path)) files.push_back(path);
    }
  }
  return files;
}

}  // namespace circline::apps
