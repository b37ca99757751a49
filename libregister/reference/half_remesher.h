// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "libmodel/core/random.h"
#include "libmodel/surface/nearest.h"
#include "libregister/reference/half_face.h"

namespace facewright {

/// The triangulation that remesh_half works on: flat arrays, dead entries stay until the end.
class HalfRemesher {
 public:
  HalfRemesher(const HalfFace& half, const std::vector<int>& fixed);

  int whole_count() const { return 2 * alive_vertices_ - alive_midline_; }  ///< vertices of the mirrored face
  /// Collapses short edges until at most `target` vertices are left, or none can go.
  void thin_out(int target);
  /// Splits or collapses single edges until the whole face has exactly `target` vertices; false if that fails.
  bool reach(int target);
  void split_long(double factor);
  void collapse_short(double factor);
  void flip_edges();
  void smooth();
  /// Small trial moves about poor triangles; keeps what helps the worst.
  void improve_worst(int round);

  /// The triangulation, and the vertices now at the fixed ones.
  HalfFace result(const std::vector<int>& fixed, std::vector<int>* vertices_of) const;

 private:
  using Triple = std::array<int, 3>;
  struct Vertex {
    Eigen::Vector3d neutral, shape, neutral_normal, shape_normal;
    double size = 1;
    std::vector<std::pair<int, double>> curves;  // border curves it lies on, with the arc length there
    bool fixed = false, midline = false, slit = false, alive = true;
  };
  struct Curve {
    std::vector<int> chain;   // vertices of the domain
    std::vector<double> arc;  // arc length on the shape up to each
    bool midline = false, slit = false;
  };

  void trace_curves();
  Vertex vertex_of_domain(int v) const;
  bool place(Vertex& v, const Eigen::Vector3d& neutral) const;
  void place_on_curve(Vertex& v, int curve, double arc) const;
  bool move(int v, Vertex moved, double least_merit);
  int common_curve(int a, int b) const;

  double length(int a, int b) const { return (at(a).shape - at(b).shape).norm(); }
  double relative_length(int a, int b) const { return 2 * length(a, b) / (at(a).size + at(b).size); }
  double merit(int a, int b, int c) const;
  double worst_around(int v) const;
  double size_factor() const;
  double sharpest_turn(int a, int b, int c, int d) const;
  Vertex& at(int v) { return vertices_[static_cast<size_t>(v)]; }
  const Vertex& at(int v) const { return vertices_[static_cast<size_t>(v)]; }
  std::vector<int>& ring(int v) { return rings_[static_cast<size_t>(v)]; }
  const std::vector<int>& ring(int v) const { return rings_[static_cast<size_t>(v)]; }
  const Triple& triangle(int t) const { return triangles_[static_cast<size_t>(t)]; }
  std::vector<int> neighbours(int v) const;
  std::vector<int> triangles_of_edge(int a, int b) const;
  std::vector<std::pair<int, int>> edge_list() const;
  int opposite_corner(int t, int a, int b) const;

  bool collapse(int a, int b);  // a goes into b
  bool collapse_either(int a, int b) { return collapse(a, b) || collapse(b, a); }
  bool may_collapse(int a, int b, const std::vector<int>& shared) const;
  int split(int a, int b);
  bool flip(int a, int b);
  bool adjust_once(int missing);

  const HalfFace& domain_;
  SurfaceIndex index_;
  Vertices neutral_normals_, shape_normals_;
  std::vector<Curve> curves_;
  std::vector<std::vector<std::pair<int, double>>> on_curve_;  // per domain vertex
  std::vector<Vertex> vertices_;
  std::vector<Triple> triangles_;  // {-1, -1, -1}: dead
  std::vector<std::vector<int>> rings_;
  int alive_vertices_ = 0, alive_midline_ = 0;
};

}  // namespace facewright
