// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tools/default_reference/half_face_design.h"

#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "tools/default_reference/half_face_mesher.h"

namespace facewright::face_design {
namespace {

using Names = std::vector<std::string>;

class Designer {
 public:
  explicit Designer(const Landmarks& landmarks) : landmarks_(landmarks) {}

  HalfFaceDesign run() {
    const auto upper_midline = curve({"trichion", "metopion", "glabella", "28", "29", "30", "31", "34", "52", "63"},
                                     {3, 3, 3, 2, 2, 3, 4, 4, 2}, false);
    const auto lower_midline = curve({"67", "58", "labiomental", "pogonion", "9", "menton", "submental", "cervical"},
                                     {2, 2, 2, 3, 1, 2, 3}, false);
    const auto upper_slit = slit("63", "64", 1), lower_slit = slit("67", "66", -1);
    const auto rim = rim_curve();
    add_eye();
    add_mouth(upper_slit, lower_slit);
    d_.brow = curve({"23", "24", "25", "26", "27"}, {2, 2, 2, 1}, true);
    curve({"17", "16", "15", "14", "13", "12", "11", "10", "9"}, {2, 2, 2, 2, 2, 2, 2, 2}, true);
    add_wing();
    add_outline(upper_midline, upper_slit, lower_slit, lower_midline, rim);
    add_extras();
    return std::move(d_);
  }

 private:
  Vector3d place(const std::string& name) const {
    const auto it = landmarks_.find(name);
    if (it == landmarks_.end()) throw InvalidInput("make-default-reference: the mean face has no landmark " + name);
    return it->second.position;
  }

  int add_point(const Vector3d& p, bool midline) {
    d_.points.push_back(p);
    d_.midline.push_back(midline);
    d_.pinned.push_back(true);
    if (midline) d_.points.back().x() = 0;
    return static_cast<int>(d_.points.size()) - 1;
  }

  // A curve point: the landmark next to it if there is one, so that no two points crowd.
  int take_point(const Vector3d& p, bool midline, double near) {
    for (const auto& [name, mark] : landmarks_)
      if (!midline && mark.position.x() > 1 && (mark.position - p).norm() < near && !d_.landmarks.count(name))
        return landmark(name);
    return add_point(p, midline);
  }

  int landmark(const std::string& name) {
    const auto it = d_.landmarks.find(name);
    if (it != d_.landmarks.end()) return it->second;
    const Vector3d p = place(name);
    return d_.landmarks[name] = add_point(p, std::abs(p.x()) < 1e-9);
  }

  void segment(int a, int b) {
    d_.segments.push_back({a, b});
    for (int i = 0; i <= 8; ++i) d_.curve_samples.push_back(d_.points[a] + i / 8.0 * (d_.points[b] - d_.points[a]));
  }

  // Chart points from a to b, straight or on a Catmull-Rom arc with the outer neighbours before and after.
  static Vector2d arc(const Vector2d& before, const Vector2d& a, const Vector2d& b, const Vector2d& after, double t,
                      bool smooth) {
    if (!smooth) return a + t * (b - a);
    const Vector2d da = 0.5 * (b - before), db = 0.5 * (after - a);
    const double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * a + (t3 - 2 * t2 + t) * da + (-2 * t3 + 3 * t2) * b + (t3 - t2) * db;
  }

  // Points that cut the lifted arc into n pieces of equal length, ends left out.
  std::vector<Vector3d> cut(const std::array<Vector2d, 4>& q, int n, bool smooth) const {
    constexpr int samples = 60;
    std::vector<Vector3d> path;
    std::vector<double> s{0};
    for (int i = 0; i <= samples; ++i) {
      path.push_back(lift(arc(q[0], q[1], q[2], q[3], static_cast<double>(i) / samples, smooth)));
      if (i) s.push_back(s.back() + (path[i] - path[i - 1]).norm());
    }
    std::vector<Vector3d> result;
    for (int k = 1; k < n; ++k) {
      const double wanted = s.back() * k / n;
      const auto i = static_cast<size_t>(std::lower_bound(s.begin(), s.end(), wanted) - s.begin());
      const double t = (wanted - s[i - 1]) / (s[i] - s[i - 1]);
      result.push_back(project(path[i - 1] + t * (path[i] - path[i - 1])));
    }
    return result;
  }

