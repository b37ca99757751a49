// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/regions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Polygon = std::vector<Vector2d>;

// Vertices and landmarks as directions from a point inside the head, azimuthal-equidistant about +z, so that the sides
// of the head unroll. Scaled to millimetres at the eyes.
struct Chart {
  Vector3d centre = Vector3d::Zero();
  double radius = 1;
  Vector2d operator()(const Vector3d& x) const {
    const Vector3d d = x - centre;
    const double across = d.head<2>().norm();
    if (across == 0) return Vector2d::Zero();
    return d.head<2>() * (radius * std::atan2(across, d.z()) / across);
  }
};

// The landmarks' places in the chart, by ibug number.
class Marks {
 public:
  Marks(const Landmarks& landmarks, bool symmetric) {
    for (const auto& [name, mark] : landmarks) points_[name] = mark.position;
    if (symmetric) symmetrise();
    if (has(37, 46)) make_chart();
  }
  bool usable() const { return has(37, 46); }
  bool has(int first, int last) const {
    for (int i = first; i <= last; ++i)
      if (!points_.count(std::to_string(i))) return false;
    return true;
  }
  const Chart& chart() const { return chart_; }
  const Vector3d& position(int i) const { return points_.at(std::to_string(i)); }
  Vector2d operator()(int i) const { return chart_(position(i)); }
  Polygon polygon(int first, int last) const {
    Polygon p;
    for (int i = first; i <= last; ++i) p.push_back((*this)(i));
    return p;
  }

 private:
  void symmetrise() {
    auto even = points_;
    for (auto& [name, x] : even)
      if (const auto other = points_.find(mirrored_landmark(name)); other != points_.end())
        x = 0.5 * (x + Vector3d(-other->second.x(), other->second.y(), other->second.z()));
    points_ = std::move(even);
  }
  // Between the ears where the jaw begins there; else as far behind the eyes as they are wide apart, about the same.
  void make_chart() {
    const Vector3d eyes = 0.5 * (position(37) + position(46));
    const double width = (position(46) - position(37)).norm();
    const bool ears = points_.count("1") && points_.count("17");
    const double z = ears ? 0.5 * (position(1) + position(17)).z() : eyes.z() - 0.7 * width;
    chart_.centre = {eyes.x(), eyes.y() - 0.2 * width, std::min(z, eyes.z() - 0.4 * width)};
    chart_.radius = (position(37) - chart_.centre).norm();
  }
  std::map<std::string, Vector3d> points_;
  Chart chart_;
};

Vector2d between(const Vector2d& a, const Vector2d& b, double t) { return a + t * (b - a); }

double distance_to_segment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d e = b - a;
  const double t = e.squaredNorm() > 0 ? std::clamp((p - a).dot(e) / e.squaredNorm(), 0.0, 1.0) : 0;
  return (p - a - t * e).norm();
}

bool inside(const Vector2d& p, const Polygon& polygon) {
  bool in = false;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Vector2d &a = polygon[i], &b = polygon[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()))
      in = !in;
  }
  return in;
}

// A polygon or, if not closed, a line, widened by a margin (mm) on all sides.
struct Shape {
  std::string name;
  Polygon outline;
  double margin = 0;
  bool closed = true;
  bool contains(const Vector2d& p) const {
    if (closed && inside(p, outline)) return true;
    for (size_t i = closed ? 0 : 1; i < outline.size(); ++i)
      if (distance_to_segment(p, outline[i == 0 ? outline.size() - 1 : i - 1], outline[i]) <= margin) return true;
    return false;
  }
};

// Numbers of the left side's landmarks or, mirrored, of the right side's.
struct Side {
  const Marks& marks;
  bool left;
  int number(int i) const { return left ? i : std::stoi(mirrored_landmark(std::to_string(i))); }
  Vector2d operator()(int i) const { return marks(number(i)); }
  std::string name(const std::string& part) const { return (left ? "left_" : "right_") + part; }
};

// The wing of the nose lies outside its base point 36.
Vector2d wing(const Side& p) { return between(p(34), p(36), 1.5); }
// Above the nasion, between brows and eyes.
Vector2d nose_top(const Marks& p) { return between(p(28), p(31), -0.15); }

Shape eye(const Side& p) {
  Shape s{p.name("eye"), {}, 0.14 * (p(43) - p(46)).norm()};
  for (int i = 43; i <= 48; ++i) s.outline.push_back(p(i));
  return s;
}

Shape brow(const Side& p) {
  Shape s{p.name("brow"), {}, 0, false};
  for (int i = 23; i <= 27; ++i) s.outline.push_back(p(i));
  s.margin = 0.085 * (p(23) - p(27)).norm();
  return s;
}

Polygon half_nose(const Side& p) {
  const Vector2d outwards = wing(p) - p(34), up = p(31) - p(34);
  return {between(p(28), p(43), 0.42), between(p(28), p(31), 0.5) + 0.62 * outwards, wing(p) + 0.75 * up,
          between(p(34), p(36), 1.62) + 0.25 * up, between(p(34), p(36), 1.25) - 0.3 * up};
}

Shape nose(const Marks& p) {
  const Polygon left = half_nose({p, true});
  Polygon right = half_nose({p, false}), outline = {nose_top(p)};
  std::reverse(right.begin(), right.end());
  outline.insert(outline.end(), left.begin(), left.end());
  outline.push_back(between(p(34), p(31), -0.25));
  outline.insert(outline.end(), right.begin(), right.end());
  return {"nose", outline};
}

