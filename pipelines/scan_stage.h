// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/multires_template.h"
#include "pipelines/build_options.h"
#include "pipelines/build_pipeline.h"
#include "pipelines/output_tree.h"

namespace facewright {

/// Registers one scan of the folder and writes OUT/registered/ID.ply, OUT/scans/ID.json, ID.origins and ID.colour, or
/// OUT/problematic/ID.txt. Never throws for a bad scan. With `resume` a scan whose key (contents of its files, options,
/// reference, version) is that of an earlier run is left as it is.
ScanOutcome process_scan(const ScanFiles& files, const MultiresTemplate& reference, const AppearanceGuide& guide,
                         const std::string& reference_key, const BuildPipelineOptions& options, const OutputTree& tree);

/// A scan that nothing can be made of: writes OUT/problematic/ID.txt.
ScanOutcome left_out(const ScanFiles& files, const std::string& reason, const OutputTree& tree);

/// The registered scans as they lie on disk, in the order of `ids`.
RegisteredSet read_registered_set(const std::vector<std::string>& ids, const MultiresTemplate& reference,
                                  const OutputTree& tree);

/// The registration's options as JSON text: what a scan's key and build.json hold.
std::string describe_options(const BuildPipelineOptions& options);

}  // namespace facewright
