#include "apps/simulate/street.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kWidth = 640, kHeight = 480;  // Pixels.

// The camera. Its field of view; how far it is turned upwards and to the side; the standard
// deviations of its calibration (those of CameraSigma) and of k1.
constexpr double kLeastView = 48.0 * kDegree, kMostView = 78.0 * kDegree;
constexpr double kTilt = 6.0 * kDegree, kMeanTilt = 5.0 * kDegree, kRoll = 2.0 * kDegree;
constexpr double kK1Sigma = 0.002;
// Where nobody has calibrated it: of the principal point, about the middle, pixels.
constexpr double kGuessedMiddle = 12.0;
constexpr double kGuessedView = 60.0 * kDegree;
// Each pair of directions of a house is at right angles to so much (standard deviation); a house
// whose fronts meet at another angle does so by this much more or less.
constexpr double kLean = 0.7 * kDegree;
constexpr double kLeastSkew = 12.0 * kDegree, kMostSkew = 50.0 * kDegree;
constexpr double kShareSkew = 0.5;
// Of each edge against the direction of its house, by house: standard deviation, radians.
constexpr double kLeastScatter = 5e-4, kMostScatter = 3e-3;
// Of end points across the segment, by photo, pixels.
constexpr double kLeastNoise = 0.15, kMostNoise = 0.5;
// Detectors drop shorter segments, pixels; they find a piece of an edge, or nothing.
constexpr double kLeastLength = 20.0;
constexpr double kLeastPiece = 0.4, kShareFound = 0.5;
// Clutter (trees, cars, wires): a share of all segments; lengths beyond the least are exponential.
constexpr double kMostClutter = 0.4, kClutterLength = 25.0;
// The photo is of a house if two of its directions have so many segments each; others have fewer.
constexpr int kLeastSegments = 6;
constexpr double kMostOther = 0.5;  // Of the first house's segments.

double LogUniform(double low, double high, Random* random) {
  return low * std::exp(random->Uniform() * std::log(high / low));
}

double Sign(Random* random) { return random->Uniform() < 0.5 ? -1.0 : 1.0; }

// Two fronts that meet in the corner; from the corner the one extends along its direction, the
// other against its own.
struct House {
  HouseDirections directions;  // World frame: y down, z away from the camera.
  Vector3d corner;             // On the ground.
  double scatter = 0.0;
};

// Adds the segments of houses as a camera sees them.
class Painter {
 public:
  Painter(const Camera& camera, const Eigen::Matrix3d& cam_from_world, double sigma_px,
          Random* random)
      : camera_(camera), cam_from_world_(cam_from_world), sigma_px_(sigma_px), random_(*random) {}

  // Cornices, corners, and rows of windows with a frame, a sill and bars.
  void AddFront(const House& house, int index, int along, std::vector<StreetSegment>* segments) {
    const int windows = 3 + random_.UniformInt(6), storeys = 2 + random_.UniformInt(4);
    const double pitch = random_.Uniform(2.0, 3.5), height = random_.Uniform(2.8, 3.6);
    const double wide = random_.Uniform(0.4, 0.7) * pitch,
                 high = random_.Uniform(0.45, 0.7) * height;
    const Vector3d out = (along == 0 ? 1.0 : -1.0) * house.directions[Index(along)];
    const Vector3d& up = house.directions[2];
    const auto level = [&](double x, double y, double length, int pieces) {
      AddEdge(house, {house.corner + x * out + y * up, length * out, pieces}, {{}, index, along},
              segments);
    };
    const auto upright = [&](double x, double y, double length, int pieces) {
      AddEdge(house, {house.corner + x * out + y * up, length * up, pieces}, {{}, index, 2},
              segments);
    };
    for (int floor = 0; floor <= storeys; ++floor) {
      level(0.0, floor * height, windows * pitch, windows);
      for (int k = 0; k < windows && floor < storeys; ++k) {
        const double x = (k + 0.5) * pitch - 0.5 * wide, y = (floor + 0.3) * height;
        for (const double share : {-0.1, 0.0, 0.6, 1.0}) level(x, y + share * high, wide, 1);
        for (const double share : {0.0, 0.5, 1.0}) upright(x + share * wide, y, high, 1);
      }
    }
    for (const double x : {0.0, windows * pitch}) upright(x, 0.0, storeys * height, storeys);
  }

