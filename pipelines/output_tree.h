// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

namespace facewright {

/// Names of what `build-model` leaves; scripts rely on them.
struct OutputTree {
  std::filesystem::path root;

  std::filesystem::path model() const { return root / "model.h5"; }
  std::filesystem::path registered(const std::string& id) const { return root / "registered" / (id + ".ply"); }
  std::filesystem::path landmark_vertices() const { return root / "registered" / "landmark_vertices.json"; }
  std::filesystem::path scan_report(const std::string& id) const { return root / "scans" / (id + ".json"); }
  /// One character per vertex of the finest level: m matched, r mirrored, i interpolated, f free.
  std::filesystem::path scan_origins(const std::string& id) const { return root / "scans" / (id + ".origins"); }
  /// One digit per vertex of the finest level, 0 to 9: how far its colour can be trusted.
  std::filesystem::path colour_weights(const std::string& id) const { return root / "scans" / (id + ".colour"); }
  /// Signed distance of the registered mesh to the scan (error_picture.h).
  std::filesystem::path error_picture(const std::string& id) const { return root / "scans" / (id + ".png"); }
  /// The scan and its landmarks (scan_picture.h).
  std::filesystem::path scan_picture(const std::string& id) const { return root / "pictures" / (id + ".jpg"); }
  /// Landmarks that were found, or written by hand to take the place of all others.
  std::filesystem::path landmarks(const std::string& id) const { return root / "landmarks" / (id + ".json"); }
  std::filesystem::path landmark_picture(const std::string& id) const { return root / "landmarks" / (id + ".png"); }
  std::filesystem::path problem(const std::string& id) const { return root / "problematic" / (id + ".txt"); }
  std::filesystem::path level(int vertices) const { return root / "levels" / std::to_string(vertices); }
  std::filesystem::path isomap() const { return root / "isomap.json"; }
  /// The levels' refinement journal, decided once per model.
  std::filesystem::path hierarchy() const { return root / "hierarchy.json"; }
  std::filesystem::path exports() const { return root / "export"; }
  std::filesystem::path report() const { return root / "report"; }
  std::filesystem::path model_card(const char* extension) const {
    return root / (std::string("model_card") + extension);
  }
  std::filesystem::path build_json() const { return root / "build.json"; }
};

}  // namespace facewright
