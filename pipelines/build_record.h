// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>

#include "libmodel/io/manifest.h"
#include "pipelines/build_options.h"
#include "pipelines/build_pipeline.h"
#include "pipelines/output_tree.h"

namespace facewright {

// What a finished build leaves in OUT/outputs.json, so that the next one with `resume` can see that nothing has
// changed: a key of all that the model is made of, the SHA-256 of every file made from it, and the summary's figures.

/// All options of a build that its results depend on, as JSON text.
std::string effective_options(const BuildPipelineOptions& options);

/// SHA-256 of what the gathering of registered scans to a model depends on: version, options, the manifest's words, and
/// per scan the key and hash of its registration, or why there is none.
std::string gather_key(const BuildPipelineOptions& options, const BuildPipelineSummary& summary,
                       const std::map<std::string, ManifestEntry>& entries, const OutputTree& tree);

/// Whether an earlier build of this key has finished and each of its files is there with its hash; then the summary's
/// figures of the model are filled in. O(bytes of the files).
bool build_stands(const std::string& key, const OutputTree& tree, int jobs, BuildPipelineSummary* summary);

/// To be called last.
void write_build_record(const std::string& key, const BuildPipelineSummary& summary, const OutputTree& tree, int jobs);

}  // namespace facewright
