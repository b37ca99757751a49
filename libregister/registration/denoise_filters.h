// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libregister/registration/denoise.h"
#include "libregister/registration/denoise_graph.h"

namespace facewright {

/// Each filter returns new positions (N x 3). Only smooth_borders moves border vertices. `noise` and `mean_edge` in mm.

/// Every inner vertex onto a quadric through its neighbourhood, along its normal. The window grows ring by ring, from
/// two to `widest`, as long as its quadric agrees with the narrower ones [goldenshluger1997] and leaves residuals that
/// noise alone explains.
Vertices project_on_quadrics(const Vertices& V, const Faces& F, const ScanGraph& graph, double noise, double mean_edge,
                             const DenoiseOptions& options);

/// Every inner vertex to the median height of its two rings, along its normal.
Vertices median_heights(const Vertices& V, const Faces& F, const ScanGraph& graph);

/// Normals of the triangles filtered bilaterally [zheng2011], then vertices moved to fit them [sun2007].
Vertices bilateral_normals(const Vertices& V, const Faces& F, const ScanGraph& graph, double noise, double mean_edge,
                           const DenoiseOptions& options);

/// Border vertices along their normal, half way to the chord of their two neighbours on the border, if that is within
/// three noise deviations; the others stay.
Vertices smooth_borders(const Vertices& V, const Faces& F, const ScanGraph& graph, double noise);

}  // namespace facewright
