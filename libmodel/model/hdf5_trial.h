// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>

namespace facewright {

// Private to this module.

/// Walks an HDF5 file in a copy of the process (guarded_call) before it is read in this one, for HDF5 1.10 crashes on
/// some damaged files: opens every group and dataset, and reads what is small, text, or not stored plainly. Refused are
/// also links and storage in other files. Throws IoError. Milliseconds: large plain arrays are not read.
void try_hdf5(const std::filesystem::path& file);

}  // namespace facewright
