// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"
#include "libregister/subdivision/triangle_pairing.h"

namespace facewright {

/// The edge that a bisection splits, with what a refinement criterion may look at.
struct BaseEdge {
  int a = -1, b = -1;            ///< the edge
  int apex = -1, opposite = -1;  ///< the corners facing it; opposite == -1 on a border
  double length = 0;             ///< mm
  double bend = 0;               ///< radians, >= 0: angle between the surface normals on both sides; 0 on a border
};

/// A 4-8 mesh (velho2001): every triangle has a newest vertex, its apex, and is bisected through the edge facing it,
/// its base. Vertices are only ever appended, so every earlier state is a prefix of the vertices; there are no
/// T-vertices. With a mirror table, a bisection and its mirror image are always made together.
class FourEightMesh {
 public:
  /// Splits the blocks of the pairing at their centres: V1 = V + pairs + singles, F1 = 2 F + singles; boundary edges
  /// stay. V (N x 3), F (M x 3); mirror as in pair_triangles. Throws InvalidInput on a non-manifold or inconsistently
  /// oriented mesh, or a pairing of another mesh.
  FourEightMesh(const Vertices& V, const Faces& F, const std::vector<int>& mirror, const TrianglePairing& pairing);

  int base_count() const { return base_count_; }
  int vertex_count() const { return static_cast<int>(positions_.size()); }
  int face_count() const { return static_cast<int>(corners_.size()); }
  Vertices positions() const;                                             ///< (vertex_count x 3)
  Faces faces() const;                                                    ///< (face_count x 3), apex first
  const std::vector<VertexParents>& parents() const { return parents_; }  ///< of the vertices from base_count() on
  const std::vector<int>& mirror() const { return mirror_; }              ///< per vertex, empty without symmetry

  /// Moves the vertices, all of them (vertex_count x 3), and recomputes the normals behind BaseEdge::bend.
  void set_positions(const Vertices& V);

  /// Bisects triangle t, first whatever neighbours have to be bisected for that, and the mirror images of all these.
  /// `changed` are the triangles that came into being. New vertices lie on the midpoints.
  struct Bisection {
    int vertices = 0;
    std::vector<int> changed;
  };
  Bisection bisect(int t);
  /// How many vertices bisect(t) would add.
  int cost(int t) const;
  /// How many boundary edges bisect(t) would add: 0, 1 or, with symmetry, 2.
  int boundary_cost(int t) const;
  /// Whether the base of t has no triangle on its other side.
  bool on_border(int t) const { return opposite_.at(static_cast<size_t>(t))[0] < 0; }
  /// Bisects every triangle once. From the constructor's state: V2 = V + E + singles, F2 = 4 F + 2 singles, B2 = 2 B.
  void uniform_step();

  BaseEdge base_edge(int t) const;
  double base_area(int t) const;  ///< mm^2, of the one or two triangles at the base of t
  int apex(int t) const { return corners_.at(static_cast<size_t>(t))[0]; }

 private:
  using Triple = std::array<int, 3>;
  int add_vertex(const VertexParents& parents);
  void add_block(const Faces& F, const TriangleBlock& block);
  void connect();
  void split(int t, Bisection& done);
  std::array<int, 4> split_pair(int t);
  int add_half(int t, int m);
  bool compatible(int t) const { return opposite_[t][0] < 0 || opposite_[opposite_[t][0]][0] == t; }
  int last_of_chain(int t) const;
  bool is_own_image(int t) const { return twin_[t] == t || twin_[t] == opposite_[t][0]; }
  void match_twins(const std::array<int, 4>& these, const std::array<int, 4>& images);
  void redirect(int t, int from, int to);

  int base_count_ = 0;
  std::vector<Eigen::Vector3d> positions_, normals_;
  std::vector<VertexParents> parents_;
  std::vector<int> mirror_;
  std::vector<Triple> corners_;   // apex, then the base, counter-clockwise
  std::vector<Triple> opposite_;  // neighbour facing each corner, -1 on a border
  std::vector<int> twin_;         // mirror image of each triangle, empty without symmetry
};

}  // namespace facewright
