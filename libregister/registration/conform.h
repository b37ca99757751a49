// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libregister/registration/matching.h"
#include "libregister/registration/seam.h"

namespace facewright {

/// A landmark's pull on a reference vertex.
struct LandmarkTarget {
  int vertex = -1;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< mm
  double stddev = 1;                                   ///< mm, > 0
};

struct ConformOptions {
  double smoothing_length = 2;   ///< mm, > 0: displacements vary smoothly over about this distance
  double landmark_weight = 0.3;  ///< >= 0: pull of a landmark of 1 mm deviation, in units of one matched vertex
  double seam_weight = 10;       ///< >= 0: hold of the stitches, in units of one matched vertex
  double seam_gap = 0.1;         ///< mm, >= 0: a stitch is content with this gap; closed lips of scans touch
  double rest_weight = 1e-3;     ///< >= 0: pull of the rest shape, keeps vertices without any data in place
  int fold_rounds = 4;           ///< how often stiffness is raised about new folds before they are left to unfold()
  double fold_stiffness = 4;     ///< > 1: factor on the squared smoothing length about a fold, per round
};

struct ConformSummary {
  double energy_before = 0, energy_after = 0;  ///< of the rest shape and of the solution, mm^4
  double largest_motion = 0;                   ///< mm
  int fold_rounds = 0;
  int folds = 0;  ///< folded edges left
};

struct ConformResult {
  Vertices V;  ///< (N x 3) mm
  ConformSummary summary;
};

/// What conforming one mesh again and again has in common: its edges and the order in which the system is eliminated.
/// Results are the same with and without; one per thread.
class ConformWorkspace {
 public:
  ConformWorkspace();
  ~ConformWorkspace();
  ConformWorkspace(ConformWorkspace&&) noexcept;
  ConformWorkspace& operator=(ConformWorkspace&&) noexcept;

  struct State;
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

/// Energy-minimising conformation of the rest shape (V, F) to its matches. Over displacements u,
///   E(u) = sum_i w_i A_i |x_i + u_i - q_i|^2 + l^2 sum_ij c_ij |u_i - u_j|^2 + g A sum_k |x_k + u_k - b_k|^2 / s_k^2
///          + h A sum_s |gap_s(x + u) - d_s|^2
/// with vertex areas A_i, mean area A, cotangent weights c_ij and the stitches' gaps d_s, at most seam_gap long: one
/// sparse N x N factorisation, three right-hand sides. Where the solution folds, stiffness is raised locally and the
/// system solved again. Throws SolverError.
ConformResult conform(const Vertices& V, const Faces& F, const Correspondence& matches,
                      const std::vector<LandmarkTarget>& landmarks, const ConformOptions& options = {},
                      const std::vector<Stitch>& stitches = {}, ConformWorkspace* workspace = nullptr);

/// Smooths the surroundings of folded edges until none is left or `rounds` are spent; returns the folds that remain.
int unfold(Vertices& V, const Faces& F, int rounds = 40);

}  // namespace facewright
