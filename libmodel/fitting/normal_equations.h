// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/fitting/affine_camera.h"
#include "libmodel/fitting/fit_shape.h"
#include "libmodel/fitting/observations.h"

namespace facewright {

/// Whitened rows of the linearised residuals, columns [nuisance | basis | residual]: what least squares is made of. A
/// weight of rank 2 gives two rows, of rank 1 (a point that slides along a line) one, of rank 0 none. Kept from round
/// to round, so that its memory is.
struct WhitenedRows {
  RowMatrix rows;            ///< columns padded with zeros to a multiple of eight
  Eigen::Index count = 0;    ///< leading rows in use
  Eigen::Index columns = 0;  ///< leading columns in use

  auto used() const { return rows.topLeftCorner(count, columns); }
};
void whiten(WhitenedRows& out, const LandmarkShapeModel& model, const std::vector<Observation>& seen,
            const AffineCamera& camera, const std::vector<Information>& W, const Eigen::MatrixXd& nuisance);

/// Lower triangle of rows^T rows.
void gram(Eigen::MatrixXd& out, const WhitenedRows& rows);

/// Takes the first p variables out of the normal equations `G` (lower triangle): what remains in the lower right block
/// is the problem in which they follow to their best values (the Schur complement). A variable without any influence is
/// left out. O(p n^2).
void eliminate(Eigen::MatrixXd& G, Eigen::Index p);

/// H = L D L^T of a positive definite matrix, without pivots: for a few dozen unknowns, where the library's pivoted
/// factorisation costs more than making the matrix. The same bytes on every processor.
class PositiveDefiniteSolver {
 public:
  /// Of the lower triangle of `H`; false if H is not positive definite within 13 digits.
  bool compute(const Eigen::MatrixXd& H);
  Eigen::VectorXd solve(const Eigen::VectorXd& g) const;
  Eigen::MatrixXd inverse() const;

 private:
  Eigen::MatrixXd L_;        ///< columns times their pivots; the diagonal is D
  Eigen::VectorXd inverse_;  ///< of D
};

}  // namespace facewright
