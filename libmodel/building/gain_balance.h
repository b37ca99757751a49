// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/registered_set.h"

namespace facewright {

/// What differs between scans only by how they were taken. Both take differences of skin tone with them, which no
/// colour alone can tell from light: for sets taken under lights or cameras that differ more than people do.
enum class GainBalance {
  none,
  exposure,  ///< one gain per scan
  channels   ///< a gain per scan and channel: exposure and white balance
};

std::string to_string(GainBalance balance);

struct GainBalanceOptions {
  GainBalance balance = GainBalance::none;
  double darkest = 0.02;      ///< linear RGB; darker values say nothing of a ratio
  double least_weight = 0.5;  ///< 0..1; of visibility, below which a value is not looked at
  int max_iterations = 20;
  double tolerance = 1e-4;  ///< of a gain's logarithm
  int threads = 0;          ///< 0 = all
};

struct GainBalanceResult {
  SampleMatrix colours;   ///< (S x 3N) divided by the gains
  Eigen::MatrixXd gains;  ///< (S x 3); their geometric mean over scans is 1
  int iterations = 0;
  bool converged = true;
};

/// Per scan the gain of each channel over the mean of all: the median over the seen vertices of log(value / mean),
/// which brows, lips or a shadow do not move; the mean is that of the balanced scans, until the gains stand still.
/// `visibility` (S x N) or empty. Throws InvalidInput for sizes that differ. O(iterations S N).
GainBalanceResult balance_gains(SampleMatrix colours, const SampleMatrix& visibility,
                                const GainBalanceOptions& options = {});

}  // namespace facewright
