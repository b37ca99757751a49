// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/progress.h"
#include "libregister/reference/reference_check.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/register_scan.h"

namespace facewright {

struct MakeReferenceOptions {
  int vertices = 845;  ///< of the reference, hit exactly; check_vertex_count (remesh_half.h); default [huber2016]
  double radius = 0;   ///< mm, geodesic, from the tip of the nose to the rim; 0: as far as the built-in face reaches
  bool mouth_slit = true;      ///< cut along the line between the closed lips
  bool keep_eyeballs = false;  ///< lay the face over eyeballs that are parts of their own instead of taking them out
  double lip_gap = 0.4;        ///< mm, >= 0: least distance of the two lips along the slit; our choice
  RegisterOptions registration;
};

/// How one landmark came to lie.
struct ReferenceLandmark {
  std::string name;
  bool derived = false;            ///< not given: carried over from the built-in face by the registration
  double registered_distance = 0;  ///< mm, given point to its mark on the registered face, before it was made symmetric
  double symmetric_distance = 0;   ///< mm, given point made symmetric to the mark on the reference
};

struct MakeReferenceSummary {
  std::vector<ReferenceLandmark> landmarks;  ///< marked, in order of their names
  /// Given, but not marked where they were given: name and reason.
  std::map<std::string, std::string, LandmarkNameOrder> left_out;
  double symmetric_mean = 0, symmetric_max = 0;    ///< mm, over the landmarks given
  double registered_mean = 0, registered_max = 0;  ///< mm, over the landmarks given
  int eyeballs_removed = 0;                        ///< parts
  double asymmetry_rms = 0;                        ///< mm, how far the face was from symmetric
  double off_mesh_percent = 0;               ///< of the registered surface's vertices that found no place on the mesh
  double nearest_rim = 0, farthest_rim = 0;  ///< mm, geodesic from the tip of the nose
  std::string rim;                           ///< where it runs: the radius asked for, the built-in face's rim, or both
  RegisterSummary registration;
  ReferenceCheck check;
};

struct MakeReferenceResult {
  ReferenceFace face;  ///< head frame, mm, exactly symmetric, landmarks at vertices, regions
  MakeReferenceSummary summary;
};

/// A symmetric reference face with a triangulation of its own from any head mesh (mm, any pose) and its landmarks:
/// the built-in face is registered to the mesh, made symmetric, cropped, triangulated anew and marked. At least six of
/// the built-in face's landmarks are needed; names it does not know are marked where they lie. Some six seconds.
/// Throws InvalidInput when the mesh is no face or the wishes cannot be met.
MakeReferenceResult make_reference(const Mesh& mesh, const Landmarks& landmarks,
                                   const MakeReferenceOptions& options = {}, const Progress& progress = {});

/// Takes out the parts of a mesh that are eyeballs: components of an eye's size about an eye's landmarks. Returns their
/// number. Landmarks 37 .. 48 tell where the eyes are; without them nothing is done.
int remove_eyeballs(Mesh& mesh, const Landmarks& landmarks);

}  // namespace facewright
