// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/registered_set.h"
#include "libmodel/core/similarity.h"

namespace facewright {

struct ProcrustesOptions {
  Scaling scaling = Scaling::fixed;  ///< fixed keeps the size of a head in the shape model [huber2016]
  int max_iterations = 100;
  double tolerance = 1e-6;  ///< mm; largest move of a mean vertex in an iteration at which to stop
  int threads = 0;          ///< 0 = all
};

struct ProcrustesSummary {
  int iterations = 0;
  bool converged = false;
  double last_change = 0;  ///< mm, of the mean
  double rms = 0;          ///< mm, root mean square distance of a vertex to the mean's, weighted
  ProcrustesOptions options;
};

struct ProcrustesResult {
  SampleMatrix shapes;                      ///< (S x 3N) aligned
  Vertices mean;                            ///< (N x 3)
  std::vector<Similarity> mean_from_scans;  ///< (S) what was applied to each scan
  ProcrustesSummary summary;
};

/// Generalised Procrustes analysis [gower1975]: moves (and with Scaling::free resizes) every shape to the mean of all,
/// until the mean stands still. `weights` (N) >= 0 per vertex; `reference` (N x 3) sets the pose of the mean (its rigid
/// frame), so that the result does not depend on the frames of the scans. With Scaling::free the mean keeps the average
/// centroid size of the scans. One shape gives itself, moved to the reference. Throws InvalidInput for no shapes, sizes
/// that differ, or NaN. O(iterations S N), in parallel over scans.
ProcrustesResult generalised_procrustes(SampleMatrix shapes, const Eigen::VectorXd& weights, const Vertices& reference,
                                        const ProcrustesOptions& options = {});

}  // namespace facewright
