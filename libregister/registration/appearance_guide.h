// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/multires_template.h"
#include "libregister/registration/appearance.h"
#include "libregister/registration/matching.h"

namespace facewright {

struct AppearanceGuideOptions {
  double spacing = 5;            ///< mm, least distance of control points
  double window = 3;             ///< mm, deviation of the Gaussian window about each
  int highest_count = 200;       ///< control points
  double least_deviation = 0.3;  ///< mm: no control point is believed to be more precise
  double highest_deviation = 2;  ///< mm: directions in which colour tells less are left out
  double farthest_step = 2.5;    ///< mm, per observation
  double independent_area = 4;   ///< mm^2: colours nearer to each other tell the same
  double feature_floor = 0.05;   ///< deviation of a feature that is always expected
};

/// Where a control point should go, along one direction.
struct GuideObservation {
  int vertex = -1;            ///< of the reference
  Eigen::Vector3d direction;  ///< unit length, the scan's frame
  double value = 0;           ///< mm: direction . place, the scan's frame
  double stddev = 1;          ///< mm
};

/// Finds, from colours, where places of the reference lie on a scan: Lucas and Kanade's registration [lucas1981] of the
/// mean appearance along the surface, at control points where it has structure, weighted by how much people differ.
class AppearanceGuide {
 public:
  AppearanceGuide() = default;
  AppearanceGuide(const MultiresTemplate& reference, const FaceAppearance& appearance,
                  const AppearanceGuideOptions& options = {});

  bool empty() const { return controls_.empty(); }
  int level() const { return space_ ? space_->level() : 0; }
  int vertex_count() const { return space_ ? space_->vertex_count() : 0; }
  const std::vector<int>& control_vertices() const { return controls_; }
  /// V (vertex_count() x 3): the deformed reference, in rough correspondence with a scan that has vertex colours.
  std::vector<GuideObservation> observe(const Vertices& V, const MatchTarget& target) const;

 private:
  std::shared_ptr<const AppearanceSpace> space_;
  FaceAppearance appearance_;
  AppearanceGuideOptions options_;
  Faces F_;
  std::vector<int> controls_;                               // vertices
  std::vector<std::vector<std::pair<int, double>>> parts_;  // per control: (vertex, share of it)
  std::vector<bool> needed_;                                // vertices whose colours are looked up
};

/// Colours of a scan at the places nearest to V; not seen where the scan is farther than 1.5 mm, at its border, or
/// `needed` is false (empty: all are needed). `nearest` (N x 3), if given, receives the places.
AppearanceSample sample_appearance(const Vertices& V, const MatchTarget& target, const std::vector<bool>& needed = {},
                                   Vertices* nearest = nullptr);

}  // namespace facewright
