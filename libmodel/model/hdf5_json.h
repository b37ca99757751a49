// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

namespace facewright {

// Private to this module.

/// An HDF5-JSON text, as scalismo writes models since 0.92 (.h5.json), as the bytes of an HDF5 file: the datasets of
/// numbers and strings, at the paths of their aliases. `name` is the file's, for messages. Throws IoError for JSON of
/// another kind, and values that do not fill the shape stated.
std::string hdf5_from_json(const std::string& text, const std::string& name);

}  // namespace facewright
