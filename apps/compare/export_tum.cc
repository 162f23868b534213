#include <Eigen/Geometry>
#include <filesystem>
#include <sstream>

#include "apps/common/output_file.h"
#include "apps/common/text.h"
#include "apps/compare/export.h"

namespace circline::apps {
namespace {

class TumExporter : public Exporter {
 public:
  explicit TumExporter(std::string folder) : folder_(std::move(folder)) {
    lines_.precision(17);
    lines_ << "# time tx ty tz qx qy qz qw\n";
  }

  void Add(const ExportedPose& pose) override {
    const std::string stem = std::filesystem::path(pose.name).stem().string();
    double time = 0.0;
    const Eigen::Vector3d center = -(pose.rotation.transpose() * pose.translation);
    const Eigen::Quaterniond q(pose.rotation.transpose().eval());
    lines_ << (pose.time_s                ? FormatFixed(*pose.time_s, 6)
               : ParseDouble(stem, &time) ? stem
                                          : std::to_string(pose.index))
           << " " << center.x() << " " << center.y() << " " << center.z() << " " << q.x() << " "
           << q.y() << " " << q.z() << " " << q.w() << "\n";
  }

  Status Finish() override { return WriteFile(folder_ + "/trajectory.txt", lines_.str()); }

 private:
  std::string folder_;
  std::ostringstream lines_;
};

}  // namespace

std::unique_ptr<Exporter> MakeTumExporter(const std::string& folder) {
  return std::make_unique<TumExporter>(folder);
}

}  // namespace circline::apps