  void AddClutter(std::vector<StreetSegment>* segments) {
    const double angle = random_.Uniform(0.0, 180.0 * kDegree);
    const double length = kLeastLength - kClutterLength * std::log(1.0 - random_.Uniform());
    const double u = random_.Uniform(0.0, kWidth), v = random_.Uniform(0.0, kHeight);
    const Vector2d half = 0.5 * length * Vector2d(std::cos(angle), std::sin(angle));
    StreetSegment segment{{Vector2d(u, v) - half, Vector2d(u, v) + half}, -1, -1};
    if (InPhoto(segment.ends[0]) && InPhoto(segment.ends[1])) segments->push_back(segment);
  }

 private:
  static std::size_t Index(int direction) { return static_cast<std::size_t>(direction); }

  static bool InPhoto(const Vector2d& pixel) {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < kWidth && pixel.y() < kHeight;
  }

  // An edge of a house, which a detector breaks into pieces.
  struct Edge {
    Vector3d from, all;
    int pieces = 1;
  };

  // What a detector finds of an edge.
  void AddEdge(const House& house, const Edge& edge, const StreetSegment& kind,
               std::vector<StreetSegment>* segments) {
    Vector3d off;
    for (double& value : off) value = house.scatter * random_.Normal();
    const Vector3d turned = edge.all + edge.all.norm() * off;
    const double each = 1.0 / edge.pieces;
    for (int k = 0; k < edge.pieces; ++k) {
      const bool is_found = random_.Uniform() < kShareFound;
      const double length = each * random_.Uniform(kLeastPiece, 1.0);
      const double start = k * each + random_.Uniform(0.0, each - length);
      StreetSegment segment = kind;
      // Turned about its middle.
      const Vector3d begin = edge.from + 0.5 * edge.all + (start - 0.5) * turned;
      if (Project(begin, begin + length * turned, &segment.ends) && is_found)
        segments->push_back(segment);
    }
  }

  // False where too little of it is in the photo.
  bool Project(const Vector3d& from, const Vector3d& to, Segment* ends) {
    const double noise_from = sigma_px_ * random_.Normal(), noise_to = sigma_px_ * random_.Normal();
    if (!CameraToPixel(camera_, cam_from_world_ * from, &(*ends)[0]) ||
        !CameraToPixel(camera_, cam_from_world_ * to, &(*ends)[1]) || !InPhoto((*ends)[0]) ||
        !InPhoto((*ends)[1])) {
      return false;
    }
    const Vector2d along = (*ends)[1] - (*ends)[0];
    if (along.norm() < kLeastLength) return false;
    const Vector2d across = Vector2d(-along.y(), along.x()).normalized();
    (*ends)[0] += noise_from * across;
    (*ends)[1] += noise_to * across;
    return true;
  }

  const Camera& camera_;
  const Eigen::Matrix3d cam_from_world_;
  const double sigma_px_;
  Random& random_;
};

Camera DrawCamera(const CameraSigma& sigma, Random* random, Camera* truth) {
  Camera camera;
  camera.model = CameraModel::kOpenCV;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = 0.5 * kWidth / std::tan(0.5 * random->Uniform(kLeastView, kMostView));
  camera.cx = 0.5 * (kWidth - 1);
  camera.cy = 0.5 * (kHeight - 1);
  const double k1 = random->Uniform(-0.2, 0.05);
  camera.distortion[0] = sigma.IsWide() ? 0.0 : k1;
  *truth = camera;
  truth->fx *= std::exp(CameraSigma().log_focal * random->Normal());
  truth->fy = truth->fx * std::exp(sigma.log_aspect * random->Normal());
  truth->cx += sigma.principal_point_px * random->Normal();
  truth->cy += sigma.principal_point_px * random->Normal();
  truth->distortion[0] += kK1Sigma * random->Normal();
  if (sigma.IsWide()) camera.fx = camera.fy = 0.5 * kWidth / std::tan(kGuessedView / 2.0);
  return camera;
}

// A corner that both fronts of which the camera sees. `turn`: of the first front against the photo.
House DrawHouse(double turn, double angle_between, double distance, double aside, Random* random) {
  const Vector3d down = Vector3d::UnitY();
  const auto front = [&](double about_down) -> Vector3d {
    const Vector3d level(std::cos(about_down), 0.0, std::sin(about_down));
    const double climb = kLean * random->Normal();
    return std::cos(climb) * level - std::sin(climb) * down;
  };
  House house;
  house.directions = {front(turn), front(turn - angle_between + kLean * random->Normal()), -down};
  house.corner = Vector3d(aside, random->Uniform(1.4, 1.8), distance);
  house.scatter = LogUniform(kLeastScatter, kMostScatter, random);
  return house;
}

