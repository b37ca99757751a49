// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_scan_files.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/csv.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/fit_images/scan_record.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

constexpr std::array endings = {
    ".ply", ".json", "_error.png", "_distances.csv", "_refined.ply", "_refined_error.png", "_refined_distances.csv"};

fs::path landmark_file(const FitScanFilesOptions& options) {
  if (!options.landmarks.empty()) return options.landmarks;
  for (const char* extension : {".json", ".pts", ".pp", ".mrk.json", ".fcsv", ".ljson"}) {
    const fs::path beside = fs::path(options.scan).replace_extension(extension);
    if (fs::is_regular_file(beside)) return beside;
  }
  throw InvalidInput(options.scan.string() + ": landmarks: expected " + options.scan.stem().string() +
                     ".json, .pts, .pp, .mrk.json, .fcsv or .ljson beside the scan, found none; name the file with "
                     "--landmarks, or make one with landmark-scan");
}

/// "face.mrk.json" -> "face".
std::string stem_of(const fs::path& file) {
  std::string stem = file.stem().string();
  if (stem.ends_with(".mrk")) stem.resize(stem.size() - 4);
  return stem;
}

void check(const FitScanFilesOptions& o, const MorphableModel& model, const fs::path& landmarks) {
  if (o.fit.level >= model.level_count())
    throw InvalidInput(o.model.string() + ": level: expected -1.." + std::to_string(model.level_count() - 1) +
                       ", got " + std::to_string(o.fit.level));
  if (o.needs_expression && !model.expression())
    throw InvalidInput(o.model.string() + ": the model has no expression modes; leave --expression out");
  if (!(o.error_range_mm > 0)) throw InvalidInput("error picture: expected a range > 0 mm");
  if (o.refine && o.scan.empty())
    throw InvalidInput("refinement: there is no scan to refine to; leave it out, or name the scan");
  for (const fs::path& source : {o.scan, landmarks}) {
    std::error_code missing;
    if (source.empty()) continue;
    if (fs::equivalent(source.has_parent_path() ? source.parent_path() : ".", o.output, missing))
      throw InvalidInput("output: " + o.output.string() + " is where " + source.filename().string() +
                         " lies, and results would overwrite it; name another folder with -o");
  }
}

std::string number(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", x);
  return text.data();
}

/// How many times the model's mean face the face of these landmarks is, its shape aside.
double size_of(const MorphableModel& model, const Landmarks& landmarks, const LandmarkMapper& mapper) {
  FitPointsOptions o;
  o.scaling = Scaling::free;
  o.modes = 0;
  o.expression = false;
  return fit_points(model, landmarks, o, mapper).scan_from_model.s;
}

/// Millimetres per unit, from the size of the face where it was not given; heads differ by less than a third.
void find_unit(const FitScanFilesOptions& options, double size, FitScanFilesSummary& summary) {
  const auto plausible = [&](double mm_per_unit) { return size * mm_per_unit > 0.7 && size * mm_per_unit < 1.4; };
  if (options.mm_per_unit > 0) {
    summary.mm_per_unit = options.mm_per_unit;
    summary.units_reason = "as stated";
    if (plausible(options.mm_per_unit)) return;
    throw InvalidInput(summary.landmarks.string() + ": units: in the unit stated the face is " +
                       number(size * options.mm_per_unit) +
                       " times as large as the model's; state another with --units, or leave it to be found (auto)");
  }
  for (const double mm_per_unit : {1.0, 10.0, 1000.0}) {
    if (!plausible(mm_per_unit)) continue;
    summary.mm_per_unit = mm_per_unit;
    summary.units_reason = "the landmarks make a face " + number(size * mm_per_unit) + " times the model's";
    return;
  }
  throw InvalidInput(summary.landmarks.string() +
                     ": units: neither mm, cm nor m makes a face of these landmarks (in mm " + "it is " + number(size) +
                     " times the model's); convert the files, and check the landmarks' names");
}

Mesh in_millimetres(Mesh mesh, double mm_per_unit) {
  mesh.V *= mm_per_unit;
  return mesh;
}

Landmarks in_millimetres(Landmarks landmarks, double mm_per_unit) {
  for (auto& [name, mark] : landmarks) mark.position *= mm_per_unit, mark.stddev *= mm_per_unit;
  return landmarks;
}

std::string distances_csv(const Vertices& V, const Eigen::VectorXd& distances, const std::vector<ScanMatch>& matches) {
  const auto text = [](double x) {
    char buffer[32];
    return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, static_cast<float>(x)).ptr);
  };
  std::string csv = csv_line({"vertex", "x_mm", "y_mm", "z_mm", "match", "distance_mm"});
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    const ScanMatch match = matches[static_cast<size_t>(i)];
    csv += csv_line({std::to_string(i), text(V(i, 0)), text(V(i, 1)), text(V(i, 2)), to_string(match),
                     match == ScanMatch::beyond ? "" : text(distances[i])});
  }
  return csv;
}

