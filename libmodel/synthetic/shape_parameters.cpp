// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/shape_parameters.h"

#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/synthetic/mean_head_internal.h"

namespace facewright {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double everywhere = 1e4;

WarpWindow shift(const Vector3d& centre, const Vector3d& radius, const Vector3d& by) {
  WarpWindow w;
  w.centre = centre;
  w.radius = radius;
  w.shift = by;
  return w;
}
WarpWindow stretch(const Vector3d& centre, const Vector3d& radius, const Vector3d& by) {
  WarpWindow w = shift(centre, radius, Vector3d::Zero());
  w.linear = by.asDiagonal();
  return w;
}
WarpWindow shear(const Vector3d& centre, const Vector3d& radius, int row, int column) {
  WarpWindow w = shift(centre, radius, Vector3d::Zero());
  w.linear(row, column) = 1;
  return w;
}
WarpWindow below(double from, double to, const Vector3d& by) {
  WarpWindow w = shift({0, -60, 20}, {everywhere, everywhere, 150}, by);
  w.ramp_from = from;
  w.ramp_to = to;
  return w;
}

struct Measure {
  const char *from, *to;
  int axis;
  double stddev;
};
struct Factors {
  double size = 0, dimorphism = 0, adiposity = 0;
};

class Table {
 public:
  void add(const char* name, std::vector<WarpWindow> windows, const Measure& m, const Factors& f = {}) {
    parameters.push_back({name, std::move(windows), m.from, m.to, m.axis, m.stddev, f.size, f.dimorphism, f.adiposity});
  }
  std::vector<ShapeParameter> parameters;
};

// A landmark's own movement is measured against a landmark that stays: "vertex" or "9" for the face, say.
constexpr int X = 0, Y = 1, Z = 2;

void add_head(Table& t) {
  t.add("size", {stretch({0, 0, -30}, {everywhere, everywhere, everywhere}, {1, 1, 1})}, {"menton", "28", Y, 3.2},
        {0.8, 0.5, 0});
  t.add("head_width", {stretch({0, 40, -45}, {120, 110, 110}, {1, 0, 0})}, {"right_euryon", "left_euryon", X, 4.5},
        {0.2, 0.2, 0});
  t.add("head_height", {shift({0, 115, -30}, {130, 60, 120}, {0, 1, 0})}, {"28", "vertex", Y, 4.5}, {0.2, 0.1, 0});
  t.add("head_length", {shift({0, 20, -140}, {120, 110, 80}, {0, 0, -1})}, {"opisthocranion", "glabella", Z, 5.0},
        {0.2, 0.2, 0});
  t.add("face_width", {shift({66, -18, -8}, {34, 44, 46}, {1, 0, 0})}, {"right_zygion", "left_zygion", X, 3.8},
        {0.2, 0.4, 0.3});
  t.add("midface_height", {below(2, -46, {0, -1, 0})}, {"34", "28", Y, 2.4}, {0.2, 0.3, 0});
  t.add("lower_face_height", {below(-52, -104, {0, -1, 0})}, {"menton", "34", Y, 2.8}, {0.2, 0.4, 0});
  t.add("facial_profile", {below(-34, -92, {0, 0, 1})}, {"28", "pogonion", Z, 2.6});
  t.add("midface_projection", {shift({0, -30, 50}, {44, 34, 40}, {0, 0, 1})}, {"glabella", "34", Z, 1.6});
}

void add_forehead(Table& t) {
  t.add("forehead_slope", {shift({0, 66, 44}, {70, 30, 46}, {0, 0, -1})}, {"trichion", "28", Z, 3.2}, {0, 0.35, 0});
  t.add("forehead_bulge", {shift({0, 44, 55}, {34, 19, 40}, {0, 0, 1})}, {"28", "metopion", Z, 1.4}, {0, -0.3, 0});
  t.add("forehead_width", {shift({56, 36, 18}, {26, 34, 38}, {1, 0, 0})}, {"right_temple", "left_temple", X, 3.4},
        {0.2, 0.1, 0});
  t.add("brow_ridge", {shift({20, 20, 53}, {20, 8.5, 20}, {0, -0.15, 1})}, {"28", "glabella", Z, 1.2}, {0, 0.65, 0});
  t.add("brow_height", {shift({30, 21, 48}, {27, 9, 26}, {0, 1, 0})}, {"45", "25", Y, 1.7}, {0, -0.5, 0});
  t.add("brow_arch", {shift({40, 24, 44}, {11, 8, 20}, {0, 1, 0}), shift({13, 19, 55}, {9, 7, 18}, {0, -0.8, 0})},
        {"23", "26", Y, 0.8}, {0, -0.4, 0});
  t.add("temple_fullness", {shift({62, 30, 10}, {15, 22, 24}, {1, 0, 0.2})}, {"right_temple", "left_temple", X, 2.0},
        {0, 0, 0.4});
}

void add_eyes(Table& t) {
  t.add("eye_spacing", {shift({31, 0, 34}, {21, 17, 30}, {1, 0, 0})}, {"40", "43", X, 2.2}, {0.2, 0.2, 0});
  t.add("eye_width", {stretch({31, 0, 34}, {21, 13, 26}, {1, 0.15, 0})}, {"43", "46", X, 1.2}, {0.2, 0.1, 0});
  t.add("eye_opening", {stretch({31, 0, 34}, {19, 11, 24}, {0, 1, 0})}, {"47", "45", Y, 1.0}, {0, -0.3, -0.1});
  t.add("eye_tilt", {shear({31, 0, 34}, {22, 15, 26}, 1, 0)}, {"43", "46", Y, 1.3}, {0, -0.2, 0});
  t.add("eye_depth", {shift({31, 2, 36}, {20, 15, 26}, {0, 0, -1})}, {"45", "28", Z, 1.5}, {0, 0.3, 0});
  t.add("lid_fold", {shift({32, 10.5, 42}, {17, 4.5, 16}, {0, -1, 0.4})}, {"left_lid_fold", "25", Y, 1.1},
        {0, 0.2, 0.1});
  t.add("eye_bag", {shift({28, -13, 42}, {12, 5, 15}, {0, 0, 1})}, {"28", "left_orbitale", Z, 0.6}, {0, 0, 0.2});
}

void add_nose(Table& t) {
  t.add("nose_length", {shift({0, -38, 66}, {18, 15, 28}, {0, -1, 0})}, {"31", "28", Y, 1.8}, {0.2, 0.2, 0});
  t.add("nose_width", {stretch({0, -40, 58}, {24, 12, 22}, {1, 0, 0})}, {"right_alare", "left_alare", X, 2.4},
        {0.2, 0.4, 0.1});
  t.add("nose_projection", {shift({0, -37, 72}, {17, 17, 24}, {0, 0, 1})}, {"36", "31", Z, 1.6}, {0.2, 0.2, 0});
  t.add("tip_rotation", {shift({0, -34, 77}, {12, 12, 14}, {0, 1, 0.1})}, {"34", "31", Y, 1.6}, {0, -0.3, 0});
  t.add("tip_width", {stretch({0, -36, 69}, {14, 9, 13}, {1, 0.25, 0})}, {"right_tip", "left_tip", X, 1.1},
        {0, 0.2, 0});
  t.add("bridge_height", {shift({0, 1, 53}, {12, 15, 18}, {0, 0, 1})}, {"left_infraorbital", "28", Z, 1.5},
        {0, 0.3, 0});
  t.add("bridge_width", {stretch({0, -12, 54}, {17, 18, 18}, {1, 0, 0})},
        {"right_nasal_wall", "left_nasal_wall", X, 1.3}, {0, 0.2, 0});
  t.add("nose_hump", {shift({0, -13, 61}, {10, 9.5, 16}, {0, 0, 1})}, {"31", "29", Z, 1.1}, {0, 0.3, 0});
  t.add("alar_height", {shift({13, -41, 57}, {7, 8, 12}, {0, 1, 0})}, {"34", "left_alare", Y, 0.9});
}

void add_mouth(Table& t) {
  t.add("mouth_height", {shift({0, -67, 55}, {40, 16, 40}, {0, 1, 0})}, {"menton", "63", Y, 1.5});
  t.add("mouth_width", {stretch({0, -68, 54}, {40, 16, 32}, {1, 0, 0})}, {"49", "55", X, 2.9}, {0.2, 0.3, 0});
  t.add("upper_lip_fullness", {shift({0, -62.5, 62}, {26, 5.5, 18}, {0, 1, 0.35})}, {"63", "52", Y, 1.2},
        {0, -0.25, 0});
  t.add("lower_lip_fullness", {shift({0, -75.5, 60}, {24, 5.5, 18}, {0, -1, 0.45})}, {"58", "67", Y, 1.3},
        {0, -0.2, 0});
  t.add("lip_protrusion", {shift({0, -68, 61}, {28, 14, 24}, {0, 0, 1})}, {"34", "63", Z, 1.7});
  t.add("mouth_corner", {shift({26, -68, 50}, {12, 9, 18}, {0, 1, 0.2})}, {"63", "55", Y, 0.6});
  t.add("philtrum_depth", {shift({0, -54, 62}, {3.6, 7, 10}, {0, 0, -1})}, {"", "", Z, 0.35});
  t.add("nasolabial_fold", {shift({29, -52, 50}, {5, 13, 14}, {-0.2, 0, -1})}, {"", "", Z, 0.45}, {0, 0, 0.3});
}

void add_jaw(Table& t) {
  t.add("chin_height", {shift({0, -106, 48}, {30, 18, 34}, {0, -1, 0})}, {"menton", "58", Y, 2.2}, {0.1, 0.35, 0});
  t.add("chin_projection", {shift({0, -101, 54}, {28, 18, 32}, {0, 0, 1})}, {"58", "pogonion", Z, 2.4}, {0, 0.3, 0});
  t.add("chin_width", {stretch({0, -101, 46}, {34, 16, 32}, {1, 0, 0})}, {"right_chin", "left_chin", X, 2.2},
        {0, 0.5, 0.1});
  t.add("labiomental_depth", {shift({0, -84.5, 53}, {22, 6.5, 16}, {0, 0, -1})}, {"labiomental", "pogonion", Z, 0.9},
        {0, 0.2, 0});
  t.add("jaw_width", {shift({53, -72, -8}, {28, 36, 40}, {1, 0, 0})}, {"right_gonion", "left_gonion", X, 4.4},
        {0.2, 0.5, 0.3});
  t.add("jaw_angle", {shift({52, -78, -6}, {26, 26, 34}, {0, -1, 0})}, {"left_gonion", "28", Y, 3.4}, {0.1, 0.4, 0});
  t.add("jowl", {shift({38, -86, 24}, {18, 18, 24}, {0.8, -0.5, 0.3})}, {"right_jowl", "left_jowl", X, 2.2},
        {0, 0, 0.7});
  t.add("submental_fullness", {shift({0, -113, 14}, {36, 22, 32}, {0, -1, 0})}, {"submental", "28", Y, 2.6},
        {0, 0, 0.7});
  t.add("cheek_fullness", {shift({46, -45, 33}, {18, 20, 24}, {0.65, -0.1, 0.75})},
        {"right_cheek", "left_cheek", X, 2.4}, {0, -0.1, 0.75});
  t.add("cheekbone", {shift({50, -17, 34}, {17, 12, 22}, {0.6, 0.1, 0.8})}, {"28", "left_zygoma", Z, 1.3},
        {0, -0.1, -0.2});
}

void add_neck_and_ears(Table& t) {
  t.add("neck_width", {stretch({0, -145, -60}, {110, 50, 110}, {1, 0, 0.8})}, {"right_neck", "left_neck", X, 5.0},
        {0.2, 0.6, 0.4});
  t.add("ear_length", {stretch({76, -13, -58}, {22, 40, 30}, {0.2, 1, 0.5})},
        {"left_subaurale", "left_superaurale", Y, 3.0}, {0.2, 0.3, 0});
  t.add("ear_protrusion", {shift({84, -6, -68}, {14, 38, 20}, {1, 0, 0})},
        {"left_tragion", "left_superaurale", X, 2.2});
  t.add("ear_height", {shift({76, -13, -58}, {24, 42, 32}, {0, 1, 0})}, {"28", "left_superaurale", Y, 2.2});
}

Vector3d moved(const ShapeParameter& p, const Landmarks& marks, const std::string& name) {
  const auto found = marks.find(name);
  if (found == marks.end()) throw InvalidInput("shape_parameters: the mean head has no landmark \"" + name + "\"");
  return p.displacement(found->second.position);
}

/// Scales the windows so that one standard deviation moves the measure by its published standard deviation.
void calibrate(ShapeParameter& p, const Landmarks& marks) {
  if (p.from.empty()) {
    for (WarpWindow& w : p.windows) w.shift *= p.stddev;
    return;
  }
  const double change = (moved(p, marks, p.to) - moved(p, marks, p.from))[p.axis];
  if (std::abs(change) < 1e-3) throw InvalidInput("shape_parameters: \"" + p.name + "\" does not move its measure");
  for (WarpWindow& w : p.windows) {
    w.shift *= p.stddev / change;
    w.linear *= p.stddev / change;
  }
}

}  // namespace

