// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/registered_set.h"

namespace facewright {

struct FillUnseenOptions {
  double min_visibility = 0.5;  ///< 0..1; entries below count as unseen
  int modes = 20;               ///< of the model that fills; capped by a third of the samples
  int max_iterations = 20;
  double tolerance = 1e-4;  ///< stop when filled values change by less than this (root mean square)
  int threads = 0;          ///< 0 = all
};

struct FillUnseenSummary {
  double filled_share = 0;        ///< of all (sample, vertex) pairs
  double worst_sample_share = 0;  ///< largest share of one sample that was filled
  int worst_sample = -1;
  int never_seen = 0;  ///< vertices that no sample saw: they keep the given values
  int iterations = 0;
  bool converged = true;
  double last_change = 0;
  FillUnseenOptions options;
};

struct FillUnseenResult {
  SampleMatrix values;  ///< (S x 3N) seen entries unchanged
  FillUnseenSummary summary;
};

/// Completes samples whose vertices were partly unseen (colours of occluded skin) from the statistics of the seen ones:
/// probabilistic PCA with missing data, alternating between a model of all samples and, per sample, the posterior mean
/// of the unseen given the seen [roweis1998]. `visibility` is (S x N). Unseen values never enter as if they were
/// measured, and are not simply the mean. O(iterations S N modes^2).
FillUnseenResult fill_unseen(SampleMatrix values, const SampleMatrix& visibility,
                             const FillUnseenOptions& options = {});

}  // namespace facewright
