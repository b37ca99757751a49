// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/core/topology.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

// The files that eos wants beside a model. Those that are written are made by eos_landmark_mapping (export_model.h),
// contours_json, edge_topology_json and symmetry_text (level_files.h). Readers throw IoError for malformed content.

/// A blendshapes file: names and displacements (3N), mm.
std::string eos_blendshapes_bytes(const std::vector<Blendshape>& blendshapes);
std::vector<Blendshape> read_eos_blendshapes(const std::filesystem::path& path);

/// Vertices (0-based) that may be the occluding contour: {"model_contour": {"right_contour", "left_contour"}}.
FaceContours read_eos_contours(const std::filesystem::path& path);

/// Edges with their triangles, turned from 1-based to 0-based, in the order of the file.
std::vector<Edge> read_eos_edge_topology(const std::filesystem::path& path);

/// The landmarks of a picture that lie on the contour, of the section [contour_landmarks] of a landmark mapping;
/// [landmark_mappings] is read by read_landmark_mapping.
struct EosContourLandmarks {
  std::vector<std::string> right, left;  ///< of the subject
};
EosContourLandmarks read_eos_contour_landmarks(const std::filesystem::path& path);

}  // namespace facewright
