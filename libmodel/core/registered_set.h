// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Rows are interleaved x y z (or r g b) of one scan: (S x 3N).
using SampleMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Scans in correspondence: what registration produces and model building consumes.
struct RegisteredSet {
  std::vector<std::string> ids;  ///< (S)
  SampleMatrix shapes;           ///< (S x 3N) millimetres, each scan in its own frame
  SampleMatrix colours;          ///< (S x 3N) linear RGB, or (0 x 0)
  SampleMatrix visibility;       ///< (S x N) 0..1: how far the shape of a vertex was observed; or (0 x 0)
  SampleMatrix colour_weights;   ///< (S x N) 0..1: how far its colour can be trusted; a scan without colours has zeros;
                                 ///< (0 x 0): `visibility`

  Eigen::Index scan_count() const { return shapes.rows(); }
  Eigen::Index vertex_count() const { return shapes.cols() / 3; }
  Vertices vertices(Eigen::Index scan) const {
    return Eigen::Map<const Vertices>(shapes.row(scan).data(), vertex_count(), 3);
  }
};

/// Origin of a vertex's target in local matching.
enum class MatchOrigin : unsigned char { free, matched, mirrored, interpolated };

}  // namespace facewright
