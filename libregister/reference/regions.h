// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"

namespace facewright {

/// Named lists of vertices.
using RegionMap = std::map<std::string, std::vector<int>>;

/// The regions of a face that its ibug-68 landmarks tell, as ascending vertex lists:
///   left_eye, right_eye      the opening between the lids, with the lids
///   left_brow, right_brow    a band along the five points
///   nose, nostrils           from the nasion down to the wings and the base; nostrils: the holes in its underside
///   lips, mouth_slit         the red of the lips; the border between them, if the mesh is open there
///   left_cheek, right_cheek  below the eye to the jaw, from the nose and the corner of the mouth to the ear
///   forehead, chin           above the brows, between the temples; below the lips, down to the jaw
///   rim                      the longest border
/// The areas but for nostrils (in the nose), mouth_slit (in the lips) and rim do not overlap. They are polygons through
/// the landmarks in the directions seen from inside the head. With a mirror table (N, about x = 0) they are symmetric;
/// without one (empty) they follow the landmarks as they are. Regions whose landmarks are missing are left out;
/// landmarks need not be vertices. `mesh`: head frame, millimetres. Deterministic; O(N), some 50 ms at 30,000 vertices.
RegionMap face_regions(const Mesh& mesh, const LandmarkSet& landmarks, const std::vector<int>& mirror);
RegionMap face_regions(const Mesh& mesh, const Landmarks& landmarks, const std::vector<int>& mirror);

/// Vertices of a shortest path along edges of the mesh through the named landmarks (their nearest vertices), in order.
/// Empty if a name is missing or no path joins them. O(landmarks N log N).
std::vector<int> landmark_path(const Mesh& mesh, const LandmarkSet& landmarks, const std::vector<std::string>& names);

/// A path along edges of the base level on the finest one: bisection splits edges and never takes one away, so a path
/// only gains vertices, and the path on a level is the part below its vertex count. In order.
std::vector<int> refine_path(const MultiresTemplate& reference, const std::vector<int>& base_path);

/// All regions of the finest level of `reference`: those of face_regions, drawn on the finest level; the ones given for
/// the base level, if they are not what face_regions gives there, carried up instead (refine_region: a vertex belongs
/// if its parents do); and "left_contour" and "right_contour", the occluding-contour candidates: the path along the jaw
/// from ear to chin (landmarks 17 to 10 and 1 to 8, the chin's 9 left out), in that order. The vertices of a region on
/// level l are those below its vertex count. Without eye landmarks there are only the given regions and the borders.
RegionMap template_regions(const MultiresTemplate& reference, const RegionMap& base_regions);

}  // namespace facewright
