// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/mesh.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

/// How much of a model a page carries.
struct ViewerDataOptions {
  int shape_modes = 30, colour_modes = 15, expression_modes = 15;  ///< the leading ones, >= 0
};

/// What the page's viewer turns into faces, as text for a `<script>` element: base64 of a gzip stream (page/payload.js
/// has its layout). Positions are millimetres in single precision; the entries of shape modes are whole numbers of 16
/// bits, of colour modes of 8, each mode with a step of its own, so that three standard deviations are off by less than
/// 1e-4 of the mode's largest displacement, and by 1.2 % of its largest change of colour. The same bytes for the same
/// model.
std::string model_viewer_data(const MorphableModel& model, const ViewerDataOptions& options = {});

/// A single mesh with its colours and texture coordinates, for the same viewer; wedge coordinates (uv_faces) throw
/// InvalidInput.
std::string mesh_viewer_data(const Mesh& mesh);

}  // namespace facewright
