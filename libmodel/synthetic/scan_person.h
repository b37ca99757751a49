// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"
#include "libmodel/synthetic/parametric_face.h"

namespace facewright {

/// What the simulated range scanner does wrong. Defaults are those of a good stereo scanner.
struct ScannerOptions {
  double spacing = 1.3;           ///< mm between samples, 0.5 .. 10
  double noise = 0.15;            ///< mm along the normal, white; half as much again is correlated over 10 mm; 0 .. 5
  double spikes = 0.001;          ///< share of vertices thrown 4 .. 20 mm off, 0 .. 0.2
  int holes = 3;                  ///< gaps of 3 .. 12 mm radius, 0 .. 100
  double pose_deg = 8;            ///< largest rotation, about a random axis; the shift is random too unless this is 0
  double landmark_noise = 1.0;    ///< mm, root mean square distance of a landmark from its place, 0 .. 20
  double missing_landmarks = 0;   ///< share left out, 0 .. 0.9
  double unit = 1;                ///< file units per millimetre: 1 mm, 0.1 cm, 0.001 m
  double field_of_view_deg = 95;  ///< to either side of straight ahead, 40 .. 150
};

/// A scan and the truth it was made from.
struct SyntheticScan {
  Mesh mesh;  ///< as the scanner delivers it: own triangulation, scanner frame and unit, colours, cylindrical uv
  Landmarks landmarks;               ///< as someone marked them, in the scanner frame and unit
  std::vector<SurfacePoint> source;  ///< per scan vertex: its place on the canonical mesh
  std::vector<bool> spike;           ///< per scan vertex: thrown off the surface
  Similarity scanner_from_head;      ///< rigid, millimetres: the pose
  Mesh truth;                        ///< canonical mesh of the person in the scanner's pose, millimetres, colours
  Landmarks true_landmarks;          ///< all of them, without noise, in the scanner's pose, millimetres
};

/// Scans a person with a simulated cylindrical range scanner: samples on a jittered, staggered grid of directions hit
/// the outermost surface; grazed and occluded parts are gaps, the border is ragged, small islands are dropped.
/// Deterministic in (face, person, seed, index, options). About 0.5 s. Throws InvalidInput for options out of range.
SyntheticScan scan_person(const ParametricFace& face, const SyntheticPerson& person, std::uint64_t seed,
                          std::uint64_t index, const ScannerOptions& options = {});

/// The colours of a scan as a texture for its uv (bottom-up v): sharper than the colours at its vertices. A second for
/// 1024 x 1024. Throws InvalidInput for a size outside 64 .. 8192 pixels.
Image paint_texture(const ParametricFace& face, const SyntheticPerson& person, const SyntheticScan& scan, int size);

}  // namespace facewright
