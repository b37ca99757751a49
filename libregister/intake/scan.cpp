// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/scan.h"

#include <algorithm>
#include <array>
#include <map>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/landmark_names.h"
#include "libmodel/io/text_encoding.h"
#include "libregister/intake/mesh_import.h"
#include "libregister/intake/texture_atlas.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
  return s;
}

std::optional<fs::path> landmarks_beside(const fs::path& mesh) {
  for (const char* extension :
       {".json", ".pts", ".pp", ".mrk.json", ".fcsv", ".ljson", ".tlms", ".csv", ".bnd", ".lm3"}) {
    fs::path candidate = mesh;
    candidate.replace_extension(extension);
    if (fs::exists(candidate)) return candidate;
  }
  return {};
}

bool is_mesh_file(const fs::path& file) {
  const auto& known = mesh_extensions();
  return std::find(known.begin(), known.end(), lower(file.extension().string())) != known.end();
}

struct KnownSize {
  const char* what;
  double lowest, highest;  // millimetres
};

// Which of mm, cm, m brings `length` into the known range; the ranges are far narrower than a factor of ten.
std::optional<double> unit_for(double length, const KnownSize& size) {
  for (const double mm : {1.0, 10.0, 1000.0})
    if (length * mm >= size.lowest && length * mm <= size.highest) return mm;
  return {};
}

double extent(const Vertices& X) { return (X.colwise().maxCoeff() - X.colwise().minCoeff()).norm(); }

const char* unit_name(double mm) {
  return mm == 1 ? "millimetres" : mm == 10 ? "centimetres" : mm == 25.4 ? "inches" : "metres";
}

}  // namespace

Units units_from_name(const std::string& name) {
  if (name == "auto") return Units::automatic;
  if (name == "mm") return Units::mm;
  if (name == "cm") return Units::cm;
  if (name == "m") return Units::m;
  if (name == "inch") return Units::inch;
  throw InvalidInput("units: expected auto, mm, cm, m or inch, got '" + name + "'");
}

double detect_mm_per_unit(const Mesh& mesh, const Landmarks& landmarks, std::string* reason) {
  double length;
  KnownSize size;
  if (landmarks.count("37") && landmarks.count("46")) {
    length = (landmarks.at("37").position - landmarks.at("46").position).norm();
    size = {"outer eye distance", 60, 140};  // Farkas 1994: 80-105 mm in adults; children and loose clicks included
  } else if (landmarks.size() >= 3) {
    Vertices X(static_cast<Eigen::Index>(landmarks.size()), 3);
    Eigen::Index i = 0;
    for (const auto& entry : landmarks) X.row(i++) = entry.second.position;
    length = extent(X);
    size = {"extent of the landmarks", 50, 330};
  } else {
    length = extent(mesh.V);
    size = {"diagonal of the mesh", 120, 900};
  }
  std::ostringstream text;
  text << size.what << " " << length << " units";
  if (const auto mm = unit_for(length, size)) {
    text << ": " << unit_name(*mm);
    *reason = text.str();
    return *mm;
  }
  text << " fits a face in none of mm, cm, m (expected " << size.lowest << " to " << size.highest
       << " mm); convert the scan or give --units";
  throw InvalidInput("units: " + text.str());
}

ScanFiles files_of_scan(const fs::path& mesh) {
  ScanFiles files;
  files.id = as_utf8(mesh.stem().string());
  files.mesh = mesh;
  files.landmarks = landmarks_beside(mesh);
  return files;
}

std::vector<ScanFiles> find_scans(const fs::path& folder) {
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  if (error) throw IoError(folder.string(), "cannot be read as a folder of scans: " + error.message());
  std::map<std::string, ScanFiles> found;
  for (const auto& entry : entries) {
    if (!entry.is_regular_file()) continue;
    const fs::path& p = entry.path();
    if (!is_mesh_file(p)) continue;
    const std::string id = as_utf8(p.stem().string());
    const auto [it, is_new] = found.try_emplace(id, files_of_scan(p));
    if (!is_new)
      throw InvalidInput(folder.string() + ": two scans are called '" + id + "' (" +
                         it->second.mesh.filename().string() + " and " + p.filename().string() + "); rename one");
  }
  if (found.empty()) throw InvalidInput(folder.string() + ": no mesh files (OBJ, PLY, STL, OFF, glTF) in this folder");
  std::vector<ScanFiles> list;
  for (auto& entry : found) list.push_back(std::move(entry.second));
  return list;
}

