// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/similarity.h"

namespace facewright {

/// The first `count` levels of a reference.
MultiresTemplate coarse_levels(const MultiresTemplate& reference, int count);

/// The reference's vertices (N x 3) in the scan's place: the global mapping by a few landmarks [bookstein1989].
struct BentTemplate {
  Vertices V;
  Similarity scan_from_head;
};
BentTemplate bend_template(const Vertices& reference, const MultiresTemplate& coarse, const Landmarks& landmarks);

struct TemplateReading {
  Landmarks landmarks;  ///< all of the reference's, on the registered template
  Similarity scan_from_head;
  std::vector<std::string> dropped;
  double leave_one_out_rms = 0;
  double landmark_noise = 0;  ///< mm, of the landmarks given
  double matched = 0;         ///< share of the vertices that found the surface
};

/// Registers a coarse reference to the scan from a few landmarks and reads all of its own off. Consistent errors of the
/// landmarks stay, what contradicts the surface and the others goes. Throws InvalidInput where register_scan does.
TemplateReading read_off_template(const Mesh& scan, const Landmarks& landmarks, const MultiresTemplate& coarse);

}  // namespace facewright
