// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/image.h"
#include "libmodel/core/multires_template.h"
#include "libregister/intake/scan.h"
#include "libregister/registration/register_scan.h"

namespace facewright {

/// A registered scan as it came, from the front, `size` pixels wide and high (100..2000): left with its colours; right
/// in clay with the landmarks that were used (blue), those that were rejected (red crosses), and lines to where the
/// registered face has them. The bytes do not depend on anything else.
Image scan_picture(const Scan& scan, const RegistrationResult& result, const MultiresTemplate& reference,
                   int size = 260);

}  // namespace facewright
