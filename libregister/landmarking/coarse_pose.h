// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"
#include "libmodel/surface/nearest.h"
#include "libregister/landmarking/nose_candidates.h"

namespace facewright {

/// A face to look for: a mesh in the head frame.
struct FacePattern {
  Vertices V, normals;  ///< (N x 3), of a coarse level
  Dome nose;            ///< its nose, as find_domes() sees it
  PolarDepth depth;     ///< about the nose, +y up
};

/// Throws InvalidInput if no dome is found within 20 mm of `nose_tip`. `fine` is a level whose edges are a few
/// millimetres long, `coarse` what is laid onto scans.
FacePattern face_pattern(const Mesh& fine, const Mesh& coarse, const Eigen::Vector3d& nose_tip);

/// A surface to find faces on.
struct PoseTarget {
  PoseTarget(Mesh surface, Vertices vertex_normals);
  Mesh mesh;         ///< thinned to edges of some 3 mm
  Vertices normals;  ///< (N x 3), of its vertices
  PointIndex index;  ///< of its vertices
};

struct CoarsePose {
  Similarity scan_from_head;
  double score = 0;  ///< 0..1, how much of the pattern lies on the surface
};

struct CoarsePoseOptions {
  int domes = 60;             ///< places compared with the tip of the nose
  int starts = 30;            ///< of their turns, the most alike, from which points are iterated
  double sure = 0.5;          ///< 0..1, score below which starts all over the surface are tried too
  double lowest_scale = 0.8;  ///< scan size over pattern size
  double highest_scale = 1.25;
};

/// Where faces may be on a surface in any orientation, the most face-like first. At every dome the depths around it are
/// compared with those around the pattern's nose, which gives the turn about the nose's axis; iterated closest points
/// [besl1992] from there, for a similarity; poses that end alike are merged. Some 0.3 s.
std::vector<CoarsePose> find_coarse_poses(const FacePattern& pattern, const PoseTarget& target,
                                          const CoarsePoseOptions& options = {});

/// The pose turned so that its x = 0 is the surface's own plane of symmetry, near the plane it has.
CoarsePose straighten(const CoarsePose& pose, const FacePattern& pattern, const PoseTarget& target);

}  // namespace facewright
