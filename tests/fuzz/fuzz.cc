#include "tests/fuzz/fuzz.h"

#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <string>

namespace circline::fuzz {
namespace {

using Eigen::Vector2d;

Camera ArbitraryCamera(Bytes* bytes) {
  Camera camera;
  camera.id = "camera";
  camera.width = 640;
  camera.height = 480;
  camera.fx = bytes->Number(200.0, 2000.0);
  camera.fy = bytes->OneIn(4) ? bytes->Number(200.0, 2000.0) : camera.fx;
  camera.cx = bytes->Number(200.0, 440.0);
  camera.cy = bytes->Number(150.0, 330.0);
  camera.model = static_cast<CameraModel>(bytes->Below(3));
  if (camera.model == CameraModel::kPinhole) return camera;
  for (std::size_t i = 0; i < 4; ++i) camera.distortion[i] = bytes->Number(-0.2, 0.2);
  return camera;
}

Vector2d ArbitraryPixel(Bytes* bytes) {
  const double x = bytes->Number(-50.0, 690.0);
  return {x, bytes->Number(-50.0, 530.0)};
}

std::string ArbitraryId(Bytes* bytes) {
  return bytes->OneIn(2) ? "" : std::string(1, static_cast<char>('a' + bytes->Below(2)));
}

// Most contours are arcs of ellipses, with some noise.
void AddContour(Bytes* bytes, CircleObservation* circle) {
  const int count = bytes->Below(24);
  const bool is_ellipse = !bytes->OneIn(6);
  const Vector2d center = ArbitraryPixel(bytes);
  const double a = bytes->Between(2.0, 200.0), b = a * bytes->Between(0.0, 1.0);
  const double turn = bytes->Between(0.0, 3.2), arc = bytes->Between(0.2, 6.3);
  const double noise = bytes->Between(0.0, 3.0);
  for (int i = 0; i < count; ++i) {
    const double t = arc * i / count;
    const Vector2d p(a * std::cos(t), b * std::sin(t));
    const Vector2d on_ellipse = center + Vector2d(std::cos(turn) * p.x() - std::sin(turn) * p.y(),
                                                  std::sin(turn) * p.x() + std::cos(turn) * p.y());
    const double off = noise * bytes->Between(-1.0, 1.0);
    circle->points.push_back(is_ellipse ? on_ellipse + Vector2d(off, -off) : ArbitraryPixel(bytes));
  }
}

CircleObservation ArbitraryCircle(int i, Bytes* bytes) {
  CircleObservation circle;
  circle.id = bytes->OneIn(16) ? "" : "c" + std::to_string(i);
  AddContour(bytes, &circle);
  circle.plane = ArbitraryId(bytes);
  circle.concentric = ArbitraryId(bytes);
  circle.radius_group = ArbitraryId(bytes);
  if (bytes->OneIn(2)) circle.sigma_px = bytes->Number(0.01, 3.0);
  if (bytes->OneIn(3)) circle.radius = bytes->Number(0.1, 100.0);
  if (bytes->OneIn(3)) circle.center = ArbitraryPixel(bytes);
  if (bytes->OneIn(4)) circle.diameters = {{ArbitraryPixel(bytes), ArbitraryPixel(bytes)}};
  circle.contrast = bytes->Below(3) - 1;
  return circle;
}

PencilObservation ArbitraryPencil(int i, Bytes* bytes) {
  PencilObservation pencil;
  pencil.id = bytes->OneIn(16) ? "" : "p" + std::to_string(i);
  pencil.plane = ArbitraryId(bytes);
  pencil.direction = static_cast<PencilDirection>(bytes->Below(4));
  if (bytes->OneIn(2)) pencil.sigma_px = bytes->Number(0.01, 3.0);
  const Vector2d meet{bytes->Number(-3000.0, 3000.0), bytes->Number(-3000.0, 3000.0)};
  const int count = bytes->Below(5);
  for (int k = 0; k < count; ++k) {
    const Vector2d start = ArbitraryPixel(bytes);
    const Vector2d end = start + bytes->Between(0.0, 0.4) * (meet - start);
    LineObservation line;
    line.points = {start, bytes->OneIn(8) ? ArbitraryPixel(bytes) : end};
    if (bytes->OneIn(4)) line.points.push_back(ArbitraryPixel(bytes));
    pencil.lines.push_back(line);
  }
  return pencil;
}

}  // namespace

int Bytes::Byte() {
  if (size_ == 0) return 0;
  --size_;
  return *data_++;
}

double Bytes::Between(double low, double high) {
  const int high_byte = Byte();
  return low + (high - low) * (256 * high_byte + Byte()) / 65535.0;
}

double Bytes::Number(double low, double high) {
  if (Below(64) != 63) return Between(low, high);
  std::uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) bits = bits << 8 | static_cast<std::uint64_t>(Byte());
  double value = 0.0;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

Observations ArbitraryObservations(Bytes* bytes) {
  Observations observations;
  observations.camera = ArbitraryCamera(bytes);
  const int circles = bytes->Below(4), pencils = bytes->Below(4);
  for (int i = 0; i < circles; ++i) observations.circles.push_back(ArbitraryCircle(i, bytes));
  for (int i = 0; i < pencils; ++i) observations.pencils.push_back(ArbitraryPencil(i, bytes));
  FrameObservation& frame = observations.frame;
  frame.plane = ArbitraryId(bytes);
  if (bytes->OneIn(4)) frame.origin = ArbitraryPixel(bytes);
  if (bytes->OneIn(4)) frame.x_axis = Segment{ArbitraryPixel(bytes), ArbitraryPixel(bytes)};
  if (bytes->OneIn(8)) frame.y_axis = Segment{ArbitraryPixel(bytes), ArbitraryPixel(bytes)};
  if (circles > 0 && bytes->OneIn(8)) frame.origin_is_center = observations.circles[0].id;
  if (pencils > 1 && bytes->OneIn(4)) {
    observations.known_angles.push_back({{observations.pencils[0].id, observations.pencils[1].id},
                                         bytes->Number(0.0, 3.2),
                                         bytes->Number(0.0, 0.1)});
  }
  if (bytes->OneIn(8)) {
    observations.known_lengths.push_back({{ArbitraryPixel(bytes), ArbitraryPixel(bytes)},
                                          frame.plane,
                                          bytes->Number(0.1, 100.0),
                                          bytes->Number(0.0, 0.1)});
  }
  return observations;
}

void ExpectSound(const PoseEstimate& estimate) {
  if (!estimate.status.ok()) {
    Expect(!estimate.status.message.empty(), "what is refused says why");
    Expect(estimate.hypotheses.empty(), "what is refused has no hypothesis");
    return;
  }
  Expect(!estimate.hypotheses.empty(), "an estimate has a hypothesis");
  double sum = 0.0;
  for (const PoseHypothesis& h : estimate.hypotheses) {
    const Eigen::Matrix3d& rotation = h.cam_from_world.rotation;
    const double off = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
    Expect(off < 1e-9 && rotation.determinant() > 0.0, "a rotation is one");
    Expect(h.cam_from_world.translation.allFinite(), "a translation is finite");
    Expect(h.Covariance().allFinite(), "a covariance is finite");
    Expect(h.Covariance().diagonal().minCoeff() >= 0.0, "a variance is not negative");
    Expect(h.probability >= 0.0 && h.probability <= 1.0, "a probability is one");
    Expect(std::isfinite(h.cost) && std::isfinite(h.rms_px), "a cost is finite");
    for (const CircleEstimate& circle : h.circles) {
      Expect(circle.center.allFinite() && circle.normal.allFinite() &&
                 std::isfinite(circle.radius) && circle.center_px.allFinite(),
             "a circle is finite");
    }
    for (const PencilEstimate& pencil : h.pencils)
      Expect(pencil.direction.allFinite() && !std::isnan(pencil.sigma_deg), "a pencil is finite");
    sum += h.probability;
  }
  Expect(std::abs(sum - 1.0) < 1e-6, "probabilities sum to 1");
}

}  // namespace circline::fuzz
