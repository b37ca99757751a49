// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"
#include "libregister/landmarking/face_view.h"

namespace facewright {

/// A reference laid onto a scan by the relief of the whole face.
struct ReliefPose {
  Similarity scan_from_head;
  double height = 1;     ///< of this face over the reference's, between its middle and brows or mouth
  double likeness = -1;  ///< correlation of the reliefs, -1..1: right ones 0.7 and more
  Vertices V;            ///< (N x 3) of the reference in the scan's place, its height included
};

/// Surfaces slide along each other: iterated closest points may leave nose on lip and lip on chin. The relief of a
/// whole face, centimetres wide, has one place only. It is looked for within 40 mm of a pose, seen from the front with
/// the head nodding up to 12 degrees and the face 16 % lower to higher; faces of the reference's height close to the
/// pose are preferred a little. `view`: its field and centre count. A likeness of -1: the scan is not seen there. Some
/// 0.3 s.
ReliefPose lay_by_relief(const Mesh& scan, const Mesh& reference, const Similarity& scan_from_head,
                         const FaceViewOptions& view);

/// How much the relief of the whole face looks like the scan's where it lies (N x 3 vertices in the scan's place,
/// triangles of the reference): the correlation, -1..1; -1 if the scan is not seen there.
double relief_likeness(const Mesh& scan, const Mesh& laid, const Similarity& scan_from_head,
                       const FaceViewOptions& view);

}  // namespace facewright
