// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/building/gram.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/model/pca_model.h"

namespace facewright {

enum class PcaSolver {
  automatic,  ///< gram up to 400 samples, lanczos above
  gram,       ///< all eigenpairs of the Gram matrix: exact, O(S^3)
  lanczos,    ///< its leading pairs only, by implicitly restarted Lanczos; gram where they are not few
  randomised  ///< without the Gram matrix: random subspace iteration [halko2011], memory O(S K); gram likewise
};

struct PcaOptions {
  double variance_share = 0.99;  ///< (0, 1]; keep the fewest modes that explain this share [huber2016]
  int max_modes = -1;            ///< -1 = as many as the share needs
  PcaSolver solver = PcaSolver::automatic;
  int power_iterations = 2;  ///< 2 .. 10, of `randomised`: the least number; more while the modes still turn
  int threads = 0;           ///< 0 = all
};

struct PcaSummary {
  int scan_count = 0;
  int rank = 0;               ///< modes with variance; at most scan_count - 1. A lower bound unless solver is `gram`
  int mode_count = 0;         ///< modes kept
  double total_variance = 0;  ///< trace of the covariance
  double kept_variance = 0;   ///< sum of the kept variances
  PcaSolver solver = PcaSolver::automatic;  ///< the one that answered; `automatic` where there was nothing to solve
  int iterations = 0;                       ///< restarts of lanczos, power iterations of randomised
  double residual = 0;  ///< of randomised: largest |G q - l q| / l_1 of a kept mode; above 1e-8 take another solver
  PcaOptions options;
};

struct PcaResult {
  PcaModel model;
  Eigen::MatrixXd scores;  ///< (S x K) coefficients of the samples, in standard deviations
  PcaSummary summary;
};

/// Principal component analysis of the rows of X (S x D), covariance with 1/(S - 1), by the S x S Gram matrix in double
/// precision (Sirovich's method of snapshots) or a random subspace. The basis is orthonormal to rounding, the largest
/// entry of every vector is positive, ties going to the lowest index. Modes below 1e-12 of the first, or below rounding
/// of the data, do not exist: duplicates and single samples give fewer modes, never NaN. Throws InvalidInput for no
/// rows, NaN, or options out of range. O(S^2 D + S^3), memory S^2 besides X and the basis; the same bytes for any
/// number of threads.
PcaResult fit_pca(const SampleMatrix& X, const PcaOptions& options = {});

}  // namespace facewright