  // A polyline through landmarks with the given number of edges from one to the next; returns all its points.
  std::vector<int> curve(const Names& names, const std::vector<int>& edges, bool smooth) {
    std::vector<int> ids;
    for (const auto& name : names) ids.push_back(landmark(name));
    return curve_through(ids, edges, smooth);
  }

  std::vector<int> curve_through(const std::vector<int>& ids, const std::vector<int>& edges, bool smooth) {
    std::vector<Vector2d> q;
    for (const int id : ids) q.push_back(chart(d_.points[id]));
    std::vector<int> all{ids[0]};
    for (size_t i = 0; i + 1 < ids.size(); ++i) {
      const std::array<Vector2d, 4> support{q[i ? i - 1 : 0], q[i], q[i + 1], q[std::min(i + 2, q.size() - 1)]};
      const double length = (d_.points[ids[i + 1]] - d_.points[ids[i]]).norm() / edges[i];
      for (const Vector3d& p : cut(support, edges[i], smooth))
        all.push_back(take_point(p, d_.midline[ids[i]] && d_.midline[ids[i + 1]], 0.45 * length));
      all.push_back(ids[i + 1]);
    }
    for (size_t i = 0; i + 1 < all.size(); ++i) segment(all[i], all[i + 1]);
    return all;
  }

  // One margin of the closed mouth: 6 edges from the midline to the inner corner, beside the bottom of the seam.
  std::vector<int> slit(const std::string& middle, const std::string& side, int sign) {
    const Vector3d a = place(middle), b = place(side), c = place("65");
    std::vector<int> ids{landmark(middle)};
    const auto between = [&](const Vector3d& from, const Vector3d& to, int n) {
      for (int k = 1; k < n; ++k) ids.push_back(add_point(seam_point(from + k * (to - from) / n, c.x(), sign), false));
    };
    between(a, b, 3);
    ids.push_back(landmark(side));
    between(b, c, 3);
    ids.push_back(landmark("65"));
    for (size_t i = 0; i + 1 < ids.size(); ++i) segment(ids[i], ids[i + 1]);
    d_.slit.insert(d_.slit.end(), ids.begin(), ids.end());
    return ids;
  }

  // The deepest point of the groove near the guess, and half the gap above or below it.
  static Vector3d seam_point(const Vector3d& guess, double corner_x, int sign) {
    double best_y = guess.y(), depth = 1e9;
    for (double y = guess.y() - 2.5; y <= guess.y() + 2.5; y += 0.05) {
      const double z = front(guess.x(), y).z();
      if (z < depth) depth = z, best_y = y;
    }
    const double half_gap = 0.5 * std::sqrt(std::max(0.0, 1 - std::pow(guess.x() / corner_x, 4)));
    return front(guess.x(), best_y + sign * half_gap);
  }

  // 28 edges from the hairline past the ear to the throat.
  std::vector<int> rim_curve() {
    std::vector<int> ids{landmark("trichion")};
    const Vector3d corners[] = {{27, 65, 40}, {48, 59, 20}};
    for (const Vector3d& p : corners) ids.push_back(add_point(lift(chart(p)), false));
    ids.push_back(landmark("left_upper_temple"));
    const Vector3d ear[] = {{69, 36, -14}, {71, 14, -28}, {71, -1, -35}};
    for (const Vector3d& p : ear) ids.push_back(add_point(lift(chart(p)), false));
    ids.push_back(landmark("left_tragion"));
    const Vector3d neck[] = {{67, -38, -36}, {61, -62, -31}, {52, -82, -22}, {38, -97, -10}, {20, -104, -3}};
    for (const Vector3d& p : neck) ids.push_back(add_point(lift(chart(p)), false));
    ids.push_back(landmark("cervical"));
    return curve_through(ids, {3, 3, 2, 2, 2, 2, 1, 2, 2, 2, 3, 2, 2}, true);
  }

  void add_eye() {
    auto upper = curve({"43", "44", "45", "46"}, {2, 2, 2}, true);
    const auto lower = curve({"43", "48", "47", "46"}, {2, 2, 2}, true);
    upper.insert(upper.end(), lower.rbegin() + 1, lower.rend() - 1);
    d_.polygons["left_eye"] = upper;
  }

