// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"
#include "libmodel/core/random.h"

namespace facewright {

/// A linear Gaussian model of a 3N vector (interleaved x y z or r g b):
/// instance(c) = mean + basis * diag(sqrt(variances)) * c, with coefficients c ~ N(0, I) in standard deviations
/// (Blanz & Vetter 1999). Shorter coefficient vectors mean zeros for the rest; longer ones throw InvalidInput.
struct PcaModel {
  Eigen::VectorXd mean;       ///< (3N), mm for shapes, linear RGB 0..1 for colours
  Eigen::MatrixXd basis;      ///< (3N x K) orthonormal columns, unless `orthonormal` is false
  Eigen::VectorXd variances;  ///< (K) descending, mm^2 for shapes
  bool orthonormal = true;    ///< false once rows were cut off: coefficients() then solves normal equations

  bool empty() const { return mean.size() == 0; }
  Eigen::Index mode_count() const { return variances.size(); }
  Eigen::Index vertex_count() const { return mean.size() / 3; }

  /// (3N), or its first 3 * `vertices` entries only. The entries are bit-identical whatever `vertices` is: this is what
  /// makes the levels of a multi-resolution model nest. O(3N K).
  Eigen::VectorXd instance(const Eigen::VectorXd& c, Eigen::Index vertices = -1) const;
  /// Least-squares coefficients of x, which holds the whole vector or any number of leading vertices (3n entries,
  /// 3n >= K). Modes of zero variance get 0. coefficients(instance(c)) == c. O(3n K), O(3n K^2) without orthonormality.
  Eigen::VectorXd coefficients(const Eigen::VectorXd& x) const;
  /// The nearest instance to x (same length as x).
  Eigen::VectorXd project(const Eigen::VectorXd& x) const;
  /// K coefficients, each `sigma` times a standard normal.
  Eigen::VectorXd draw_coefficients(Random& random, double sigma = 1) const;

  /// The first k modes.
  PcaModel truncated(Eigen::Index k) const;
  /// The first n vertices: the same coefficients give the leading rows of the same instance. Not orthonormal if n < N.
  PcaModel leading_rows(Eigen::Index n) const;
  /// basis * diag(sqrt(variances)), (3N x K): what eos calls the rescaled basis.
  Eigen::MatrixXd rescaled_basis() const;
  /// The same Gaussian with an orthonormal basis: basis * diag(sqrt(variances)) = U S V^T becomes U, S^2. Coefficients
  /// change to V^T c, their distribution does not. Modes of no variance are dropped.
  PcaModel orthonormalised() const;
};

/// A level of a multi-resolution model with an orthonormal basis and variances of its own, and the way between its
/// coefficients and those that all levels share.
struct OrthonormalLevel {
  PcaModel model;                   ///< orthonormal, K' <= K modes in order of their variance
  Eigen::MatrixXd own_from_shared;  ///< (K' x K) orthonormal rows; K' = K (a rotation) unless a mode vanishes here

  /// Coefficients of `model` for the same face, and back: model.instance(own(c)) == level.instance(c). Of the shared
  /// coefficients that give a face, `shared` returns the likeliest; own(shared(d)) == d, and shared(own(c)) == c where
  /// K' = K. Shorter vectors mean zeros for the rest.
  Eigen::VectorXd own(const Eigen::VectorXd& shared) const;
  Eigen::VectorXd shared(const Eigen::VectorXd& own) const;
};

/// basis * diag(sqrt(variances)) = U S V^T gives basis U, variances S^2 and the map V^T, by QR and the SVD of R: exact
/// to rounding. Modes below 1e-6 of the first's standard deviation are dropped; the largest entry of each mode is
/// positive. The identity for a model that is orthonormal already. O(3N K^2).
OrthonormalLevel orthonormal_level(const PcaModel& level);

/// The (N x 3) view of an interleaved 3N vector, and back.
inline Vertices as_vertices(const Eigen::VectorXd& x) { return Eigen::Map<const Vertices>(x.data(), x.size() / 3, 3); }
inline Eigen::VectorXd as_vector(const Vertices& V) { return Eigen::Map<const Eigen::VectorXd>(V.data(), V.size()); }

/// Throws InvalidInput unless sizes agree, every number is finite and variances are >= 0 and descending.
void validate(const PcaModel& model);

}  // namespace facewright
