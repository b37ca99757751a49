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
#include "libregister/intake/repair.h"

namespace facewright {

enum class Units { automatic, mm, cm, m };
/// "auto", "mm", "cm" or "m"; throws InvalidInput.
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
  std::vector<std::string> warnings;
};

/// The files of one scan.
struct ScanFiles {
  std::string id;  ///< the mesh file's stem, or what its manifest says
  std::filesystem::path mesh;
  std::optional<std::filesystem::path> landmarks;  ///< beside the mesh: ID.json, .pts, .pp, .mrk.json, .fcsv,
                                                   ///< .ljson, .tlms, .csv, .bnd, .lm3
  Units units = Units::automatic;                  ///< of this scan, if its manifest states them
};

/// Mesh files in a folder, sorted by id, with the landmark files beside them. Throws IoError if the folder cannot be
/// read, InvalidInput if it holds no mesh or two meshes of the same stem.
std::vector<ScanFiles> find_scans(const std::filesystem::path& folder);

/// The scans of a manifest, sorted by id; landmarks that it does not name are looked for beside the mesh. Throws
/// InvalidInput for a file whose extension is none of a mesh.
std::vector<ScanFiles> find_scans(const Manifest& manifest);

struct ScanOptions {
  Units units = Units::automatic;
  RepairOptions repair;
};

/// Reads, repairs and converts a scan to millimetres. Without landmarks the scan comes back with an empty table.
/// Throws IoError for unreadable files, InvalidInput when the units cannot be told.
Scan load_scan(const ScanFiles& files, const ScanOptions& options = {});

/// Millimetres per unit of a scan: from the distance of the outer eye corners (landmarks 37 and 46; adults: 75 to 105
/// mm), else from the extent of all landmarks, else from the mesh's extent. `reason` tells which. Throws InvalidInput
/// when no unit makes the face human.
double detect_mm_per_unit(const Mesh& mesh, const Landmarks& landmarks, std::string* reason);

}  // namespace facewright
