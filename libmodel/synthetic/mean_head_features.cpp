// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.

#include "libmodel/synthetic/mean_head_internal.h"

namespace facewright::mean_head {

// --- curves ---

double canthal_line(double x) { return -1.2 + 2.4 * (x - en_x) / (ex_x - en_x); }

namespace {
/// A hump over [0, 1]: 0 at the ends, 1 at its peak near `skew`.
double hump(double t, double skew, double power) {
  if (t <= 0 || t >= 1) return 0;
  const double u = std::pow(t, std::log(0.5) / std::log(skew));
  return std::pow(4 * u * (1 - u), power);
}
double eye_parameter(double x) { return (x - en_x) / (ex_x - en_x); }
double mouth_parameter(double x) { return std::min(std::abs(x) / mouth_half_width, 1.0); }
}  // namespace

double upper_lid(double x) { return canthal_line(x) + 5.6 * hump(eye_parameter(x), 0.47, 0.72); }
double lower_lid(double x) { return canthal_line(x) - 4.9 * hump(eye_parameter(x), 0.56, 0.80); }
double lid_crease(double x) {
  const double t = std::clamp(eye_parameter(x), -0.1, 1.12);
  return canthal_line(x) + 2.4 + 7.2 * hump((t + 0.12) / 1.26, 0.5, 0.75);
}

double eye_opening(double x, double y) {
  const double t = eye_parameter(x);
  if (t <= 0 || t >= 1) return std::max(std::max(en_x - x, x - ex_x), std::abs(y - canthal_line(x)));
  return std::max(y - upper_lid(x), lower_lid(x) - y);
}

double lip_seam(double x) {
  const double t = mouth_parameter(x);
  return -68.3 - 0.9 * gauss(t / 0.13) + 0.5 * gauss((t - 0.42) / 0.22) - 0.2 * smooth_step(0.6, 1.0, t);
}
double upper_vermilion(double x) {
  const double t = mouth_parameter(x);
  const double bow = -1.5 * gauss(t / 0.13) + 0.3 * gauss((t - 0.25) / 0.12);
  return lip_seam(mouth_half_width * std::max(t, 0.2)) + (7.9 + bow) * std::pow(1 - std::pow(t, 1.55), 0.95);
}
double lower_vermilion(double x) {
  const double t = mouth_parameter(x);
  return lip_seam(mouth_half_width * std::max(t, 0.3)) - 9.4 * std::pow(1 - std::pow(t, 2.1), 0.85);
}

double brow_line(double x) {
  const double t = (x - brow_inner_x) / (brow_outer_x - brow_inner_x);
  return 18.2 + 8.0 * hump(std::clamp(0.02 + 0.9 * t, 0.0, 1.0), 0.58, 1.0) + 2.0 * t - 4.0 * t * t * t;
}
double brow_half_thickness(double x) {
  const double t = std::clamp((x - brow_inner_x) / (brow_outer_x - brow_inner_x), 0.0, 1.0);
  return 3.9 - 2.9 * t * t;
}

// --- parts ---

namespace {
double front(const Vector3d& p) { return smooth_step(8, 26, p.z()); }
}  // namespace

double add_lids(double d, const Vector3d& p) {
  const Vector3d q{std::abs(p.x()), p.y(), p.z()};
  if (q.x() > 66 || std::abs(q.y()) > 34 || q.z() < 10) return d;
  d = smooth_min(d, (q - eye_centre).norm() - lid_radius, 5);
  const double x = q.x(), y = q.y(), mask = front(q);
  // skin fold above the crease, bag and furrow below, hollow beside the nose
  const double along = smooth_step(11, 19, x) * smooth_step(52, 42, x), crease = lid_crease(x);
  d += mask * along * 1.5 * gauss((y - crease) / 1.1);
  d -= mask * along * 1.3 * gauss((y - crease - 3.4) / 2.6);
  d += mask * 0.5 * smooth_step(14, 24, x) * smooth_step(46, 36, x) * gauss((y - lower_lid(x) + 5.2) / 1.8);
  d += mask * 0.9 * gauss((x - 20 - 0.55 * (-8 - y)) / 4.5) * smooth_step(-4, -10, y) * smooth_step(-24, -14, y);
  // brow hair stands a little off the skin
  const double end =
      smooth_step(brow_inner_x - 2, brow_inner_x + 3, x) * smooth_step(brow_outer_x + 2, brow_outer_x - 6, x);
  return d - mask * 0.7 * end * gauss((y - brow_line(x)) / (brow_half_thickness(x) + 1));
}

double add_eyes(double d, const Vector3d& p) {
  const Vector3d q{std::abs(p.x()), p.y(), p.z()};
  if (q.x() < 10 || q.x() > 52 || std::abs(q.y()) > 14 || q.z() < 20) return d;
  d += 2.3 * smooth_step(0.5, -0.9, eye_opening(q.x(), q.y()));
  const double ball = (q - eye_centre).norm() - eye_radius;
  const double cornea = (q - eye_centre - Vector3d{0, 0, 5.2}).norm() - 7.7;
  return std::min(d, smooth_min(ball, cornea, 1.5));
}

namespace {
/// The nasal pyramid from nasion to the lobule: a parabolic section whose ridge, width and foot run along y.
double nasal_pyramid(const Vector3d& q) {
  const double s = std::clamp((6 - q.y()) / 42, -0.4, 1.3);  // 0 at the nasion, 1 at the tip
  const double ridge = 51.8 + 18.6 * s + 4.9 * s * s, foot = 43 + 2.5 * s + 5.0 * s * s;
  const double width = 8.6 + 5.2 * s + 2.6 * s * s, u = q.x() / width, height = ridge - foot;
  const double z = foot + height * (1 - u * u), slope = 2 * height * u / width;
  return (q.z() - z) / std::sqrt(1.4 + slope * slope);
}
}  // namespace

double add_nose(double d, const Vector3d& p) {
  const Vector3d q{std::abs(p.x()), p.y(), p.z()};
  if (q.x() > 36 || q.y() > 34 || q.y() < -66 || q.z() < 24) return d;
  const double pyramid = smooth_max(smooth_max(nasal_pyramid(q), -37.5 - q.y(), 5), q.y() - 18, 8);
  d = smooth_min(d, pyramid, 7);
  double lobule = ellipsoid(q, {0, -37.2, 60}, {12.0, 8.6, 11.5});
  double tip = ellipsoid(q, {0, -36.2, 65.2}, {8.6, 9.0, 9.6});
  tip = smooth_min(tip, ellipsoid(q, {3.0, -36.0, 68.5}, {5.2, 6.2, 6.0}), 4);
  lobule = smooth_min(lobule, tip, 4);
  d = smooth_min(d, lobule, 5);
  d = smooth_min(d, tapered_capsule(q, {0, -40.5, 68.5}, {0, -46, 58.5}, 3.5, 4.2), 4);  // columella
  // wings: from the tip around to the alar base
  double wing = ellipsoid(q, {10.6, -39.6, 58.6}, {5.7, 6.2, 9.6});
  wing = smooth_min(wing, ellipsoid(q, {11.6, -40.8, 54.6}, {5.3, 5.6, 6.4}), 3);
  d = smooth_min(d, wing, 4.2);
  d += 0.7 * gauss((wing - 1.0) / 1.3) * smooth_step(12, 16, q.x()) * smooth_step(-30, -36, q.y());  // alar crease
  d += 0.25 * gauss((q.x() - 9.6) / 1.8) * gauss((q.y() + 35) / 4.5) * smooth_step(56, 62, q.z());   // tip from wing
  // nostrils: ovals that lean towards the tip
  const Vector3d n = q - Vector3d{6.7, -45.2, 62.4};
  const Vector3d turned{0.90 * n.x() + 0.43 * n.z(), n.y(), -0.43 * n.x() + 0.90 * n.z()};
  return smooth_max(d, -ellipsoid(turned, Vector3d::Zero(), {2.9, 5.0, 5.2}), 1.8);
}

namespace {
/// Height of a lip over s = 0 at the seam .. 1 at its border, highest at s = crest.
double lip_roll(double s, double crest) {
  if (s < 0) return 0.55 * gauss(s / 0.2);
  return s < crest ? 1 - 0.45 * std::pow(1 - s / crest, 2.2) : smooth_step(1.35, crest - 0.05, s);
}
}  // namespace

double add_mouth(double d, const Vector3d& p) {
  const double x = std::abs(p.x()), y = p.y();
  if (x > 48 || y > -38 || y < -104 || p.z() < 8) return d;
  const double t = std::min(x / mouth_half_width, 1.0), mask = front(p);
  const double seam = lip_seam(x), top = upper_vermilion(x), bottom = lower_vermilion(x);
  const double taper = std::sqrt(std::max(1 - t * t, 0.0));
  double h = 0;
  // the rolls of the lips: steep to the vermilion border, rounded in towards the seam
  const double upper = std::max(top - seam, 0.3), lower = std::max(seam - bottom, 0.3);
  h = smooth_max(2.5 * taper * lip_roll((y - seam) / upper, 0.50), 3.9 * taper * lip_roll((seam - y) / lower, 0.42),
                 0.5) -
      0.125;
  h -= (1.5 * taper + 0.7) * gauss((y - seam) / 1.15) * smooth_step(1.12, 0.96, x / mouth_half_width);   // seam
  h -= 1.0 * gauss((x - mouth_half_width - 0.5) / 3.4) * gauss((y - lip_seam(mouth_half_width)) / 3.4);  // corner
  h += 0.35 * gauss((y - top) / 0.9) * smooth_step(0.9, 0.6, t) +
       0.25 * gauss((y - bottom) / 1.0) * smooth_step(0.8, 0.5, t);
  // philtrum with its columns
  const double philtrum = smooth_step(-60.5, -57.5, y) * smooth_step(-46.5, -50, y);
  h -= 1.1 * philtrum * gauss(x / 2.8);
  h += 0.7 * philtrum * gauss((x - 4.7 + 0.08 * (y + 54)) / 1.9);
  // nasolabial and labiomental furrows
  const double fold = 19.5 + 0.50 * (-40 - y);
  h -= 0.9 * gauss((x - fold) / 3.4) * smooth_step(-38, -44, y) * smooth_step(-68, -54, y);
  h -= 1.6 * gauss((y + 84.5 - 0.004 * x * x) / 4.0) * smooth_step(24, 10, x);
  return d - mask * h;
}

double ear_distance(const Vector3d& p) {
  const Vector3d q{std::abs(p.x()), p.y(), p.z()};
  // ear frame: a backwards along the width, b up along the length (leaning back), c outwards
  const Vector3d up = Vector3d{0.08, 0.965, -0.25}.normalized(), along{0.42, 0, -0.91};
  const Vector3d back = (along - along.dot(up) * up).normalized(), out = back.cross(up);
  const Vector3d r = q - Vector3d{73.5, -13, -57};
  const double a = r.dot(back), b = r.dot(up), c = r.dot(out);
  const double width = b > 0 ? 16.0 : 16.0 + 0.04 * b;  // narrows to the lobe
  const double rho = std::hypot(a / width, b / 29.5), angle = std::atan2(b / 29.5, a / width);
  // height of the outer face: rolled helix, antihelix, bowl, flat lobe
  const double rim = smooth_step(-1.35, -0.8, angle) * smooth_step(3.3, 2.6, angle);
  const double inner = smooth_step(-1.7, -1.0, angle) * smooth_step(2.0, 1.2, angle);
  double h = 1.2 + 2.6 * rim * gauss((rho - 0.90) / 0.12) + 2.6 * inner * gauss((rho - 0.56) / 0.15);
  h -= 5.5 * gauss(std::hypot((a + 4.0) / 7.5, (b + 4.5) / 10.0));
  return smooth_max((rho - 1) * 16, std::abs(c - 0.5 * h + 1.2) - 0.5 * h - 1.5, 2.0) * 0.85;
}

double add_ear(double d, const Vector3d& p) {
  const Vector3d q{std::abs(p.x()), p.y(), p.z()};
  if (q.x() < 52 || q.y() < -62 || q.y() > 36 || q.z() > -20 || q.z() < -105) return d;
  const double root = ellipsoid(q, {68.5, -12, -56}, {7, 19, 8}),
               tragus = ellipsoid(q, {69.0, -16, -45.0}, {3.2, 5.0, 4.5});
  return smooth_min(smooth_min(d, smooth_min(ear_distance(q), root, 4), 4), tragus, 7);
}

}  // namespace facewright::mean_head