std::vector<ScanFiles> find_scans(const Manifest& manifest) {
  std::vector<ScanFiles> list;
  for (const ManifestEntry& e : manifest.entries) {
    if (!is_mesh_file(e.file))
      throw InvalidInput(manifest.path.string() + ":" + std::to_string(e.line) + ": " + e.file.string() +
                         " is no mesh file (OBJ, PLY, STL, OFF, glTF)");
    list.push_back({e.id, e.file, e.landmarks.empty() ? landmarks_beside(e.file) : e.landmarks,
                    units_from_name(e.units.empty() ? "auto" : e.units)});
  }
  std::sort(list.begin(), list.end(), [](const ScanFiles& a, const ScanFiles& b) { return a.id < b.id; });
  return list;
}

namespace {

double mm_of(Units units) {
  switch (units) {
    case Units::mm:
      return 1;
    case Units::cm:
      return 10;
    case Units::m:
      return 1000;
    case Units::inch:
      return 25.4;
    case Units::automatic:
      break;
  }
  return 0;
}

// One picture for the mesh; several are merged. A picture that cannot be read is a warning.
Image read_textures(const ImportedMesh& imported, Mesh* mesh, std::vector<std::string>* warnings) {
  const auto read = [&](const fs::path& file) {
    try {
      return read_image(file);
    } catch (const IoError& e) {
      warnings->push_back(std::string("texture not used: ") + e.what());
      return Image();
    }
  };
  if (imported.texture.empty()) return {};
  if (imported.textures.empty()) return read(imported.texture);
  std::vector<Image> pictures;
  for (const fs::path& file : imported.textures) pictures.push_back(read(file));
  const auto empty = [](const Image& image) { return image.empty(); };
  if (std::all_of(pictures.begin(), pictures.end(), empty)) return {};
  return merge_pictures(pictures, imported.texture_of_triangle, mesh);
}

void scale_landmarks(Landmarks* landmarks, double factor) {
  for (auto& entry : *landmarks) entry.second.position *= factor, entry.second.stddev *= factor;
}

// Units, axes, winding and handedness as the geometry tells them; units and handedness that landmarks tell stand.
void settle_by_geometry(Scan* scan, Units units, const ScanOptions& options) {
  FrameOptions frame = options.frame;
  if (units != Units::automatic) frame.mm_per_unit = mm_of(units);
  if (frame.mm_per_unit <= 0 && !scan->landmarks.empty())
    frame.mm_per_unit = detect_mm_per_unit(scan->mesh, scan->landmarks, &scan->units_reason);
  if (frame.handedness == Handedness::automatic)
    frame.handedness = handedness_by_landmarks(scan->landmarks, *options.reference);
  scan->frame = detect_frame(scan->mesh, *options.reference, frame);
  const FrameDetection& found = *scan->frame;
  require_decided(found);
  scan->warnings.insert(scan->warnings.end(), found.summary.warnings.begin(), found.summary.warnings.end());
  scan->mm_per_unit = found.mm_per_unit;
  scan->units_reason = found.summary.explanation;
  if (options.axes == ScanAxes::head) return convert_to_head_axes(found, &scan->mesh, &scan->landmarks);
  FrameDetection kept = found;  // the file's axes, but right-handed
  kept.head_axes_from_file = Eigen::Vector3d(found.mirrored ? -1 : 1, 1, 1).asDiagonal();
  convert_to_head_axes(kept, &scan->mesh, &scan->landmarks);
}

void settle_units(Scan* scan, Units units) {
  scan->mm_per_unit =
      units == Units::automatic ? detect_mm_per_unit(scan->mesh, scan->landmarks, &scan->units_reason) : mm_of(units);
  if (units != Units::automatic) scan->units_reason = std::string("given: ") + unit_name(scan->mm_per_unit);
  scan->mesh.V *= scan->mm_per_unit;
  scale_landmarks(&scan->landmarks, scan->mm_per_unit);
}

}  // namespace

Scan load_scan(const ScanFiles& files, const ScanOptions& options) {
  Scan scan;
  scan.id = files.id;
  ImportedMesh imported = import_mesh(files.mesh);
  scan.warnings = imported.warnings;
  scan.texture = read_textures(imported, &imported.mesh, &scan.warnings);
  RepairResult repaired = repair_mesh(imported.mesh, options.repair);
  scan.mesh = std::move(repaired.mesh);
  scan.repair = repaired.summary;
  scan.repair.non_finite += imported.non_finite_triangles;
  scan.welded_vertices = imported.welded_vertices;
  if (files.landmarks) scan.landmarks = read_landmarks(*files.landmarks);
  if (options.landmark_names && !files.has_our_names && !scan.landmarks.empty())
    scan.landmarks = rename_landmarks(scan.landmarks, read_landmark_names(*options.landmark_names));
  const Units units = files.units != Units::automatic ? files.units : options.units;
  if (options.reference)
    settle_by_geometry(&scan, units, options);
  else
    settle_units(&scan, units);
  return scan;
}

}  // namespace facewright
