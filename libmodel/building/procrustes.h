// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/registered_set.h"
#include "libmodel/core/similarity.h"

namespace facewright {

struct ProcrustesOptions {
  Scaling scaling = Scaling::fixed;  ///< fixed keeps the size of a head in the shape model [huber2016]
  double unseen_weight = 0.2;        ///< 0 < weight <= 1; of a vertex no camera saw, whose place is a guess [gower1975]
  int max_iterations = 100;
  double tolerance = 1e-6;  ///< mm; largest move of a mean vertex in an iteration at which to stop
  int threads = 0;          ///< 0 = all
};

struct ProcrustesSummary {
  int iterations = 0;
  bool converged = false;
  double last_change = 0;   ///< mm, of the mean
  double rms = 0;           ///< mm, root mean square distance of a vertex to the mean's, weighted
  double unseen_share = 0;  ///< 0..1, of the weight of all scans that `unseen_weight` applied to
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
/// centroid size of the scans. One shape gives itself, moved to the reference. `visibility` (S x N) 0..1, or empty:
/// the weight of vertex v of scan i becomes weights[v] * (u + (1 - u) visibility(i, v)) with u = unseen_weight, in the
/// motions and in the mean they aim at; the mean returned is the plain one. Throws InvalidInput for no shapes, sizes
/// that differ, or NaN. O(iterations S N), in parallel over scans.
ProcrustesResult generalised_procrustes(SampleMatrix shapes, const Eigen::VectorXd& weights, const Vertices& reference,
                                        const ProcrustesOptions& options = {}, const SampleMatrix& visibility = {});

/// The mean that shapes are moved to, in the frame of the reference; with Scaling::free, of the given centroid size.
class ProcrustesTarget {
 public:
  ProcrustesTarget(const Vertices& reference, const Eigen::VectorXd& weights, Scaling scaling, double size);
  const Vertices& mean() const { return mean_; }
  /// Takes the mean of the moved shapes, pins its frame and size, and returns how far a vertex moved at most, mm.
  double move_to(Vertices mean);

 private:
  Vertices reference_, mean_;
  Eigen::VectorXd weights_;
  Scaling scaling_;
  double size_;
};

/// Weighted root mean square distance to the weighted centroid, mm.
double centroid_size(const Vertices& V, const Eigen::VectorXd& weights);

}  // namespace facewright
