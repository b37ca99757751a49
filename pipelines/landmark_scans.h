// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/core/progress.h"
#include "libregister/intake/scan.h"
#include "libregister/landmarking/scan_landmarks.h"

namespace facewright {

struct LandmarkScansOptions {
  std::vector<std::filesystem::path> inputs;  ///< scans, and folders of scans
  std::filesystem::path output;               ///< folder; or, for a single scan, a landmark file
  std::string format = "json";                ///< extension of the landmark files in the folder
  std::filesystem::path reference;            ///< a file of make-reference; empty: the built-in face
  std::filesystem::path predictor;            ///< dlib's trees; empty: where Debian puts them
  LandmarkMethod method = LandmarkMethod::automatic;
  FindLandmarksOptions find;
  ScanOptions scan;
  bool deviations = false;  ///< JSON files state each landmark's standard deviation
  int jobs = 0;             ///< scans at once, 0 = all cores; does not change a byte
};

struct LandmarkedScan {
  std::string id;
  std::filesystem::path file;
  bool found = false;
  bool by_hand = false;  ///< somebody's file was there and stays; nothing was looked for
  std::string reason;    ///< why not, and what to do
  std::string units;     ///< how they were found
  FindLandmarksSummary summary;
};

struct LandmarkScansSummary {
  std::vector<LandmarkedScan> scans;  ///< sorted by id
  int found = 0, by_hand = 0, failed = 0;
  bool used_pictures = false;
};

/// The scans of `inputs`, sorted by id, with the landmark files beside them. Throws InvalidInput if there is no scan or
/// an id comes twice.
std::vector<ScanFiles> list_scans(const std::vector<std::filesystem::path>& inputs);

/// Finds the landmarks of scans and writes, by a scan's id: ID.json (or the format asked for; the file's own units and
/// axes) and ID.png, a picture with the landmarks; for a failure the picture of what was read and problematic/ID.txt
/// with the reason; and landmarks.csv, a line per scan. A landmark file in the folder that no search has written as it
/// stands is somebody's work and is kept (landmark_record.h). Throws InvalidInput if there is no scan, an id comes
/// twice, the format cannot hold the landmarks, or the folder is that of the scans.
LandmarkScansSummary landmark_scans(const LandmarkScansOptions& options, const Progress& progress = {});

}  // namespace facewright
