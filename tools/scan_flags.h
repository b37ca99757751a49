// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libregister/intake/scan.h"
#include "tools/cli.h"

namespace facewright {

/// What --units, --up, --front and --handedness say of scans. Throws InvalidInput.
inline ScanOptions scan_options(const CommonOptions& common) {
  ScanOptions options;
  options.units = units_from_name(common.units);
  options.frame.up = file_axis_from_name(common.up);
  options.frame.front = file_axis_from_name(common.front);
  options.frame.handedness = handedness_from_name(common.handedness);
  return options;
}

}  // namespace facewright
