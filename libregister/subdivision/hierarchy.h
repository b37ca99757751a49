// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/multires_template.h"
#include "libregister/subdivision/refinement.h"

namespace facewright {

struct HierarchyOptions {
  RefinementCriterion criterion = bent_length_criterion();
  /// Largest share of the base triangles that may be paired otherwise than greedily so that two uniform steps hit the
  /// first budget; beyond it the first level is refined adaptively too. 0..1 (our choice).
  double max_adjustment = 0.1;
  /// (first budget x 3) positions on which the criterion of the finer levels is evaluated, for example the mean of the
  /// registrations at the first level; empty: the base mesh.
  Vertices first_level_positions;
  /// Wanted boundary edges per budget, -1: as they come. Empty: surrey_boundary_edges() where budgets and base mesh are
  /// those of the Surrey preset, else as they come. Adaptive levels only.
  std::vector<int> boundary_edges;
};

/// The vertex budgets of the released Surrey Face Model [huber2016], made nested.
inline const std::vector<int> kSurreyLevels = {3448, 16759, 29587};

/// Throws InvalidInput unless the vertex budgets increase from the base mesh's count on.
void check_budgets(int base_count, const std::vector<int>& budgets);

/// Boundary edges of those levels on a base mesh with 80: -1 (two uniform steps double them), 307 and 411 without
/// symmetry, which makes 33211 and 58763 triangles, and with symmetry, where they come in pairs, 306 and 410.
std::vector<int> surrey_boundary_edges(bool symmetric);

/// The mesh after the first 4-8 step. The pairing is adjusted, if HierarchyOptions::max_adjustment allows, so that a
/// uniform step will give first_budget vertices. Throws InvalidInput if it has more than first_budget already.
FourEightMesh tri_quad_mesh(const Mesh& base, const std::vector<int>& mirror, int first_budget,
                            double max_adjustment = 0.1);

/// As build_hierarchy, with uniform steps only: levels = base, then one after each number of further 4-8 steps (>= 1).
/// It begins with the pairing for first_budget, so that every vertex of an adaptive hierarchy with that first budget is
/// one of its own, if it has been refined often enough.
MultiresTemplate uniform_hierarchy(const Mesh& base, const std::vector<int>& mirror, const LandmarkSet& landmarks,
                                   int first_budget, const std::vector<int>& steps = {2, 2, 2});

/// The multi-resolution template on a base mesh: levels = base, then one per budget (vertex counts, increasing, hit
/// exactly). The first budget is two uniform 4-8 steps if the number of unpaired triangles allows it (845 -> 3448 needs
/// 148), else adaptive; all others adaptive. V are base positions interpolated along the journal. With an empty mirror
/// the template has an empty mirror table too. Seconds: about 0.1 at 30k vertices. Throws InvalidInput.
MultiresTemplate build_hierarchy(const Mesh& base, const std::vector<int>& mirror, const LandmarkSet& landmarks,
                                 const std::vector<int>& budgets = kSurreyLevels, const HierarchyOptions& options = {});

/// Vertices of the finest level that belong to a region of the base level: those all of whose parents do. Ascending.
std::vector<int> refine_region(const MultiresTemplate& reference, const std::vector<int>& base_region);

}  // namespace facewright
