// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <gtest/gtest.h>

#include "libmodel/synthetic/parametric_face.h"
#include "libmodel/synthetic/scan_person.h"
#include "libregister/reference/reference_face.h"

namespace facewright {

/// A scan of a made-up person, upright to 8 degrees, in millimetres, and the reference face; made once.
struct FrameFixture {
  MultiresTemplate reference = default_reference();
  ParametricFace face;
  SyntheticScan scan(std::uint64_t index) const {
    return scan_person(face, draw_person(face, 11, index), 11, index, {.spacing = 3});
  }
  SyntheticScan person = scan(0);

  static const FrameFixture& get() {
    static const FrameFixture fixture;
    return fixture;
  }
};

/// The eyes lie right and left, the nose before and the mouth below them, in millimetres: the head frame.
inline bool is_upright(const Landmarks& l) {
  const auto at = [&](const char* name) { return l.at(name).position; };
  const Eigen::Vector3d eyes = at("46") - at("37"), between = (at("46") + at("37")) / 2, nose = at("31") - between;
  const Eigen::Vector3d mouth = (at("49") + at("55")) / 2 - between;
  return eyes[0] > 0.8 * eyes.norm() && eyes.norm() > 60 && eyes.norm() < 140 && nose[2] > 20 && mouth[1] < -40;
}

}  // namespace facewright