  void add_mouth(const std::vector<int>& upper_slit, const std::vector<int>& lower_slit) {
    auto upper = curve({"52", "53", "54", "55"}, {2, 2, 2}, true);
    const auto lower = curve({"58", "57", "56", "55"}, {2, 2, 2}, true);
    add_lip_row(upper, upper_slit);
    add_lip_row(lower, lower_slit);
    upper.insert(upper.end(), lower.rbegin() + 1, lower.rend());
    d_.polygons["lips"] = upper;
    segment(landmark("65"), landmark("55"));
  }

  // A row of vertices on the roll of a lip, half way from its border to the slit; it starts at the midline.
  void add_lip_row(const std::vector<int>& border, const std::vector<int>& slit) {
    int last = -1;
    for (size_t k = 0; k < 5; ++k) {
      const Vector3d middle = 0.5 * (d_.points[border[k]] + d_.points[slit[k]]);
      const int next = k ? add_point(front(middle.x(), middle.y()), false) : nearest_midline_point(middle);
      if (k) segment(last, next);
      last = next;
    }
  }

  int nearest_midline_point(const Vector3d& p) const {
    int best = -1;
    for (int v = 0; v < static_cast<int>(d_.points.size()); ++v)
      if (d_.midline[v] && (best < 0 || (d_.points[v] - p).norm() < (d_.points[best] - p).norm())) best = v;
    return best;
  }

  // The base of the nose and the crease around its wing.
  void add_wing() {
    const Vector3d side = place("left_alar_curvature");
    std::vector<int> ids;
    for (const char* name : {"34", "35", "36", "left_alar_curvature"}) ids.push_back(landmark(name));
    ids.push_back(add_point(front(side.x() - 0.6, side.y() + 5), false));
    ids.push_back(add_point(front(side.x() - 4.2, side.y() + 9.5), false));
    curve_through(ids, {1, 2, 2, 1, 1}, true);
  }

  // Whatever other landmarks there are on the half face become vertices as well, unless they crowd.
  void add_extras() {
    std::vector<Vector2d> polygon;
    for (const int v : d_.outline) polygon.push_back(chart(d_.points[v]));
    for (const auto& [name, mark] : landmarks_) {
      const Vector3d& p = mark.position;
      const bool crowded =
          std::any_of(d_.points.begin(), d_.points.end(), [&](const Vector3d& q) { return (p - q).norm() < 3; });
      if (p.x() > 2.5 && !crowded && inside(chart(p), polygon)) landmark(name);
    }
  }

  void add_outline(std::vector<int> top, const std::vector<int>& upper_slit, const std::vector<int>& lower_slit,
                   const std::vector<int>& lower, const std::vector<int>& rim) {
    top.insert(top.end(), upper_slit.begin() + 1, upper_slit.end());
    top.insert(top.end(), lower_slit.rbegin() + 1, lower_slit.rend());
    top.insert(top.end(), lower.begin() + 1, lower.end());
    top.insert(top.end(), rim.rbegin() + 1, rim.rend() - 1);
    d_.outline = top;
  }

  const Landmarks& landmarks_;
  HalfFaceDesign d_;
};

}  // namespace

HalfFaceDesign design_half_face(const Landmarks& landmarks) { return Designer(landmarks).run(); }

double wanted_length(const Vector3d& p, const Landmarks& landmarks) {
  struct Source {  // about which landmark the mesh is fine
    const char* name;
    double length;
  };
  constexpr Source sources[] = {{"43", 3.2}, {"44", 3.2}, {"45", 3.2}, {"46", 3.2},
                                {"47", 3.2}, {"48", 3.2}, {"52", 3.6}, {"54", 3.6},
                                {"55", 3.8}, {"56", 3.8}, {"58", 3.8}, {"64", 3.4},
                                {"31", 3.0}, {"36", 3.0}, {"34", 3.2}, {"left_alar_curvature", 3.0},
                                {"29", 4.2}, {"30", 3.8}, {"24", 6.0}, {"26", 6.0}};
  double length = 11.5;
  for (const Source& s : sources)
    length = std::min(length, s.length + 0.25 * (p - landmarks.at(s.name).position).norm());
  return length;
}

}  // namespace facewright::face_design
