// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "libmodel/core/random.h"

namespace facewright {

/// Colours of a person, all linear RGB in 0..1; amounts in 0..1.
struct Appearance {
  Eigen::Vector3d skin{0.47, 0.27, 0.19};
  Eigen::Vector3d hair{0.045, 0.026, 0.016};
  Eigen::Vector3d iris{0.10, 0.055, 0.025};
  double lips = 0.5;      ///< redness of the vermilion
  double blush = 0.5;     ///< redness of cheeks, nose and ears
  double mottling = 0.4;  ///< uneven pigment
  double freckles = 0;
  double beard = 0;          ///< shadow of a shaven beard
  double brows = 0.8;        ///< density of the eyebrows
  double scalp_hair = 0.85;  ///< density of the (cropped) scalp hair
  std::uint64_t seed = 1;    ///< of the pigment's pattern
};

/// Colours as people have them; dimorphism > 0 grows a beard shadow more often.
Appearance draw_appearance(Random& random, double dimorphism = 0);

/// Colour of any point of the mean head's surface: evaluated where a scan samples it, it is as sharp as the scan.
class SkinPainter {
 public:
  explicit SkinPainter(const Appearance& appearance);
  ~SkinPainter();
  Eigen::Vector3d operator()(const Eigen::Vector3d& canonical_point) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

}  // namespace facewright
