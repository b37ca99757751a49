// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// Writes what other programs want to know about one level into `folder`:
///   mean.ply, mean.obj         the mean face with colours and texture coordinates
///   isomap.png                 wireframe of the texture map (only with texture coordinates)
///   landmarks.json             {"31": [x, y, z], ...} on the mean, mm
///   landmark_vertices.json     {"31": vertex, ...}, 0-based
///   landmark_points.json       {"31": {"triangle": t, "barycentric": [a, b, c], "vertex": v}, ...} on this level's
///                              triangles; vertex -1 where none coincides
///   regions.json               {"lips": [vertices], ...}, 0-based
///   contours.json              right and left face contour, in the format of eos (0-based)
///   symmetry.txt               left-right partner per vertex, in the format of eos (1-based)
///   edge_topology.json         faces and vertices of every edge, in the format of eos (1-based, 0 = none)
///   parents.json               which two or three vertices each subdivision vertex came from (0-based)
///   nesting.json               the proof: all of the above but isomap.png and landmarks.json read back and compared
///                              with the model, at this level and the next finer one, in the files' precision; and
///                              the model's level, modes included, with the next finer one
/// Every file atomically. Throws IoError, InvalidInput for a level that does not exist, SolverError if the proof fails.
void export_level_files(const MorphableModel& model, int level, const std::filesystem::path& folder);

/// The single files' contents.
std::string landmark_vertices_json(const LandmarkSet& landmarks);
std::string landmark_points_json(const MorphableModel& model, int level);
std::string regions_json(const MorphableModel& model, int level);
std::string contours_json(const MorphableModel& model, int level);
std::string symmetry_text(const std::vector<int>& mirror, int vertex_count);
std::string edge_topology_json(const Faces& F);
std::string parents_json(const MorphableModel& model, int level);

}  // namespace facewright
