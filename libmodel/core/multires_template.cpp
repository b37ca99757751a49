// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/multires_template.h"

#include "libmodel/core/errors.h"

namespace facewright {

Eigen::MatrixXd refine_field(const std::vector<VertexParents>& parents, int base_count, const Eigen::MatrixXd& field,
                             int target_count) {
  const int known = static_cast<int>(field.rows());
  if (known < base_count || target_count < known || target_count > base_count + static_cast<int>(parents.size()))
    throw InvalidInput("refine_field: cannot go from " + std::to_string(known) + " to " + std::to_string(target_count) +
                       " vertices in a hierarchy of " + std::to_string(base_count + parents.size()));
  Eigen::MatrixXd fine(target_count, field.cols());
  fine.topRows(known) = field;
  for (int v = known; v < target_count; ++v) {
    const VertexParents& p = parents[static_cast<size_t>(v - base_count)];
    if (p.is_midpoint())
      fine.row(v) = 0.5 * (fine.row(p.a) + fine.row(p.b));
    else
      fine.row(v) = (fine.row(p.a) + fine.row(p.b) + fine.row(p.c)) / 3;
  }
  return fine;
}

Vertices refine_positions(const MultiresTemplate& reference, const Vertices& coarse, int target_count) {
  return refine_field(reference.parents, reference.base_count(), coarse, target_count);
}

}  // namespace facewright
