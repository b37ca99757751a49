// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/topology.h"

namespace facewright {

// Private to this module: what neighbours on a surface say about an unseen residual.

/// Gaussian fields on a mesh whose correlation falls off within `length` millimetres (Matern, smoothness 1), by the
/// sparse precision (k^2 C + G) C^-1 (k^2 C + G) / (4 pi k^2), k = 1 / length, C the lumped mass and G the cotangent
/// stiffness; unit variance. [lindgren2011]
class ResidualField {
 public:
  /// Throws InvalidInput for a length that is not positive.
  ResidualField(const Vertices& V, const Faces& F, double length);

  /// Correlation of `residual` (N x 3) along edges, and its weight: products are summed with both ends' weights.
  struct Correlation {
    double product = 0, square = 0;
    double value() const { return square > 0 ? product / square : 0; }
    Correlation& operator+=(const Correlation& other) {
      product += other.product;
      square += other.square;
      return *this;
    }
  };
  Correlation along_edges(const Vertices& residual, const Eigen::VectorXd& weights) const;

  /// Posterior mean of the field, (N x 3), at vertices of weight below 1, zero elsewhere. `residual` is known up to
  /// noise of variance nugget / weight. The field is solved for on those vertices and what lies within about two
  /// lengths. Throws SolverError.
  Vertices expect(const Vertices& residual, const Eigen::VectorXd& weights, double nugget) const;

  /// Rows of X (N x D) where known is false: harmonic between the known ones; components without any keep theirs.
  void fill_harmonically(Eigen::Ref<Eigen::MatrixXd> X, const std::vector<bool>& known) const;
  /// Mean square of X's rows (N x D) about the mean of their neighbours, (D), over the known whose neighbours all are.
  Eigen::RowVectorXd spread_about_neighbours(const Eigen::MatrixXd& X, const std::vector<bool>& known) const;

 private:
  std::vector<int> surroundings(const Eigen::VectorXd& weights) const;

  Adjacency ring_;
  int reach_;  // edges
  Eigen::SparseMatrix<double> stiffness_, precision_;
};

}  // namespace facewright
