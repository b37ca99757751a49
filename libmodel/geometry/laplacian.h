// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/topology.h"

namespace facewright {

/// Cotangent weight of an undirected edge (core/topology.h edges()), half the sum of the opposite cotangents, clamped
/// to [lowest, highest] so that the system stays positive definite on obtuse triangles.
struct CotangentOptions {
  double lowest = 1e-3;  ///< dimensionless; keeps weights positive
  double highest = 10;   ///< dimensionless; tames slivers
};

/// The weight of one edge.
double cotangent_weight(const Vertices& V, const Faces& F, const Edge& edge, const CotangentOptions& options = {});

/// Cotangent stiffness matrix, (N x N), symmetric positive semi-definite, rows sum to zero. [pinkall1993]
Eigen::SparseMatrix<double> cotangent_stiffness(const Vertices& V, const Faces& F,
                                                const CotangentOptions& options = {});
/// The same for edges at hand, edges(F).
Eigen::SparseMatrix<double> cotangent_stiffness(const Vertices& V, const Faces& F, const std::vector<Edge>& edge_list,
                                                const CotangentOptions& options = {});

}  // namespace facewright
