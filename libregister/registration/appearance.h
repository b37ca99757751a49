// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <memory>
#include <vector>

#include "libmodel/core/multires_template.h"

namespace facewright {

/// What colour tells of the place on a face, whoever it is: brows, lips and lids. Per vertex the luminance relative to
/// the face's own skin, and the logarithms of red over blue and red over green [finlayson2001], each less its own mean
/// over some 15 mm: neither the tone of a skin nor the light nor a flush remain.
inline constexpr int kAppearanceFeatures = 3;
using AppearanceFeatures = Eigen::Matrix<double, Eigen::Dynamic, kAppearanceFeatures>;

struct AppearanceSample {
  Colours colours;         ///< (N x 3) linear RGB at the vertices of the level
  std::vector<bool> seen;  ///< (N) false: the colour is not known there
};

/// Turns colours at the vertices of one level of a reference into features. Safe from several threads.
class AppearanceSpace {
 public:
  /// The level is the coarsest with edges of 2 mm or less (brows are 5 to 10 mm wide), else the finest.
  explicit AppearanceSpace(const MultiresTemplate& reference);

  int level() const { return level_; }
  int vertex_count() const { return vertex_count_; }
  /// Means are taken over the vertices of this coarser level only; the others need colours only where features are
  /// wanted.
  int mean_count() const { return mean_count_; }
  AppearanceFeatures features(const AppearanceSample& sample) const;

 private:
  int level_ = 0, vertex_count_ = 0, mean_count_ = 0, base_count_ = 0;
  std::vector<VertexParents> parents_;
  Eigen::VectorXd areas_;
  std::shared_ptr<const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> smoother_;
};

/// The features of several people in rough correspondence.
struct FaceAppearance {
  AppearanceFeatures mean;       ///< (N x 3) median over the people; empty: nothing is known
  AppearanceFeatures deviation;  ///< (N x 3) root mean square about it, +inf where fewer than three people show it
  bool empty() const { return mean.rows() == 0; }
};

FaceAppearance learn_appearance(const std::vector<AppearanceFeatures>& features,
                                const std::vector<std::vector<bool>>& seen);

}  // namespace facewright
