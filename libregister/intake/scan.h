// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/io/manifest.h"
#include "libregister/intake/frame_detection.h"
#include "libregister/intake/repair.h"

namespace facewright {

enum class Units { automatic, mm, cm, m, inch };
/// "auto", "mm", "cm", "m" or "inch"; throws InvalidInput.
Units units_from_name(const std::string& name);

/// A scan ready for registration: millimetres, manifold, with its landmarks.
struct Scan {
  std::string id;
  Mesh mesh;            ///< millimetres, the scanner's axes
  Image texture;        ///< sRGB, or empty; mesh.uv refers to it
  Landmarks landmarks;  ///< millimetres
  double mm_per_unit = 1;
  std::string units_reason;  ///< how the units were found, in words
  RepairSummary repair;
  int welded_vertices = 0;              ///< vertices of the file that repeated another's position
  std::optional<FrameDetection> frame;  ///< if the geometry was asked (ScanOptions::reference)
  std::vector<std::string> warnings;
};

/// The files of one scan.
struct ScanFiles {
  std::string id;  ///< the mesh file's stem, or what its manifest says
  std::filesystem::path mesh;
  std::optional<std::filesystem::path> landmarks;  ///< beside the mesh: ID.json, .pts, .pp, .mrk.json, .fcsv,
                                                   ///< .ljson, .tlms, .csv, .bnd, .lm3
  Units units = Units::automatic;                  ///< of this scan, if its manifest states them
  bool has_our_names = false;                      ///< `landmarks` needs no mapping of names, whatever the options say
};

/// A mesh file with the landmark file beside it; the id is its stem.
ScanFiles files_of_scan(const std::filesystem::path& mesh);

/// Mesh files in a folder, sorted by id, with the landmark files beside them. Throws IoError if the folder cannot be
/// read, InvalidInput if it holds no mesh or two meshes of the same stem.
std::vector<ScanFiles> find_scans(const std::filesystem::path& folder);

/// The scans of a manifest, sorted by id; landmarks that it does not name are looked for beside the mesh. Throws
/// InvalidInput for a file whose extension is none of a mesh.
std::vector<ScanFiles> find_scans(const Manifest& manifest);

/// Which axes a scan comes back in.
enum class ScanAxes {
  scanner,  ///< the file's; left-handed ones are mirrored back by negating x
  head      ///< +x the subject's left, +y up, +z out of the face, to the nearest axes
};

struct ScanOptions {
  Units units = Units::automatic;
  RepairOptions repair;
  /// Given: units, axes, winding and handedness are found from the geometry (frame_detection.h) unless landmarks tell
  /// them; must outlive the call. Not given: units from landmarks or size, all else as it is in the file.
  const MultiresTemplate* reference = nullptr;
  FrameOptions frame;                                   ///< its mm_per_unit follows `units`
  ScanAxes axes = ScanAxes::scanner;                    ///< head needs the reference
  std::optional<std::filesystem::path> landmark_names;  ///< mapping of another scheme's names (landmark_names.h)
};

/// Reads, repairs and converts a scan to millimetres. Without landmarks the scan comes back with an empty table.
/// Several pictures become one. Throws IoError for unreadable files, InvalidInput when the units, or with a reference
/// the axes or the handedness, cannot be told; the message has the candidates and the remedy.
Scan load_scan(const ScanFiles& files, const ScanOptions& options = {});

/// Millimetres per unit of a scan: from the distance of the outer eye corners (landmarks 37 and 46; adults: 75 to 105
/// mm), else from the extent of all landmarks, else from the mesh's extent. `reason` tells which. Throws InvalidInput
/// when no unit makes the face human.
double detect_mm_per_unit(const Mesh& mesh, const Landmarks& landmarks, std::string* reason);

}  // namespace facewright