/// Mesh, table and picture of a face beside a scan.
void save(const FitScanFilesOptions& options, const MorphableModel& model, const std::string& stem, const Vertices& V,
          const Eigen::VectorXd& distances, const std::vector<ScanMatch>& matches, const Similarity& scan_from_model) {
  const auto path = [&](const char* ending) { return options.output / (stem + ending); };
  Mesh mesh;
  mesh.F = model.faces(options.fit.level);
  mesh.V = V.topRows(model.vertex_count(options.fit.level));
  write_ply(path(".ply"), mesh);
  write_file(path("_distances.csv"), distances_csv(V, distances, matches));
  write_png(path("_error.png"), distance_picture(scan_from_model.inverse().apply(V), model.faces(), distances, matches,
                                                 options.error_range_mm));
}

void fit_surface(const FitScanFilesOptions& options, const MorphableModel& model, const LandmarkMapper& mapper,
                 const Landmarks& landmarks, const Mesh& scan, FitScanFilesSummary& summary) {
  summary.scan = fit_scan(model, scan, landmarks, options.fit, mapper);
  const FitScanResult& fit = *summary.scan;
  if (options.refine) summary.refined = refine_to_scan(model, scan, fit, options.refinement);
  save(options, model, summary.stem, fit.fitted, fit.distances, fit.matches, fit.scan_from_model);
  if (const auto& r = summary.refined)
    save(options, model, summary.stem + "_refined", r->V, r->distances, r->matches, fit.scan_from_model);
}

void fit_marks(const FitScanFilesOptions& options, const MorphableModel& model, const LandmarkMapper& mapper,
               const Landmarks& landmarks, FitScanFilesSummary& summary) {
  summary.points = fit_points(model, landmarks, options.points, mapper);
  Mesh mesh = model.instance(summary.points->shape_coefficients, {}, options.fit.level,
                             summary.points->expression_coefficients);
  mesh.V = summary.points->scan_from_model.apply(mesh.V);
  write_ply(options.output / (summary.stem + ".ply"), mesh);
}

/// What an IoError does not say: the files.
[[noreturn]] void rethrow_naming(const FitScanFilesOptions& options, const FitScanFilesSummary& summary) {
  const std::string files = (options.scan.empty() ? "" : options.scan.string() + " with ") + summary.landmarks.string();
  try {
    throw;
  } catch (const SolverError& error) {
    throw SolverError(files + ": " + error.what());
  } catch (const InvalidInput& error) {
    throw InvalidInput(files + ": " + error.what());
  }
}

}  // namespace

FitScanFilesSummary fit_scan_files(const FitScanFilesOptions& options) {
  if (options.scan.empty() && options.landmarks.empty()) throw InvalidInput("fit: there is neither scan nor landmarks");
  try_model_file(options.model);
  const MorphableModel model = load_model(options.model);
  FitScanFilesSummary summary;
  summary.landmarks = landmark_file(options);
  summary.stem = stem_of(options.scan.empty() ? summary.landmarks : options.scan);
  check(options, model, summary.landmarks);
  const LandmarkMapper mapper = options.mapping.empty() ? LandmarkMapper() : read_landmark_mapping(options.mapping);
  const Landmarks raw = read_landmarks(summary.landmarks);
  Mesh scan;
  if (!options.scan.empty()) scan = read_mesh(options.scan);
  fs::create_directories(options.output);
  const auto clear = [&] {
    for (const char* ending : endings) {
      std::error_code ignored;
      fs::remove(options.output / (summary.stem + ending), ignored);
    }
  };
  clear();
  try {
    find_unit(options, size_of(model, raw, mapper), summary);
    const Landmarks landmarks = in_millimetres(raw, summary.mm_per_unit);
    if (options.scan.empty())
      fit_marks(options, model, mapper, landmarks, summary);
    else
      fit_surface(options, model, mapper, landmarks, in_millimetres(std::move(scan), summary.mm_per_unit), summary);
    const ScanRecord record = scan_record(options, model, mapper, landmarks, summary);
    summary.landmark_rms_mm = record.landmark_rms_mm;
    write_file(options.output / (summary.stem + ".json"), record.json);
  } catch (const IoError&) {
    clear();
    throw;
  } catch (...) {
    clear();
    rethrow_naming(options, summary);
  }
  return summary;
}

}  // namespace facewright
