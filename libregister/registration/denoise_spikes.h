// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libregister/registration/denoise.h"
#include "libregister/registration/denoise_graph.h"

namespace facewright {

/// Unit normals (N x 3) that spikes hardly tilt: triangles weigh by the inverse square of their longest side, and
/// every vertex averages over two rings.
Vertices sturdy_normals(const Vertices& V, const Faces& F, const ScanGraph& graph);

/// Spikes, alone or in clusters: small groups of vertices that float off the surface around them. Returns a flag per
/// vertex. `noise` and `mean_edge` in mm.
std::vector<char> find_spikes(const Vertices& V, const Vertices& normals, const ScanGraph& graph, double noise,
                              double mean_edge, const DenoiseOptions& options);

/// Finds spikes and puts them onto a quadric through the skin around them, along the normal, until no more are found.
/// Returns the flags of the moved vertices.
std::vector<char> mend_spikes(Vertices& V, const Faces& F, const ScanGraph& graph, double noise, double mean_edge,
                              const DenoiseOptions& options);

}  // namespace facewright