Vector3d WarpWindow::displacement(const Vector3d& p) const {
  const double ramp = ramp_from == ramp_to ? 1 : mean_head::smooth_step(ramp_from, ramp_to, p.y());
  if (ramp == 0) return Vector3d::Zero();
  const auto one_side = [&](const Vector3d& q) -> Vector3d {
    const double r2 = (q - centre).cwiseQuotient(radius).squaredNorm();
    if (r2 > 20) return Vector3d::Zero();
    return std::exp(-r2) * (shift + linear * (q - centre));
  };
  Vector3d d = one_side(p);
  if (centre.x() != 0) {
    const Vector3d flip{-1, 1, 1};
    d += one_side(p.cwiseProduct(flip)).cwiseProduct(flip);
  }
  return ramp * d;
}

Vector3d ShapeParameter::displacement(const Vector3d& p) const {
  Vector3d d = Vector3d::Zero();
  for (const WarpWindow& w : windows) d += w.displacement(p);
  return d;
}

std::vector<ShapeParameter> shape_parameters(const Landmarks& mean_landmarks) {
  Table table;
  add_head(table);
  add_forehead(table);
  add_eyes(table);
  add_nose(table);
  add_mouth(table);
  add_jaw(table);
  add_neck_and_ears(table);
  for (ShapeParameter& p : table.parameters) calibrate(p, mean_landmarks);
  return std::move(table.parameters);
}

}  // namespace facewright
