// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/surface/nearest.h"
#include "libregister/reference/reference_face.h"

namespace facewright {
namespace {

constexpr double farthest_landmark = 15;  // mm: beyond it the landmarks belong to another mesh or unit

MeshLandmark mark_point(const Mesh& mesh, const NearestPoint& nearest, double vertex_reach) {
  for (int k = 0; k < 3; ++k) {
    const int v = mesh.F(nearest.where.triangle, k);
    if ((mesh.V.row(v).transpose() - nearest.position).norm() <= vertex_reach) return mark_vertex(mesh.F, v);
  }
  return {nearest.where, -1};
}

}  // namespace

ReferenceFace make_reference_face(const Mesh& mesh, const Landmarks& landmarks, double vertex_reach) {
  validate(mesh);
  ReferenceFace face;
  face.mesh.V = mesh.V;
  face.mesh.F = mesh.F;
  face.mirror = find_mirror(face.mesh);
  const SurfaceIndex surface(mesh.V, mesh.F);
  for (const auto& [name, mark] : landmarks) {
    const NearestPoint nearest = surface.nearest(mark.position);
    if (nearest.distance > farthest_landmark)
      throw InvalidInput("reference: landmark " + name + " is " + std::to_string(nearest.distance) +
                         " mm from the surface; are mesh and landmarks in the same frame, in millimetres?");
    face.landmarks[name] = mark_point(face.mesh, nearest, vertex_reach);
  }
  const auto loops = boundary_loops(mesh.F);
  if (!loops.empty()) {
    face.regions["rim"] = loops.front();
    std::sort(face.regions["rim"].begin(), face.regions["rim"].end());
  }
  return face;
}

MultiresTemplate reference_from_mesh(const Mesh& mesh, const Landmarks& landmarks, const std::vector<int>& budgets) {
  return build_template(make_reference_face(mesh, landmarks), budgets);
}

}  // namespace facewright
