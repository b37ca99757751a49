// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <functional>
#include <vector>

#include "libmodel/core/multires_template.h"
#include "libregister/subdivision/four_eight_mesh.h"

namespace facewright {

/// How badly a base edge wants to be split: larger first. Must not depend on anything but its argument.
using RefinementCriterion = std::function<double(const BaseEdge&)>;

/// length * (1 + bend_weight * |bend|): long edges first, on bent surface sooner. Weight per radian, >= 0.
RefinementCriterion bent_length_criterion(double bend_weight = 2.0);

/// Bisects where the criterion is largest until the mesh has exactly target_vertices. The last few bisections are
/// chosen so that the count is hit; with symmetry an odd number needs a bisection on the midline.
/// O(n log n). Throws InvalidInput if the target is below the present count or cannot be hit.
void refine_to(FourEightMesh& mesh, int target_vertices,
               const RefinementCriterion& criterion = bent_length_criterion());

struct HierarchyOptions {
  RefinementCriterion criterion = bent_length_criterion();
  /// Largest share of the base triangles that may be paired otherwise than greedily so that two uniform steps hit the
  /// first budget; beyond it the first level is refined adaptively too. 0..1 (our choice).
  double max_adjustment = 0.1;
  /// (first budget x 3) positions on which the criterion of the finer levels is evaluated, for example the mean of the
  /// registrations at the first level; empty: the base mesh.
  Vertices first_level_positions;
};

/// The multi-resolution template on a base mesh: levels = base, then one per budget (vertex counts, increasing, hit
/// exactly). The first budget is two uniform 4-8 steps if the number of unpaired triangles allows it (845 -> 3448 needs
/// 148), else adaptive; all others adaptive. V are base positions interpolated along the journal. With an empty mirror
/// the template has an empty mirror table too. Seconds: about 0.1 at 30k vertices. Throws InvalidInput.
MultiresTemplate build_hierarchy(const Mesh& base, const std::vector<int>& mirror, const LandmarkSet& landmarks,
                                 const std::vector<int>& budgets = {3448, 16759, 29587},
                                 const HierarchyOptions& options = {});

/// Vertices of the finest level that belong to a region of the base level: those all of whose parents do. Ascending.
std::vector<int> refine_region(const MultiresTemplate& reference, const std::vector<int>& base_region);

}  // namespace facewright
