// The keys `faces` and `solids` of a scene file's image.
#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/common/scene_values.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr const char* kAxes[] = {"x", "y", "z"};

double ReadNotNegative(const StorageNode& node) {
  if (!node.Exists()) return 0.0;
  const double value = node.Number();
  if (!(value >= 0.0) || !std::isfinite(value)) node.Fail("must not be negative");
  return value;
}

std::array<double, 3> ReadLengths(const StorageNode& node) {
  std::array<double, 3> lengths{};
  if (!node.Exists()) return lengths;
  const std::vector<double> v = node.Numbers(3);
  for (std::size_t k = 0; k < v.size(); ++k) {
    if (!(v[k] >= 0.0) || !std::isfinite(v[k]))
      node.Fail("must be three lengths, 0 where one is not known");
    lengths[k] = v[k];
  }
  return lengths;
}

void AddEdge(const StorageNode& node, int axis, const std::array<bool, 3>& far,
             std::vector<Eigen::Vector2d> points, double sigma_px, BoxObservation* box) {
  if (points.size() < 2) return;
  if ((points.front() - points.back()).norm() < 1.0) {
    node.Fail(std::string("the edge along ") + kAxes[axis] + " has no length");
    return;
  }
  box->edges.push_back({axis, far, std::move(points), sigma_px});
}

// The three edges at the origin, by their far ends.
void ReadCorner(const StorageNode& node, double sigma_px, BoxObservation* box) {
  if (!node.Get("corner").Exists()) {
    for (const char* axis : kAxes) {
      if (node.Get(axis).Exists()) node.Get(axis).Fail("there is no 'corner' that its edge is at");
    }
    return;
  }
  const Eigen::Vector2d corner = ReadPixel(node.Get("corner"));
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d end = ReadPixel(node.Require(kAxes[k]));
    AddEdge(node.Get(kAxes[k]), k, {}, {corner, end}, sigma_px, box);
  }
}

// Four edges of the base, and the one that stands on its first corner.
void ReadBase(const StorageNode& node, const std::vector<FaceObservation>& faces, double sigma_px,
              BoxObservation* box) {
  const StorageNode base = node.Get("base");
  if (!base.Exists()) {
    if (node.Get("top").Exists()) node.Get("top").Fail("there is no 'base' that it is above");
    return;
  }
  const std::string id = base.Text();
  const auto face = std::find_if(faces.begin(), faces.end(),
                                 [&](const FaceObservation& f) { return f.id == id; });
  if (face == faces.end() || face->corners.size() != 4)
    return base.Fail("there is no face '" + id + "' of four corners");
  const auto& c = face->corners;
  AddEdge(base, 0, {}, {c[0], c[1]}, sigma_px, box);
  AddEdge(base, 0, {false, true, false}, {c[3], c[2]}, sigma_px, box);
  AddEdge(base, 1, {}, {c[0], c[3]}, sigma_px, box);
  AddEdge(base, 1, {true, false, false}, {c[1], c[2]}, sigma_px, box);
  AddEdge(node.Get("top"), 2, {}, {c[0], ReadPixel(node.Require("top"))}, sigma_px, box);
}

void ReadEdge(const StorageNode& node, double sigma_px, BoxObservation* box) {
  node.AllowKeys({"along", "far", "points"});
  const int axis = ReadChoice(node.Require("along"), {std::begin(kAxes), std::end(kAxes)}, -1);
  if (axis < 0) return;
  std::array<bool, 3> far{};
  const std::string at = ReadOptionalText(node.Get("far"));
  for (const char name : at) {
    if (name < 'x' || name > 'z' || name - 'x' == axis) {
      return node.Get("far").Fail("'" + at + "' must name axes across the edge: x, y, z, or two");
    }
    far[static_cast<std::size_t>(name - 'x')] = true;
  }
  AddEdge(node, axis, far, ReadPixels(node.Require("points"), 2), sigma_px, box);
}

BoxObservation ReadBox(const StorageNode& node, const std::vector<FaceObservation>& faces) {
  node.AllowKeys({"id", "kind", "corner", "x", "y", "z", "base", "top", "edges", "length",
                  "length_sigma", "true_length", "sigma_px"});
  BoxObservation box;
  box.id = node.Require("id").Text();
  const double sigma_px = ReadNotNegative(node.Get("sigma_px"));
  ReadCorner(node, sigma_px, &box);
  ReadBase(node, faces, sigma_px, &box);
  for (const StorageNode& edge : node.Get("edges").Items()) ReadEdge(edge, sigma_px, &box);
  box.length = ReadLengths(node.Get("length"));
  box.length_sigma = ReadNotNegative(node.Get("length_sigma"));
  box.truth = ReadLengths(node.Get("true_length"));
  return box;
}

void RequireCircle(const StorageNode& node, const std::string& id,
                   const Observations& observations) {
  if (FindCircle(observations, id) < 0) node.Fail("there is no circle '" + id + "'");
}

CylinderObservation ReadCylinder(const StorageNode& node, const Observations& observations) {
  node.AllowKeys({"id", "kind", "base", "rim", "top", "true_height"});
  CylinderObservation cylinder;
  cylinder.id = node.Require("id").Text();
  cylinder.base = node.Require("base").Text();
  RequireCircle(node.Get("base"), cylinder.base, observations);
  cylinder.true_height = ReadNotNegative(node.Get("true_height"));
  if (node.Get("rim").Exists() == node.Get("top").Exists())
    node.Fail("give 'rim', a circle, or 'top', the image of its centre");
  if (node.Get("top").Exists()) cylinder.top = ReadPixel(node.Get("top"));
  if (node.Get("rim").Exists()) {
    cylinder.rim = node.Get("rim").Text();
    RequireCircle(node.Get("rim"), cylinder.rim, observations);
    if (cylinder.rim == cylinder.base) node.Get("rim").Fail("is the base");
  }
  return cylinder;
}

}  // namespace

Solids ReadSolids(const StorageNode& image, const Observations& observations) {
  Solids solids;
  std::vector<std::string> bases;  // Faces that mark edges of a box are no faces of their own.
  for (const StorageNode& node : image.Get("faces").Items()) {
    node.AllowKeys({"id", "corners", "plane"});
    FaceObservation face;
    face.id = node.Require("id").Text();
    face.corners = ReadPixels(node.Require("corners"), 3);
    face.plane = ReadOptionalText(node.Get("plane"));
    solids.faces.push_back(std::move(face));
  }
  for (const StorageNode& node : image.Get("solids").Items()) {
    const std::string kind = node.Require("kind").Text();
    if (kind == "box") {
      solids.boxes.push_back(ReadBox(node, solids.faces));
      if (node.Get("base").Exists()) bases.push_back(node.Get("base").Text());
    } else if (kind == "cylinder") {
      solids.cylinders.push_back(ReadCylinder(node, observations));
    } else {
      node.Get("kind").Fail(NotOneOf(kind, {"box", "cylinder"}));
    }
  }
  const auto is_base = [&](const FaceObservation& face) {
    return std::find(bases.begin(), bases.end(), face.id) != bases.end();
  };
  solids.faces.erase(std::remove_if(solids.faces.begin(), solids.faces.end(), is_base),
                     solids.faces.end());
  return solids;
}

}  // namespace circline::apps
