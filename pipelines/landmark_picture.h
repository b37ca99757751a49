// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/image.h"
#include "libregister/intake/scan.h"
#include "libregister/landmarking/scan_landmarks.h"

namespace facewright {

/// A scan from the front, the left and the right with its landmarks; of a scan without landmarks, what it looks like
/// along its file's axes. `lines` are written below.
Image landmark_picture(const Scan& scan, const FindLandmarksResult& result, const std::vector<std::string>& lines,
                       int threads = 1);

/// Only the text: there is no scan to show.
Image message_picture(const std::vector<std::string>& lines);

/// Of a scan in which no landmarks were found: the scan as it lies in its file, if that can be read, and the text.
Image failure_picture(const std::filesystem::path& mesh, const std::vector<std::string>& lines);

}  // namespace facewright
