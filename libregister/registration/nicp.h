// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libregister/registration/conform.h"
#include "libregister/registration/matching.h"

namespace facewright {

/// Affine transforms of n vertices, stacked, (4n x 3): vertex i goes to its homogeneous position (1 x 4) times rows 4i
/// .. 4i + 3.
using VertexTransforms = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// What the transforms are fitted to with fixed correspondences.
struct NicpData {
  Vertices targets;                       ///< (N x 3)
  Eigen::VectorXd weights;                ///< (N) >= 0
  std::vector<LandmarkTarget> landmarks;  ///< pull in proportion to 1 / stddev^2
  double stiffness = 1;                   ///< alpha, > 0
  double landmark_weight = 0;             ///< beta, >= 0
};

/// The least-squares problem of optimal-step non-rigid ICP [amberg2007] on one template (V, F), in the template's own
/// units:
///   E(X) = alpha^2 sum_ij |(X_i - X_j)' diag(1, 1, 1, gamma)|^2 + sum_i w_i |v_i X_i - u_i|^2 + beta^2 sum_l |v_l X_l
///   - u_l|^2
/// over the edges ij. Transforms are held to the identity by 1e-9, which decides what the data leave open. One symbolic
/// factorisation of the 4N x 4N normal matrix serves every solve.
class NicpSystem {
 public:
  /// gamma > 0 weighs differences of the translations against those of the linear parts. Throws InvalidInput for a
  /// template without triangles.
  NicpSystem(const Vertices& V, const Faces& F, double gamma = 1);
  ~NicpSystem();
  NicpSystem(NicpSystem&&) noexcept;
  NicpSystem& operator=(NicpSystem&&) noexcept;

  /// The minimiser of E. Throws InvalidInput for sizes or weights that do not fit, SolverError.
  VertexTransforms solve(const NicpData& data) const;
  double energy(const VertexTransforms& X, const NicpData& data) const;
  Vertices apply(const VertexTransforms& X) const;  ///< (N x 3)
  VertexTransforms identity() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Defaults are those of the public implementation of menpo3d, for a template scaled to a unit diagonal.
struct NicpOptions {
  std::vector<double> stiffness = {50, 20, 5, 2, 0.8, 0.5, 0.35, 0.2};  ///< alpha per stage, > 0
  std::vector<double> landmark_weights = {5, 2, 0.5, 0, 0, 0, 0, 0};    ///< beta per stage, >= 0; as many
  double gamma = 1;                                                     ///< > 0
  int highest_iterations = 10;                                          ///< per stage, >= 1
  double tolerance = 1e-3;       ///< a stage ends when the transforms change by less, rms
  double highest_distance = 20;  ///< mm, MatchOptions::highest_distance
  double highest_angle = 0.785;  ///< radians, MatchOptions::highest_angle
};

/// One solve of the registration; energies in units of the scaled template.
struct NicpStep {
  double stiffness = 0;
  int matched = 0;                             ///< vertices whose match passed the tests; the others weigh nothing
  double energy_before = 0, energy_after = 0;  ///< for this step's matches: of the last transforms, and of the new ones
};

struct NicpSummary {
  double scale = 1;  ///< scaled template over millimetres
  std::vector<NicpStep> steps;
  bool converged = true;  ///< every stage ended by its tolerance
};

struct NicpResult {
  Vertices V;              ///< (N x 3) mm
  Correspondence matches;  ///< of the last step
  NicpSummary summary;
};

/// Optimal-step non-rigid ICP of a template that lies near the scan, in mm: the baseline that other registrations are
/// compared with. Matches are the nearest surface points that pass the tests of match_locally(), with weight 1. Throws
/// InvalidInput, SolverError. About 0.2 s a solve at 3448 vertices.
NicpResult nicp(const Vertices& V, const Faces& F, const MatchTarget& target,
                const std::vector<LandmarkTarget>& landmarks, const NicpOptions& options = {});

}  // namespace facewright
