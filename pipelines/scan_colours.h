// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libregister/intake/scan.h"

namespace facewright {

/// The scan's mesh with a colour at every vertex: its own, or its texture's averaged about the vertex. Without either
/// the mesh has none.
Mesh mesh_with_colours(const Scan& scan);

}  // namespace facewright
