// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/mean_head.h"

#include "libmodel/synthetic/mean_head_internal.h"

namespace facewright {

using Eigen::Vector3d;

double mean_head_distance(const Vector3d& p) {
  double d = mean_head::base_distance(p);
  if (d > 40 || d < -40) return d;
  d = mean_head::add_lids(d, p);
  d = mean_head::add_nose(d, p);
  d = mean_head::add_mouth(d, p);
  d = mean_head::add_eyes(d, p);
  return mean_head::add_ear(d, p);
}

Vector3d mean_head_gradient(const Vector3d& p, double step) {
  Vector3d g;
  for (int k = 0; k < 3; ++k) {
    const Vector3d e = step * Vector3d::Unit(k);
    g[k] = (mean_head_distance(p + e) - mean_head_distance(p - e)) / (2 * step);
  }
  return g;
}

Vector3d project_to_mean_head(const Vector3d& p) {
  Vector3d x = p;
  for (int i = 0; i < 40; ++i) {
    const double d = mean_head_distance(x);
    if (std::abs(d) < 1e-9) break;
    const Vector3d g = mean_head_gradient(x);
    x -= std::clamp(d / std::max(g.squaredNorm(), 0.05), -2.0, 2.0) * g;
  }
  return x;
}

namespace {

/// The foremost surface point over (x, y): walks in from the front, then bisects.
Vector3d front_point(double x, double y) {
  double outside = 95, inside = outside;
  while (mean_head_distance({x, y, inside}) > 0 && inside > -120) {
    outside = inside;
    inside -= 0.5;
  }
  for (int i = 0; i < 50; ++i) {
    const double z = 0.5 * (inside + outside);
    (mean_head_distance({x, y, z}) > 0 ? outside : inside) = z;
  }
  return {x, y, 0.5 * (inside + outside)};
}

Vector3d on_midline(const Vector3d& p) {
  Vector3d x = project_to_mean_head({0, p.y(), p.z()});
  x.x() = 0;
  return x;
}

class Marker {
 public:
  /// A point of the subject's left side and its mirror image.
  void pair(const std::string& left, const std::string& right, const Vector3d& p) {
    marks_[left].position = p;
    marks_[right].position = {-p.x(), p.y(), p.z()};
  }
  void pair(int left, int right, const Vector3d& p) { pair(std::to_string(left), std::to_string(right), p); }
  void sides(const std::string& name, const Vector3d& p) { pair("left_" + name, "right_" + name, p); }
  void midline(const std::string& name, const Vector3d& p) { marks_[name].position = on_midline(p); }
  Landmarks take() { return std::move(marks_); }

