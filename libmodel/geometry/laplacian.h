// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/SparseCore>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Cotangent weight of each undirected edge of `edge_list` order (core/topology.h edges()), half the sum of the
/// opposite cotangents, clamped to [lowest, highest] so that the system stays positive definite on obtuse triangles.
struct CotangentOptions {
  double lowest = 1e-3;  ///< dimensionless; keeps weights positive
  double highest = 10;   ///< dimensionless; tames slivers
};

/// Cotangent stiffness matrix, (N x N), symmetric positive semi-definite, rows sum to zero. [pinkall1993]
Eigen::SparseMatrix<double> cotangent_stiffness(const Vertices& V, const Faces& F,
                                                const CotangentOptions& options = {});

}  // namespace facewright