Shape cheek(const Side& p) {
  Shape s{p.name("cheek"), {between(p(28), p(43), 0.5)}, 0.5};
  for (int i : {43, 48, 47, 46}) s.outline.push_back(p(i));
  s.outline.push_back(between(p(46), p(17), 0.5) + 0.15 * (p(15) - p(17)));
  for (int i = 17; i >= 12; --i) s.outline.push_back(p(i));
  s.outline.push_back(between(p(55), p(12), 0.12));
  s.outline.push_back(between(p(55), wing(p), 0.5) + 0.15 * (p(55) - p(49)));
  s.outline.push_back(wing(p));
  return s;
}

Shape chin(const Marks& p) {
  Polygon outline = {p(55)};
  for (int i = 12; i >= 6; --i) outline.push_back(p(i));
  outline.push_back(p(49));
  return {"chin", outline, 0.5};
}

// As high as the nose and the glabella together: the classical thirds of the face, and a quarter more.
Shape forehead(const Marks& p) {
  const Vector2d up = 1.25 * (0.5 * (p(22) + p(23)) - p(34));
  const auto temple = [&](const Side& side) { return between(side(23), side(27), 1.12); };
  const Vector2d left = temple({p, true}), right = temple({p, false});
  Polygon outline = {right, right + 0.5 * up, right + up, left + up, left + 0.5 * up, left};
  for (int i = 27; i >= 23; --i) outline.push_back(p(i));
  outline.push_back(nose_top(p));
  for (int i = 22; i >= 18; --i) outline.push_back(p(i));
  return {"forehead", outline, 0.5};
}

// In order of precedence: a vertex belongs to the first shape that contains it.
std::vector<Shape> shapes(const Marks& p) {
  std::vector<Shape> all;
  const auto both = [&](auto make) {
    all.push_back(make(Side{p, true}));
    all.push_back(make(Side{p, false}));
  };
  both(eye);
  if (p.has(18, 27)) both(brow);
  if (p.has(49, 60)) all.push_back({"lips", p.polygon(49, 60), 0.01 * (p(49) - p(55)).norm()});
  if (p.has(28, 36)) all.push_back(nose(p));
  if (p.has(1, 17) && p.has(28, 36) && p.has(49, 60)) both(cheek);
  if (p.has(6, 12) && p.has(49, 60)) all.push_back(chin(p));
  if (p.has(18, 36)) all.push_back(forehead(p));
  return all;
}

// The hollows left and right of the columella: turned down, about midway between base point, base centre and tip.
bool in_nostril(const Marks& marks, const Vector3d& x, const Vector3d& normal) {
  for (const bool left : {true, false}) {
    const Side side{marks, left};
    const Vector3d base = marks.position(34), corner = marks.position(side.number(36)), tip = marks.position(31);
    const Vector3d centre = 0.5 * (base + corner) + 0.25 * (tip - base);
    if ((x - centre).norm() < 0.45 * (corner - base).norm() && normal.y() < -0.35) return true;
  }
  return false;
}

void add_borders(const Mesh& mesh, const std::optional<Shape>& lips, const Chart& chart, RegionMap& regions) {
  const auto loops = boundary_loops(mesh.F);
  for (size_t l = 0; l < loops.size(); ++l) {
    auto sorted = loops[l];
    std::sort(sorted.begin(), sorted.end());
    if (l == 0) regions["rim"] = sorted;
    if (l == 0 || !lips) continue;
    const auto within = std::count_if(sorted.begin(), sorted.end(),
                                      [&](int v) { return lips->contains(chart(mesh.V.row(v).transpose())); });
    if (2 * within > static_cast<std::ptrdiff_t>(sorted.size()) && !regions.count("mouth_slit"))
      regions["mouth_slit"] = sorted;
  }
}

}  // namespace

RegionMap face_regions(const Mesh& mesh, const LandmarkSet& landmarks, const std::vector<int>& mirror) {
  return face_regions(mesh, locate(landmarks, mesh.V, mesh.F), mirror);
}

RegionMap face_regions(const Mesh& mesh, const Landmarks& landmarks, const std::vector<int>& mirror) {
  const Marks marks(landmarks, !mirror.empty());
  RegionMap regions;
  std::optional<Shape> lips;
  if (marks.usable()) {
    const std::vector<Shape> all = shapes(marks);
    const Vertices normals = vertex_normals(mesh.V, mesh.F);
    const auto add = [&](const std::string& name, int v) {
      regions[name].push_back(v);
      if (!mirror.empty() && mirror[static_cast<size_t>(v)] != v)
        regions[mirrored_landmark(name)].push_back(mirror[static_cast<size_t>(v)]);
    };
    for (int v = 0; v < mesh.V.rows(); ++v) {
      // One vertex decides for the pair, so that rounding cannot part them.
      if (!mirror.empty() && mesh.V(v, 0) < mesh.V(mirror[static_cast<size_t>(v)], 0)) continue;
      const Vector3d x = mesh.V.row(v).transpose();
      const Vector2d p = marks.chart()(x);
      const auto first = std::find_if(all.begin(), all.end(), [&](const Shape& s) { return s.contains(p); });
      if (first == all.end()) continue;
      add(first->name, v);
      if (first->name == "nose" && in_nostril(marks, x, normals.row(v).transpose())) add("nostrils", v);
    }
    for (const Shape& s : all)
      if (s.name == "lips") lips = s;
  }
  for (auto& [name, vertices] : regions) std::sort(vertices.begin(), vertices.end());
  add_borders(mesh, lips, marks.chart(), regions);
  return regions;
}

}  // namespace facewright
