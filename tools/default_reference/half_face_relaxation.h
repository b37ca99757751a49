// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "tools/default_reference/half_face_mesher.h"

namespace facewright::face_design {

/// 4 sqrt(3) area / sum of squared edges: 1 for an equilateral triangle, 0 for a degenerate one.
double triangle_quality(const Vector3d& a, const Vector3d& b, const Vector3d& c);

/// Moves free points on the surface and flips edges (not the segments) until the triangles are even; then opens
/// sharp folds by moving points other than landmarks up to a millimetre off the surface.
void relax(HalfFaceMesh& mesh, const HalfFaceDesign& design, const WantedLength& wanted);

}  // namespace facewright::face_design
