// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/reference_check.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

constexpr double degrees = 180 / std::numbers::pi;

double smallest_angle(const Vertices& V, const Faces& F) {
  double smallest = std::numbers::pi;
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = V.row(F(f, (k + 1) % 3)) - V.row(F(f, k));
      const Eigen::Vector3d b = V.row(F(f, (k + 2) % 3)) - V.row(F(f, k));
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return smallest;
}

bool maps_to_itself(const Faces& F, const std::vector<int>& mirror) {
  if (mirror.empty()) return false;
  try {
    mirrored_triangles(F, mirror);
  } catch (const InvalidInput&) {
    return false;
  }
  return true;
}

}  // namespace

ReferenceCheck check_reference(const ReferenceFace& face) {
  const Vertices& V = face.mesh.V;
  const Faces& F = face.mesh.F;
  ReferenceCheck check;
  check.vertices = static_cast<int>(V.rows());
  check.triangles = static_cast<int>(F.rows());
  check.boundary_edges = boundary_edge_count(F);
  check.boundary_loops = static_cast<int>(boundary_loops(F).size());
  check.components = connected_components(V.rows(), F).count;
  check.euler_characteristic = euler_characteristic(F);
  check.smallest_angle_deg = degrees * smallest_angle(V, F);
  const Vertices normals = face_normals(V, F);
  check.shortest_edge = INFINITY;
  for (const Edge& e : edges(F)) {
    const double length = (V.row(e.v0) - V.row(e.v1)).norm();
    check.shortest_edge = std::min(check.shortest_edge, length);
    check.longest_edge = std::max(check.longest_edge, length);
    if (e.is_boundary()) continue;
    const double cosine = std::clamp(normals.row(e.f0).dot(normals.row(e.f1)), -1.0, 1.0);
    check.sharpest_fold_deg = std::max(check.sharpest_fold_deg, degrees * std::acos(cosine));
  }
  check.self_intersections = count_self_intersections(V, F);
  check.symmetric = maps_to_itself(F, face.mirror);
  for (size_t v = 0; v < face.mirror.size(); ++v) {
    const Eigen::RowVector3d p = V.row(static_cast<Eigen::Index>(v)), q = V.row(face.mirror[v]);
    check.largest_asymmetry = std::max(check.largest_asymmetry, (p - Eigen::RowVector3d(-q.x(), q.y(), q.z())).norm());
  }
  return check;
}

}  // namespace facewright
