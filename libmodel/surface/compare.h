// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"

namespace facewright {

/// What may move when one surface is laid onto another before they are compared.
enum class SurfaceAlignment {
  none,        ///< compare where they are
  rigid,       ///< rotation and shift
  similarity,  ///< and scale: the usual choice for shapes from one image, which shows no absolute size
};

struct CompareOptions {
  SurfaceAlignment alignment = SurfaceAlignment::rigid;
  Similarity start = {};    ///< target_from_source to begin with, e.g. from landmarks
  int max_iterations = 50;  ///< 1 and more; ten to twenty are usual
  int max_points = 8000;    ///< source vertices used to align, evenly strided; distances are taken at all
  int threads = 0;          ///< 0 = all
};

struct CompareSummary {
  int iterations = 0;
  bool converged = false;     ///< the last step moved points by less than a thousandth of a millimetre
  Eigen::Index compared = 0;  ///< vertices with a place on the target, borders left out
  double mean = 0, rms = 0;   ///< distances in millimetres, over the compared vertices
  double median = 0, p95 = 0, max = 0;
};

struct CompareResult {
  Similarity target_from_source;
  Eigen::VectorXd distances;  ///< (N) of every source vertex to the target's surface, millimetres of the target; -1
                              ///< where the nearest place is the target's border (a hole, the end of the scan)
  CompareSummary summary;
};

/// Distances of the source's vertices to the target's surface, after aligning the two by robust point-to-plane
/// iterations [chen1992] (Tukey weights, places on the target's border left out).
/// Throws InvalidInput for empty meshes or when hardly any vertex finds a place on the target.
/// Cost: one nearest-point search per vertex and iteration, about 10 microseconds each.
CompareResult compare_surfaces(const Mesh& source, const Mesh& target, const CompareOptions& options = {});

}  // namespace facewright
