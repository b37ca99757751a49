// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// An undirected edge v0 < v1 and its one or two triangles; f1 == -1 on a border.
struct Edge {
  int v0, v1;
  int f0, f1;
  bool is_boundary() const { return f1 < 0; }
};

/// Edges in lexicographic order of (v0, v1). Throws InvalidInput if three or more triangles share an edge.
std::vector<Edge> edges(const Faces& F);

/// Compressed rows: the neighbours of i are indices[offsets[i] .. offsets[i+1]).
struct Adjacency {
  std::vector<int> offsets, indices;
  int size() const { return static_cast<int>(offsets.size()) - 1; }
  const int* begin(int i) const { return indices.data() + offsets[i]; }
  const int* end(int i) const { return indices.data() + offsets[i + 1]; }
  int degree(int i) const { return offsets[i + 1] - offsets[i]; }
};

/// Neighbouring vertices of every vertex, ascending; works on non-manifold input too.
Adjacency vertex_neighbours(Eigen::Index vertex_count, const Faces& F);
/// Incident triangles of every vertex, ascending.
Adjacency vertex_faces(Eigen::Index vertex_count, const Faces& F);
/// Triangle across the edge (F(f,k), F(f,k+1)), or -1: (M x 3). Non-manifold edges give -1.
Faces face_neighbours(const Faces& F);

/// Flag per vertex: it lies on an edge with one triangle.
std::vector<bool> boundary_vertices(Eigen::Index vertex_count, const Faces& F);
/// Boundary loops, each in the order of its triangles' half-edges; the longest (by vertex count) first.
/// Throws InvalidInput if a boundary vertex has more than one outgoing boundary edge.
std::vector<std::vector<int>> boundary_loops(const Faces& F);

/// Connected component (by shared vertices) of each vertex; unused vertices get components of their own.
struct Components {
  std::vector<int> vertex_label;
  int count = 0;
};
Components connected_components(Eigen::Index vertex_count, const Faces& F);

/// V - E + F over the vertices in use.
int euler_characteristic(const Faces& F);
int boundary_edge_count(const Faces& F);

}  // namespace facewright
