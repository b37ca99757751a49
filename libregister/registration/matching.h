// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/surface/nearest.h"
#include "libregister/registration/symmetry_plane.h"

namespace facewright {

/// Why a vertex found no match of its own.
enum class MatchStatus : unsigned char { accepted, too_far, normal_disagrees, on_border, unreliable, not_mutual };
inline constexpr int kMatchStatusCount = 6;

/// Where a deformed reference should go. Rows with weight 0 carry no information; nothing is ever NaN.
struct Correspondence {
  Vertices targets;                  ///< (N x 3) millimetres
  Eigen::VectorXd weights;           ///< (N) 0..1
  std::vector<MatchOrigin> origins;  ///< (N)
  std::vector<MatchStatus> status;   ///< (N) outcome of the vertex's own tests
  Eigen::VectorXd distances;         ///< (N) mm to the nearest surface point

  int count(MatchOrigin origin) const;
};

/// A scan prepared for matching: search tree, reliabilities, normals at several smoothing scales.
class MatchTarget {
 public:
  /// `reliability` (N) 0..1 per scan vertex, see denoise().
  MatchTarget(Mesh scan, Eigen::VectorXd reliability);

  const Mesh& mesh() const { return mesh_; }
  const SurfaceIndex& index() const { return index_; }
  const Eigen::VectorXd& reliability() const { return reliability_; }
  const std::vector<bool>& boundary() const { return boundary_; }
  double mean_edge() const { return mean_edge_; }
  /// Vertex normals averaged over about `length` millimetres, so that a coarse mesh compares with what it can
  /// represent.
  const Vertices& normals(double length) const;

 private:
  Mesh mesh_;
  SurfaceIndex index_;
  Eigen::VectorXd reliability_;
  std::vector<bool> boundary_;
  double mean_edge_;
  std::vector<Vertices> normals_;  // smoothed 0, 1, 4, 16, 64 times
};

struct MatchOptions {
  double highest_distance = 5;        ///< mm, > 0
  double highest_angle = 0.785;       ///< radians between the normals
  double welsch_width = 2;            ///< mm: weight exp(-d^2 / (2 width^2)) [welsch1978]
  double border_distance = 2;         ///< mm: matches nearer than this to the scan's border are refused
  double mutual_rings = 3;            ///< the match's nearest reference vertex must lie within this many edges
  double mirrored_weight = 0.3;       ///< of the twin's weight
  double interpolated_weight = 0.05;  ///< of the mean weight
  bool use_mirror = true;             ///< fall back on the twin's displacement
  bool to_vertices = false;  ///< match to the nearest scan vertex (literal IMDR) instead of the nearest surface point
};

/// Local matching of the deformed reference (V, F) to a scan. Unmatched vertices take their twin's displacement
/// reflected in the reference's current symmetry plane (`mirror`, an involution; empty: none), the rest is filled
/// harmonically from the neighbours. [tena2006], tests after [amberg2007].
Correspondence match_locally(const Vertices& V, const Faces& F, const std::vector<int>& mirror,
                             const MatchTarget& target, const MatchOptions& options = {});

/// Fills the rows where known is false so that the field is harmonic (cotangent weights of V, F); components without
/// any known row become zero. field (N x 3). Throws SolverError if the factorisation fails.
Vertices fill_harmonic(const Vertices& V, const Faces& F, const Vertices& field, const std::vector<bool>& known);

}  // namespace facewright
