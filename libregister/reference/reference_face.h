// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "libmodel/core/multires_template.h"
#include "libregister/subdivision/hierarchy.h"

namespace facewright {

/// A reference face before subdivision: its base mesh, marks and symmetry.
struct ReferenceFace {
  Mesh mesh;                ///< head frame, millimetres
  std::vector<int> mirror;  ///< (N) left-right partners, or empty: not symmetric
  LandmarkSet landmarks;
  std::map<std::string, std::vector<int>> regions;  ///< vertices of the base mesh, ascending
  std::set<std::string> derived;  ///< landmarks that nobody placed: carried over from another face by registration
};

/// The left-right table of a mesh that is symmetric about x = 0: every vertex and its reflection match within
/// `tolerance` (mm, > 0), and triangles map to triangles. Empty if the mesh is not symmetric. O(N log N).
std::vector<int> find_mirror(const Mesh& mesh, double tolerance = 0.01);

/// A surface point at vertex v: one of its triangles with barycentric coordinates 1, 0, 0. Throws InvalidInput if no
/// triangle uses v.
MeshLandmark mark_vertex(const Faces& F, int v);

/// The vertex of a mark, or the nearest corner of its triangle where it is none.
int nearest_corner(const MeshLandmark& mark, const Faces& F);

/// The text form, one record a line: "v x y z" (mm, 4 decimals), "f a b c" (0-based), "l name vertex [derived]", "r
/// region vertices", "#" comments. Landmarks that are not vertices are written as their triangle's nearest corner.
std::string format_reference(const ReferenceFace& face);
/// Reads the text form; the mirror table is found from the positions. `name` goes into error messages. Throws IoError.
ReferenceFace parse_reference(const std::string& text, const std::string& name);

/// The multi-resolution template on a reference face, regions carried up to the finest level.
MultiresTemplate build_template(const ReferenceFace& face, const std::vector<int>& budgets = {3448, 16759, 29587},
                                const HierarchyOptions& options = {});

/// A reference face from a mesh of one's own: manifold, consistently oriented, in the head frame (+x the subject's
/// left, +y up, +z out of the face; millimetres), symmetric about x = 0 if left and right are to be refined alike.
/// Landmarks are marked at their nearest surface point, and at a vertex if one is within `vertex_reach` mm. The region
/// "rim" is the longest boundary. Throws InvalidInput if a landmark is farther than 15 mm from the surface.
ReferenceFace make_reference_face(const Mesh& mesh, const Landmarks& landmarks, double vertex_reach = 0.5);

/// make_reference_face and build_template in one.
MultiresTemplate reference_from_mesh(const Mesh& mesh, const Landmarks& landmarks,
                                     const std::vector<int>& budgets = {3448, 16759, 29587});

/// The built-in reference face: 845 vertices, 1610 triangles, one outer border of 56 edges and a closed-lips mouth slit
/// of 24, left-right symmetric vertex for vertex; made by us on our own mean face (docs/reference.md). No file is read.
ReferenceFace default_reference_face();

/// The built-in face with its levels 845 -> 3448 -> 16759 -> 29587 (vertices), landmarks (all vertices) and regions:
/// those of face_regions, left_contour, right_contour (regions.h). About 0.1 s.
MultiresTemplate default_reference();

}  // namespace facewright
