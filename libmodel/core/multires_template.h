// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// How one vertex came to be: the midpoint of an edge (c == -1) or the centre of a triangle.
struct VertexParents {
  int a = -1, b = -1, c = -1;
  bool is_midpoint() const { return c < 0; }
};

/// One resolution level: its first `vertex_count` vertices of the finest level, and its own triangles.
struct TemplateLevel {
  int vertex_count = 0;
  Faces F;  ///< (M x 3)
};

/// The reference face with its 4-8 hierarchy. levels[0] is the base mesh (845 vertices by default); every vertex of a
/// level is in every finer level at the same index, so that going down is truncation.
struct MultiresTemplate {
  Vertices V;                          ///< (N x 3) of the finest level, head frame, millimetres
  std::vector<TemplateLevel> levels;   ///< coarse to fine; levels.back().vertex_count == V.rows()
  std::vector<VertexParents> parents;  ///< (N - levels[0].vertex_count): of vertex levels[0].vertex_count + i
  std::vector<int> mirror;  ///< (N) the left-right partner of each vertex, an involution; itself on the midline
  LandmarkSet landmarks;    ///< marked on the base level; all are vertices in the built-in reference
  std::map<std::string, std::vector<int>>
      regions;  ///< vertex indices per named region ("left_eye", "lips", "rim", ...)

  int base_count() const { return levels.empty() ? 0 : levels.front().vertex_count; }
  /// The mesh of level l (a copy): rows [0, n_l) of V and the level's triangles.
  Mesh level_mesh(int l) const {
    Mesh mesh;
    mesh.V = V.topRows(levels.at(static_cast<size_t>(l)).vertex_count);
    mesh.F = levels[static_cast<size_t>(l)].F;
    return mesh;
  }
};

/// Carries a per-vertex field (n x D rows, n = vertices known so far) up to `target_count` vertices along the journal:
/// midpoints are averages of two rows, centres of three.
Eigen::MatrixXd refine_field(const std::vector<VertexParents>& parents, int base_count, const Eigen::MatrixXd& field,
                             int target_count);
Vertices refine_positions(const MultiresTemplate& reference, const Vertices& coarse, int target_count);

}  // namespace facewright
