// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

struct CanonicalMeshOptions {
  double fine_spacing = 1.1;    ///< mm, about eyes, nose and mouth; 0.5 .. 4
  double coarse_spacing = 3.6;  ///< mm, at the back of the head; fine_spacing .. 8
  int threads = 0;              ///< 0 = all; the mesh does not depend on it
};

/// The mean head as a mesh, without colours: exactly symmetric, manifold, open only at the neck.
struct CanonicalMesh {
  Mesh mesh;
  std::vector<int> mirror;  ///< (N) the left-right partner of each vertex, itself on the midline
};

/// Surface nets [gibson1998] on a graded grid, vertices projected to the zero set. About a second.
/// Throws InvalidInput for spacings out of range.
CanonicalMesh extract_mean_head(const CanonicalMeshOptions& options = {});

}  // namespace facewright
