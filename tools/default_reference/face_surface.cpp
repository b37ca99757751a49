// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tools/default_reference/face_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libmodel/synthetic/mean_head.h"

namespace facewright::face_design {
namespace {

const Vector3d centre{0, -18, -22};
const Vector3d forward = Vector3d(0, -0.12, 1).normalized();
const Vector3d upward = forward.cross(Vector3d::UnitX());

double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4;
}

// Fills each nostril flush with the underside of the nose.
double plug(const Vector3d& p) {
  const Vector3d q(std::abs(p.x()), p.y(), p.z()), c(6.6, -40.6, 61.2), radii(6.0, 4.9, 9.0);
  const double k0 = (q - c).cwiseQuotient(radii).norm();
  const double k1 = (q - c).cwiseQuotient(radii.cwiseAbs2()).norm();
  return k1 < 1e-9 ? -radii.minCoeff() : k0 * (k0 - 1) / k1;
}

// The outermost zero along origin + t * direction, from t = far inwards.
Vector3d outermost(const Vector3d& origin, const Vector3d& direction, double far) {
  double outside = far, t = far;
  for (;;) {
    const double d = distance(origin + t * direction);
    if (d <= 0 || t <= 0) break;
    outside = t;
    t -= std::max(0.25, 0.5 * d);
  }
  double inside = t;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (inside + outside);
    (distance(origin + middle * direction) > 0 ? outside : inside) = middle;
  }
  return origin + 0.5 * (inside + outside) * direction;
}

}  // namespace

double distance(const Vector3d& p) {
  const double d = mean_head_distance(p);
  return d > 15 || d < -15 ? d : smooth_min(d, plug(p), 1.5);
}

bool on_nostril_sheet(const Vector3d& p) { return mean_head_distance(p) > 0.3 && plug(p) < 1; }

Vector3d normal(const Vector3d& p) {
  Vector3d g;
  for (int k = 0; k < 3; ++k) {
    const Vector3d e = 0.3 * Vector3d::Unit(k);
    g[k] = distance(p + e) - distance(p - e);
  }
  return g.normalized();
}

Vector3d project(const Vector3d& p) {
  Vector3d x = p;
  for (int i = 0; i < 30; ++i) {
    const double d = distance(x);
    if (std::abs(d) < 1e-7) break;
    x -= std::clamp(d, -1.0, 1.0) * normal(x);
  }
  return x;
}

Vector2d chart(const Vector3d& p) {
  const Vector3d d = (p - centre).normalized();
  const Vector2d sideways(d.x(), d.dot(upward));
  const double s = sideways.norm(), angle = std::atan2(s, d.dot(forward));
  return s < 1e-12 ? Vector2d::Zero() : Vector2d(sideways * (angle / s));
}

Vector3d lift(const Vector2d& q) {
  const double angle = q.norm(), s = angle < 1e-12 ? 1 : std::sin(angle) / angle;
  const Vector3d d = std::cos(angle) * forward + s * (q.x() * Vector3d::UnitX() + q.y() * upward);
  return outermost(centre, d, 150);
}

Vector3d front(double x, double y) { return outermost({x, y, 0}, Vector3d::UnitZ(), 95); }

}  // namespace facewright::face_design
