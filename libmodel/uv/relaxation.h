// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module.

/// Lowers the symmetric Dirichlet energy of a map without flips, sum over triangles of A (s1^2 + s2^2 + 1/s1^2 +
/// 1/s2^2), by moving one vertex after the other along its gradient; the energy is infinite where a triangle would
/// flip, so none does [smith2015]. uv in the units of V. `mirror` (N, or empty): partners move together, uv stays
/// symmetric about u = 0. Stops early when a sweep gains less than 1e-5 of the energy.
TexCoords relaxed(const Vertices& V, const Faces& F, TexCoords uv, const std::vector<int>& mirror, int sweeps);

}  // namespace facewright
