// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/reference_face.h"

namespace facewright {

const char* default_reference_text();  // the embedded data file, see face845.cpp.in

ReferenceFace default_reference_face() { return parse_reference(default_reference_text(), "built-in reference"); }

MultiresTemplate default_reference() { return build_template(default_reference_face()); }

}  // namespace facewright