int CountOf(const std::vector<StreetSegment>& segments, int house, int direction) {
  return static_cast<int>(std::count_if(segments.begin(), segments.end(), [&](const auto& s) {
    return s.house == house && s.direction == direction;
  }));
}

// A corner both fronts of which are seen; `between`: the angle between these, but for the lean.
House DrawCorner(double between, double distance, double aside, Random* random) {
  constexpr double kGrazing = 8.0 * kDegree;
  const double least = std::max(kGrazing, between - 90.0 * kDegree + kGrazing);
  const double most = std::min(90.0 * kDegree - kGrazing, between - kGrazing);
  return DrawHouse(random->Uniform(least, most), between, distance, aside, random);
}

double DrawSkew(Random* random) {
  const double sign = Sign(random);
  return sign * random->Uniform(kLeastSkew, kMostSkew);
}

// Houses behind and beside: right angles, fronts that any other house's are not parallel to.
void AddOthers(Painter* painter, Random* random, std::vector<House>* houses,
               std::vector<StreetSegment>* segments) {
  const auto most = static_cast<std::size_t>(kMostOther * static_cast<double>(segments->size()));
  for (int k = random->UniformInt(3); k > 0; --k) {
    const double distance = random->Uniform(15.0, 40.0), aside = random->Uniform(-12.0, 12.0);
    const House other = DrawCorner(90.0 * kDegree, distance, aside, random);
    const HouseDirections first = houses->front().directions;
    const auto is_parallel = [&](const Vector3d& front) {
      return std::any_of(
          other.directions.begin(), other.directions.begin() + 2,
          [&](const auto& v) { return std::abs(v.dot(front)) > std::cos(kLeastSkew); });
    };
    if (is_parallel(first[0]) || is_parallel(first[1])) continue;
    std::vector<StreetSegment> own;
    const int index = static_cast<int>(houses->size());
    painter->AddFront(other, index, random->UniformInt(2), &own);
    own.resize(std::min(own.size(), most / 2));
    segments->insert(segments->end(), own.begin(), own.end());
    houses->push_back(other);
  }
}

}  // namespace

StreetPhoto DrawStreet(double focal_sigma, Random* random) {
  for (;;) {
    StreetPhoto photo;
    if (focal_sigma > 0.0) {
      photo.sigma.log_focal = focal_sigma;
      photo.sigma.principal_point_px = kGuessedMiddle;
    }
    Camera truth;
    photo.camera = DrawCamera(photo.sigma, random, &truth);
    photo.focal_px = truth.fx;
    photo.sigma_px = LogUniform(kLeastNoise, kMostNoise, random);
    photo.is_orthogonal = random->Uniform() >= kShareSkew;
    const double roll = kRoll * random->Normal(), tilt = kMeanTilt + kTilt * random->Normal();
    const Eigen::Matrix3d cam_from_world = ExpRotation(Vector3d(-tilt, 0.0, roll));
    const double distance = random->Uniform(8.0, 25.0), aside = random->Uniform(-3.0, 3.0);
    const double skew = photo.is_orthogonal ? 0.0 : DrawSkew(random);
    std::vector<House> houses = {DrawCorner(90.0 * kDegree + skew, distance, aside, random)};
    Painter painter(truth, cam_from_world, photo.sigma_px, random);
    for (const int along : {0, 1}) painter.AddFront(houses[0], 0, along, &photo.segments);
    int seen = 0;
    for (const int k : {0, 1, 2}) seen += CountOf(photo.segments, 0, k) >= kLeastSegments ? 1 : 0;
    if (seen < 2) continue;
    AddOthers(&painter, random, &houses, &photo.segments);
    const double share = random->Uniform(0.0, kMostClutter);
    const double stray = share / (1.0 - share) * static_cast<double>(photo.segments.size());
    for (int k = 0; k < static_cast<int>(stray); ++k) painter.AddClutter(&photo.segments);
    for (House& house : houses) {
      for (Vector3d& v : house.directions) v = cam_from_world * v;
      photo.houses.push_back(house.directions);
    }
    return photo;
  }
}

}  // namespace circline::apps
