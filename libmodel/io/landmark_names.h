// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "libmodel/core/landmarks.h"

namespace facewright {

/// Another scheme's landmark names -> ours.
using LandmarkNames = std::map<std::string, std::string, LandmarkNameOrder>;

/// Reads a mapping of landmark names. Throws IoError for malformed files and for names that occur twice on either side.
///   .json   {"Nose tip": "31", ...}
///   .csv    two columns, theirs,ours; a header "theirs,ours" or "from,to" is passed over
///   others  lines `"Nose tip" = "31"`, quotes optional; [sections], # comments and empty lines are passed over (TOML)
LandmarkNames read_landmark_names(const std::filesystem::path& path);

/// The landmarks whose names the mapping knows, under our names; others are left out, since equal names of different
/// schemes are different places. Throws InvalidInput if it knows none.
Landmarks rename_landmarks(const Landmarks& landmarks, const LandmarkNames& names);

}  // namespace facewright
