// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/reference_face.h"
#include "libregister/reference/regions.h"

namespace facewright {

const char* default_reference_text();  // the embedded data file, see face845.cpp.in

// The design marks eyes, lips and borders along its own edges; the other regions follow from the landmarks.
ReferenceFace default_reference_face() {
  ReferenceFace face = parse_reference(default_reference_text(), "built-in reference");
  const RegionMap derived = face_regions(face.mesh, face.landmarks, face.mirror);
  for (const char* name :
       {"left_brow", "right_brow", "nose", "nostrils", "left_cheek", "right_cheek", "forehead", "chin"})
    face.regions[name] = derived.at(name);
  return face;
}

MultiresTemplate default_reference() { return build_template(default_reference_face()); }

}  // namespace facewright
