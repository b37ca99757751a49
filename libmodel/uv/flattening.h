// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

// Private to this module.

/// Distances over a surface from some of its vertices to all.
struct SurfaceDistances {
  std::vector<int> sources;
  Eigen::MatrixXd D;  ///< (sources x N), mm
};

/// sqrt(sum (|uv_i - uv_j| - d_ij)^2 / sum d_ij^2) over the sources i and vertices j below `count`, after the best
/// uniform scaling of uv.
double geodesic_stress(const TexCoords& uv, const SurfaceDistances& distances, Eigen::Index count);

struct FlatteningProblem {
  const Vertices& V;
  const Faces& F;             ///< of a disc, the triangles that close holes last
  Eigen::Index face_count;    ///< without those
  Eigen::Index vertex_count;  ///< whose distances count
  const std::vector<int>& mirror;
  const std::vector<int>& border;
  const SurfaceDistances& distances;
};

struct FlatteningResult {
  TexCoords uv;
  int iterations = 0;
  std::string stop;  ///< "converged", "iterations used up", "no step lowers the energy"
};

/// Minimises stress^2 + stretch_weight x (area-weighted mean of the symmetric Dirichlet energy), starting from a map
/// without flips whose border does not cross itself, which holds for every iterate: the energy is infinite for a flip
/// [smith2015], and steps that make the border cross itself are refused; a disc with both properties is covered once.
/// The stress is majorised as in [deleeuw1977], the stretch by its convex second derivatives; limited-memory
/// quasi-Newton steps with that as first guess [liu1989]. uv in mm; symmetric about u = 0 if `mirror` is given.
FlatteningResult flatten(const FlatteningProblem& problem, const TexCoords& start, double stretch_weight,
                         int iterations);

}  // namespace facewright
