// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <vector>

#include "libmodel/core/camera.h"
#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"

namespace facewright {

/// A camera that shows all of V (N x 3), centred, with a margin of 5 % of the image, the head turned by yaw and pitch
/// (radians, see HeadPose). Throws InvalidInput without vertices or pixels.
OrthographicCamera frame_camera(const Vertices& V, int width, int height, double yaw = 0, double pitch = 0);

/// Tiles images of any size row by row; each cell has the size of the largest image, images are centred on white.
/// The result is RGB. Throws InvalidInput for no images or columns < 1.
Image contact_sheet(const std::vector<Image>& images, int columns);

}  // namespace facewright
