// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <functional>
#include <string>

#include "libmodel/building/pca.h"
#include "libmodel/building/procrustes.h"
#include "libmodel/building/sample_store.h"

namespace facewright {

/// fit_pca of the samples on disk: from their kept inner products, centred in memory, and a second pass over blocks of
/// columns for the mean and the basis. Not const, for it completes the products. Memory S^2 + D K doubles, whatever the
/// number of columns times samples: 10,000 scans of 29,587 vertices need below 2 GB.
PcaResult fit_pca(SampleStore& store, const PcaOptions& options = {}, const Progress& progress = {});

/// Moves `shape` (N x 3, its own frame) to the mean of the store by weighted least squares and appends it: the others
/// stay as they are, for one more scan does not move the mean of many. After many, `realign`. An empty store's mean is
/// its origin. Returns how it was moved.
Similarity append_aligned(SampleStore& store, const std::string& id, const Vertices& shape,
                          const Eigen::VectorXd& weights, Scaling scaling = Scaling::fixed, int threads = 0);

/// Of a sample by its id: (N) 0..1, how far each vertex was observed. Called from several threads.
using SampleVisibility = std::function<Eigen::VectorXd(const std::string& id)>;

/// generalised_procrustes of the samples on disk, one pass an iteration and one more that writes the moved rows. Inner
/// products are to be computed anew afterwards. No shapes and no transforms in the result: ask the store. Without
/// `visibility` every vertex counts as observed.
ProcrustesSummary realign(SampleStore& store, const Eigen::VectorXd& weights, const Vertices& reference,
                          const ProcrustesOptions& options = {}, const SampleVisibility& visibility = {},
                          const Progress& progress = {});

}  // namespace facewright
