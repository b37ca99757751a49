// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "libmodel/core/random.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/synthetic/scan_person.h"
#include "tests/support/shapes.h"

namespace facewright {

/// Writes p0.ply, p0.json, ...: `count` synthetic people of a seed, scanned every `spacing` mm.
inline void write_people(const std::filesystem::path& folder, std::uint64_t seed, std::uint64_t count, double spacing) {
  const ParametricFace face;
  ScannerOptions options;
  options.spacing = spacing;
  for (std::uint64_t i = 0; i < count; ++i) {
    const SyntheticScan scan = scan_person(face, draw_person(face, seed, i), seed, i, options);
    write_ply(folder / ("p" + std::to_string(i) + ".ply"), scan.mesh);
    write_landmarks(folder / ("p" + std::to_string(i) + ".json"), scan.landmarks);
  }
}

/// Writes ball.ply, a sphere, and ball.json, landmarks of a face scattered over it: they align with no face.
inline void write_ball(const std::filesystem::path& folder) {
  write_ply(folder / "ball.ply", icosphere(4, 90));
  Landmarks scattered;
  Random random(3);
  for (int i = 1; i <= 68; ++i)
    scattered[std::to_string(i)].position = 90 * random_points(random, 1, 1).row(0).normalized().transpose();
  scattered["37"].position = {-45, 0, 78};
  scattered["46"].position = {45, 0, 78};
  write_landmarks(folder / "ball.json", scattered);
}

}  // namespace facewright
