// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/building/build_model.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/registered_set.h"
#include "pipelines/output_tree.h"

namespace facewright {

/// How registered scans are gathered to a model: all in memory, or through the disk with some of them at hand.
struct GatherPlan {
  bool on_disk = false;
  int at_hand =
      0;  ///< scans in memory at once: those that unseen colours are learnt from, and that the report measures
};

/// For `scans` of `vertices`. `gigabytes`: the limit (10^9 bytes), or 0 for none. A plan depends on these alone. Throws
/// InvalidInput, with what would do, if the limit is too small, or if there is none and this machine's memory is.
GatherPlan plan_gathering(int scans, Eigen::Index vertices, double gigabytes);

/// Jobs that register or landmark scans of up to `bytes` each within the limit, at least one. What a job needs was
/// measured (docs/large-builds.md).
int jobs_within(double gigabytes, std::uintmax_t bytes, int jobs);

/// build_model() of scans registered in `tree` through files in OUT/gathering, which are removed afterwards: 24 bytes
/// per vertex and scan on disk. Unseen colours are learnt from `plan.at_hand` scans and filled in all. The rows of the
/// result count the `ids`. Throws InvalidInput for a gain balance, which needs all scans at once.
BuildModelResult build_stored_model(const std::vector<std::string>& ids, const MultiresTemplate& reference,
                                    const BuildModelOptions& options, const GatherPlan& plan, const OutputTree& tree);

}  // namespace facewright
