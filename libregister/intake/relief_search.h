// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: where in a surface of unknown pose something has the relief of a face.
#pragma once

#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"

namespace facewright {

/// A place and pose where the depth map agrees with the face's.
struct ReliefMatch {
  Similarity scan_from_face;  ///< scale 1
  double misfit = 0;          ///< mm: standard deviation of the depth differences, a tilt allowed for
};

/// Depth map of a face as seen from the front, in square cells.
struct FaceRelief {
  struct Cell {
    int column, row;  ///< of the cell, from the lowest
    double depth;     ///< mm
  };
  std::vector<Cell> cells;
  int columns = 0, rows = 0;
  double left = 0, bottom = 0;  ///< mm, the corner of cell (0, 0)
  double cell = 10;             ///< mm
};

/// Of a face in the head frame, from points on it.
FaceRelief face_relief(const Vertices& face_points, double cell);

/// Looks at the points (n x 3), millimetres, from 12 directions with 12 rolls each and lays the face's relief
/// everywhere on what it sees. The best place of each view; of these the best, at most `count`, no two within 25
/// degrees and 30 mm of each other. Some 0.3 s on one thread for a head.
std::vector<ReliefMatch> search_relief(const FaceRelief& face, const Vertices& points, int count, int threads);

}  // namespace facewright