 private:
  Landmarks marks_;
};

/// Jaw contour from the ear to the chin, by arc length: points 17 (left, at the ear) .. 9 (chin).
void mark_jaw(Marker& mark) {
  static const Vector3d path[] = {{71, 0, -22},    {69.5, -20, -20}, {66, -40, -15}, {60.5, -58, -8},  {53, -74, 1},
                                  {44.5, -88, 12}, {34.5, -99, 24},  {23, -107, 34}, {12, -111.5, 42}, {0, -113, 45}};
  constexpr int count = 10;
  double total = 0;
  for (int i = 1; i < count; ++i) total += (path[i] - path[i - 1]).norm();
  for (int k = 0; k < 8; ++k) {
    double s = total * k / 8;
    int i = 1;
    while (i < count - 1 && s > (path[i] - path[i - 1]).norm()) s -= (path[i] - path[i - 1]).norm(), ++i;
    const Vector3d p = path[i - 1] + s * (path[i] - path[i - 1]).normalized();
    mark.pair(17 - k, 1 + k, project_to_mean_head(p));
  }
  mark.midline("9", path[count - 1]);
}

void mark_brows_and_eyes(Marker& mark) {
  using namespace mean_head;
  const double brow_x[] = {11.5, 23, 34, 44, 51};  // 23 .. 27 on the left, 22 .. 18 on the right
  for (int k = 0; k < 5; ++k) mark.pair(23 + k, 22 - k, front_point(brow_x[k], brow_line(brow_x[k])));
  const double inner = en_x + 0.32 * (ex_x - en_x), outer = en_x + 0.68 * (ex_x - en_x), margin = 0.35;
  mark.pair(43, 40, front_point(en_x, canthal_line(en_x)));
  mark.pair(44, 39, front_point(inner, upper_lid(inner) + margin));
  mark.pair(45, 38, front_point(outer, upper_lid(outer) + margin));
  mark.pair(46, 37, front_point(ex_x, canthal_line(ex_x)));
  mark.pair(47, 42, front_point(outer, lower_lid(outer) - margin));
  mark.pair(48, 41, front_point(inner, lower_lid(inner) - margin));
}

void mark_nose(Marker& mark) {
  mark.midline("28", {0, 3, 53});
  mark.midline("29", {0, -9, 58});
  mark.midline("30", {0, -21, 66});
  mark.midline("31", {0, -36, 75.5});
  mark.midline("34", {0, -47.5, 61});
  mark.pair(35, 33, project_to_mean_head({6.3, -46.5, 59.5}));
  mark.pair(36, 32, project_to_mean_head({13, -45.5, 55}));
}

void mark_mouth(Marker& mark) {
  using namespace mean_head;
  const double w = mouth_half_width;
  const auto at = [&](double x, double y) { return front_point(x, y); };
  mark.midline("52", at(0, upper_vermilion(0)));
  mark.midline("58", at(0, lower_vermilion(0)));
  mark.pair(53, 51, at(0.25 * w, upper_vermilion(0.25 * w)));
  mark.pair(54, 50, at(0.64 * w, upper_vermilion(0.64 * w)));
  mark.pair(55, 49, at(w, lip_seam(w)));
  mark.pair(56, 60, at(0.70 * w, lower_vermilion(0.70 * w)));
  mark.pair(57, 59, at(0.36 * w, lower_vermilion(0.36 * w)));
  // the inner lips meet at the seam: their margins are half a millimetre above and below it
  const double lip = 0.5;
  mark.pair(65, 61, at(0.88 * w, lip_seam(0.88 * w)));
  mark.midline("63", at(0, lip_seam(0) + lip));
  mark.midline("67", at(0, lip_seam(0) - lip));
  mark.pair(64, 62, at(0.42 * w, lip_seam(0.42 * w) + lip));
  mark.pair(66, 68, at(0.42 * w, lip_seam(0.42 * w) - lip));
}

void mark_extras(Marker& mark) {
  const auto front = [](double x, double y) { return front_point(x, y); };
  mark.midline("trichion", front(0, 68));
  mark.midline("metopion", front(0, 44));
  mark.midline("glabella", front(0, 20));
  mark.midline("labiomental", front(0, -84.5));
  mark.midline("pogonion", front(0, -98));
  mark.midline("menton", {0, -113.5, 40});
  mark.midline("submental", {0, -112, 24});
  mark.midline("cervical", {0, -106, 0});
  mark.midline("vertex", {0, 113, -40});
  mark.midline("opisthocranion", {0, 22, -136});
  mark.sides("euryon", project_to_mean_head({76, 44, -48}));
  mark.sides("lid_fold", front(32, 10.5));
  mark.sides("alare", project_to_mean_head({18, -40, 56}));
  mark.sides("tip", project_to_mean_head({8, -36, 73}));
  mark.sides("nasal_wall", front(9, -14));
  mark.midline("philtrum", {0, -54, 62});
  mark.sides("neck", project_to_mean_head({55, -128, -60}));
  mark.sides("superaurale", project_to_mean_head({80, 18, -62}));
  mark.sides("subaurale", project_to_mean_head({74, -43, -52}));
  mark.sides("tragion", project_to_mean_head({71, -14, -39}));
  mark.sides("gonion", project_to_mean_head({52, -74, -12}));
  mark.sides("zygion", project_to_mean_head({69, -18, -8}));
  mark.sides("zygoma", front(50, -18));
  mark.sides("orbitale", front(31, -16));
  mark.sides("infraorbital", front(30, -30));
  mark.sides("cheek", front(42, -42));
  mark.sides("jowl", front(36, -78));
  mark.sides("alar_curvature", front(18, -40));
  mark.sides("buccal", project_to_mean_head({58, -48, 12}));
  mark.sides("masseter", project_to_mean_head({61, -50, -8}));
  mark.sides("parotid", project_to_mean_head({67, -32, -16}));
  mark.sides("forehead", front(30, 44));
  mark.sides("upper_forehead", front(26, 62));
  mark.sides("temple", project_to_mean_head({61, 34, 12}));
  mark.sides("upper_temple", project_to_mean_head({64, 52, 4}));
  mark.sides("frontotemporal", front(50, 30));
  mark.sides("brow_peak", front(38, 36));
  mark.sides("sphenoid", project_to_mean_head({62, 4, 12}));
  mark.sides("chin", front(16, -100));
  mark.sides("submandibular", project_to_mean_head({30, -100, 10}));
}

}  // namespace

Landmarks mean_head_landmarks() {
  Marker mark;
  mark_jaw(mark);
  mark_brows_and_eyes(mark);
  mark_nose(mark);
  mark_mouth(mark);
  mark_extras(mark);
  return mark.take();
}

}  // namespace facewright
