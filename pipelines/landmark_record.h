// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "libmodel/core/landmarks.h"

namespace facewright {

/// What a search for landmarks leaves beside them, in ID.found beside ID.json: what they were found in, and the hash of
/// the file that came of it, or why there is none. A landmark file that does not have that hash is somebody's work.
struct LandmarkRecord {
  std::string key;     ///< of the inputs and options
  std::string sha256;  ///< of the landmark file
  std::string reason;  ///< why nothing was found
};

/// The record beside a landmark file, if there is one that can be read.
std::optional<LandmarkRecord> landmark_record(const std::filesystem::path& landmarks);

/// Whether the landmark file is there and no search has written it as it stands: it must not be overwritten.
bool is_by_hand(const std::filesystem::path& landmarks);

/// Writes landmarks that were found, and their record. A run that dies on the way leaves no file that looks like
/// somebody's work. Throws as write_landmarks does.
void write_found_landmarks(const std::filesystem::path& file, const Landmarks& landmarks, const std::string& key = {});

/// Remembers a search in vain, and removes what an earlier one found.
void write_search_in_vain(const std::filesystem::path& file, const std::string& reason, const std::string& key = {});

}  // namespace facewright
