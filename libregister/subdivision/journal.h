// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/multires_template.h"

namespace facewright {

/// The refinement journal of a 4-8 mesh: what every vertex above the base was made from, in order. Together with the
/// base mesh it is the whole hierarchy: positions, triangles and symmetry of every state follow from it.
struct RefinementJournal {
  int base_count = 0;                  ///< vertices of the base mesh
  std::vector<VertexParents> parents;  ///< of vertex base_count + i

  int vertex_count() const { return base_count + static_cast<int>(parents.size()); }
};

RefinementJournal journal_of(const MultiresTemplate& reference);

/// A field on the first field.rows() vertices (n x D: positions, colours, texture coordinates, rows of a basis) carried
/// up to `vertices`: midpoints are means of two rows, centres of three; the rows given stay as they are. Throws
/// InvalidInput unless base_count <= n <= vertices <= vertex_count().
Eigen::MatrixXd carry_up(const RefinementJournal& journal, const Eigen::MatrixXd& field, int vertices);

/// The field on the first `vertices` vertices: its first rows. truncate_to(carry_up(f, m), f.rows()) is f to the bit.
/// Throws InvalidInput unless base_count <= vertices <= field.rows() <= vertex_count().
Eigen::MatrixXd truncate_to(const RefinementJournal& journal, const Eigen::MatrixXd& field, int vertices);

/// Replays the journal on the base mesh: the hierarchy whose levels are the states at these vertex counts (increasing,
/// from the base to the end; each the end of a bisection, its mirror image included). The triangles are those of the
/// mesh that wrote the journal, in its order; the positions are base.V carried up. Throws InvalidInput if the journal
/// is not one of this base mesh.
MultiresTemplate replay(const RefinementJournal& journal, const Mesh& base, const std::vector<int>& mirror,
                        const LandmarkSet& landmarks, const std::vector<int>& level_counts);

}  // namespace facewright
