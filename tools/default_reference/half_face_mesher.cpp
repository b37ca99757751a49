// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tools/default_reference/half_face_mesher.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "tools/default_reference/half_face_relaxation.h"

namespace facewright::face_design {
namespace {

std::vector<Vector2d> outline_in_chart(const HalfFaceDesign& d) {
  std::vector<Vector2d> q;
  for (const int v : d.outline) q.push_back(chart(d.points[v]));
  return q;
}

std::vector<Vector3d> candidates(const std::vector<Vector2d>& polygon, int count, std::uint64_t seed) {
  Eigen::AlignedBox2d box;
  for (const auto& q : polygon) box.extend(q);
  Random random(seed);
  std::vector<Vector3d> result;
  while (static_cast<int>(result.size()) < count) {
    const double x = random.uniform(box.min().x(), box.max().x()), y = random.uniform(box.min().y(), box.max().y());
    if (inside({x, y}, polygon)) result.push_back(lift({x, y}));
  }
  return result;
}

// Farthest-point sampling in units of the wanted length; curves keep free points off.
void add_free_points(HalfFaceMesh& mesh, const HalfFaceDesign& design, int count, const WantedLength& wanted,
                     std::uint64_t seed) {
  const auto samples = candidates(outline_in_chart(design), 12000, seed);
  std::vector<double> length, room(samples.size(), std::numeric_limits<double>::max());
  for (const auto& p : samples) length.push_back(wanted(p));
  const auto occupy = [&](const Vector3d& p, double share) {
    for (size_t i = 0; i < samples.size(); ++i)
      room[i] = std::min(room[i], (samples[i] - p).norm() / (share * length[i]));
  };
  for (const auto& p : mesh.points) occupy(p, 1);
  for (const auto& p : design.curve_samples) occupy(p, 0.8);
  while (static_cast<int>(mesh.points.size()) < count) {
    const auto best = static_cast<size_t>(std::max_element(room.begin(), room.end()) - room.begin());
    mesh.points.push_back(samples[best]);
    mesh.midline.push_back(false);
    mesh.pinned.push_back(false);
    occupy(samples[best], 1);
  }
}

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Cdt =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>>;

void triangulate(HalfFaceMesh& mesh, const HalfFaceDesign& design) {
  Cdt cdt;
  std::vector<Cdt::Vertex_handle> handles;
  for (size_t i = 0; i < mesh.points.size(); ++i) {
    const Vector2d q = chart(mesh.points[i]);
    handles.push_back(cdt.insert(Cdt::Point(q.x(), q.y())));
    handles.back()->info() = static_cast<int>(i);
  }
  if (cdt.number_of_vertices() != mesh.points.size())
    throw InvalidInput("make-default-reference: two points of the design coincide");
  for (const auto& [a, b] : design.segments) cdt.insert_constraint(handles[a], handles[b]);
  const auto polygon = outline_in_chart(design);
  for (auto f = cdt.finite_faces_begin(); f != cdt.finite_faces_end(); ++f) {
    std::array<int, 3> t{};
    Vector2d middle = Vector2d::Zero();
    for (int k = 0; k < 3; ++k) {
      t[k] = f->vertex(k)->info();
      middle += Vector2d(f->vertex(k)->point().x(), f->vertex(k)->point().y()) / 3;
    }
    if (inside(middle, polygon)) mesh.triangles.push_back(t);
  }
}

}  // namespace

bool inside(const Vector2d& q, const std::vector<Vector2d>& polygon) {
  bool result = false;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Vector2d &a = polygon[i], &b = polygon[j];
    if ((a.y() > q.y()) != (b.y() > q.y()) && q.x() < (b.x() - a.x()) * (q.y() - a.y()) / (b.y() - a.y()) + a.x())
      result = !result;
  }
  return result;
}

HalfFaceMesh mesh_half_face(const HalfFaceDesign& design, int point_count, const WantedLength& wanted,
                            std::uint64_t seed) {
  HalfFaceMesh mesh{design.points, design.midline, design.pinned, {}};
  const int used = static_cast<int>(mesh.points.size());
  if (used > point_count)
    throw InvalidInput("make-default-reference: the design alone has " + std::to_string(used) + " points");
  add_free_points(mesh, design, point_count, wanted, seed);
  triangulate(mesh, design);
  relax(mesh, design, wanted);
  return mesh;
}

}  // namespace facewright::face_design
