// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/landmark_scans.h"

#include <algorithm>
#include <cstdio>
#include <mutex>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/csv.h"
#include "libmodel/io/image_files.h"
#include "libregister/reference/reference_face.h"
#include "pipelines/landmark_picture.h"
#include "pipelines/landmark_record.h"
#include "pipelines/landmarker_pool.h"
#include "pipelines/reference_file.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

struct Places {
  fs::path landmarks, picture, problem;
};

bool is_folder(const LandmarkScansOptions& options) { return options.output.extension().empty(); }

Places places(const LandmarkScansOptions& options, const std::string& id) {
  if (is_folder(options))
    return {options.output / (id + "." + options.format), options.output / (id + ".png"),
            options.output / "problematic" / (id + ".txt")};
  fs::path picture = options.output, problem = options.output;  // ID.png may be the scan's texture
  return {options.output, picture.replace_extension(".landmarks.png"), problem.replace_extension(".problem.txt")};
}

// Formats without names take the 68 numbered landmarks.
bool is_numbered(const fs::path& file) { return file.extension() == ".pts"; }

bool is_extra(const std::string& name) { return name.find_first_not_of("0123456789") != name.npos; }

// Back into the file's units; deviations only where they are asked for.
Landmarks as_in_file(const Scan& scan, const Landmarks& landmarks, bool deviations) {
  Landmarks out = landmarks;
  for (auto& [name, mark] : out) {
    mark.position /= scan.mm_per_unit;
    if (scan.frame && scan.frame->mirrored) mark.position[0] *= -1;  // load_scan has mirrored it back
    mark.stddev = deviations ? mark.stddev / scan.mm_per_unit : 0;
  }
  return out;
}

void check_output(const LandmarkScansOptions& options, const std::vector<ScanFiles>& files) {
  if (!is_folder(options)) {
    if (files.size() != 1)
      throw InvalidInput("landmark-scan: " + options.output.string() + " is one file, there are " +
                         std::to_string(files.size()) + " scans; name a folder");
    return;
  }
  // ID.png would overwrite a texture.
  for (const ScanFiles& f : files)
    if (fs::weakly_canonical(f.mesh).parent_path() == fs::weakly_canonical(options.output))
      throw InvalidInput("landmark-scan: the scans lie in " + options.output.string() +
                         "; choose another -o, such as " + (options.output / "landmarks").string());
}

// A format that cannot hold the names is refused before the first scan is looked at.
void check_format(const LandmarkScansOptions& options) {
  const std::string extension = is_folder(options) ? "." + options.format : options.output.filename().string();
  for (const char* known : {".json", ".fcsv", ".csv", ".ljson", ".tlms", ".pts", ".pp", ".lm3"})
    if (extension.ends_with(known)) return;
  throw InvalidInput("landmark-scan: landmarks are not written as '" + extension +
                     "'; known are json, mrk.json, fcsv, csv, ljson, tlms, pts, pp and lm3");
}

std::string number(const char* format, double x) {
  char text[40];
  std::snprintf(text, sizeof text, format, x);
  return text;
}

std::vector<std::string> describe(const LandmarkedScan& outcome) {
  const FindLandmarksSummary& s = outcome.summary;
  std::vector<std::string> lines;
  if (!outcome.found) {
    lines.push_back(outcome.id + ": no landmarks");
    lines.push_back(outcome.reason);
  } else {
    lines.push_back(outcome.id + ": " + s.method + ", " + std::to_string(s.detected) + " detected, pose " +
                    number("%.2f", s.pose_score) + ", residual " + number("%.1f", s.leave_one_out_rms) + " mm");
    if (!s.doubt.empty()) lines.push_back("to be looked at: " + s.doubt);
  }
  if (!outcome.units.empty()) lines.push_back(outcome.units);
  return lines;
}

void write_failure(const LandmarkedScan& outcome, const Scan& scan, const Places& to) {
  if (!is_by_hand(to.landmarks)) write_search_in_vain(to.landmarks, outcome.reason);
  write_file(to.problem, "scan: " + outcome.file.string() + "\n" + outcome.reason + "\n");
  write_png(to.picture, scan.mesh.F.rows() > 0 ? landmark_picture(scan, {}, describe(outcome))
                                               : failure_picture(outcome.file, describe(outcome)));
}

LandmarkedScan landmark_one(const ScanFiles& files, const LandmarkScansOptions& options,
                            const MultiresTemplate& reference, int threads, LandmarkerPool& pool) {
  LandmarkedScan outcome;
  outcome.id = files.id;
  outcome.file = files.mesh;
  const Places to = places(options, files.id);
  if (is_folder(options) && is_by_hand(to.landmarks)) {
    outcome.found = outcome.by_hand = true;
    return outcome;
  }
  Scan scan;
  FindLandmarksResult result;
  try {
    ScanOptions intake = options.scan;
    intake.reference = &reference;
    intake.frame.threads = threads;
    scan = load_scan(files, intake);
    outcome.units = scan.units_reason;
    FindLandmarksOptions find = options.find;
    find.threads = threads;
    result = pool.find(scan, find);
    outcome.summary = result.summary;
    outcome.found = result.summary.found;
    outcome.reason = result.summary.reason;
  } catch (const std::exception& e) {
    outcome.reason = e.what();
  }
  if (!outcome.found) {
    write_failure(outcome, scan, to);
    return outcome;
  }
  Landmarks marks = as_in_file(scan, result.landmarks, options.deviations);
  if (is_numbered(to.landmarks)) std::erase_if(marks, [](const auto& mark) { return is_extra(mark.first); });
  write_found_landmarks(to.landmarks, marks);
  write_png(to.picture, landmark_picture(scan, result, describe(outcome), threads));
  std::error_code ignored;
  fs::remove(to.problem, ignored);
  return outcome;
}

std::string table(const std::vector<LandmarkedScan>& scans) {
  std::string text = csv_line({"id", "file", "found", "method", "pose_score", "face_seen", "detected", "dropped",
                               "leave_one_out_mm", "matched", "asymmetry_mm", "note"});
  for (const LandmarkedScan& o : scans) {
    const FindLandmarksSummary& s = o.summary;
    text += csv_line({o.id, o.file.string(), o.found ? "1" : "0", o.by_hand ? "by hand" : s.method,
                      number("%.3f", s.pose_score), s.face_seen ? "1" : "0", std::to_string(s.detected),
                      std::to_string(s.dropped.size()), number("%.2f", s.leave_one_out_rms), number("%.3f", s.matched),
                      number("%.2f", s.asymmetry), o.found ? s.doubt : o.reason});
  }
  return text;
}

}  // namespace

std::vector<ScanFiles> list_scans(const std::vector<fs::path>& inputs) {
  std::vector<ScanFiles> scans;
  for (const fs::path& input : inputs) {
    if (fs::is_directory(input)) {
      for (ScanFiles& files : find_scans(input)) scans.push_back(std::move(files));
    } else {
      scans.push_back(files_of_scan(input));
    }
  }
  std::stable_sort(scans.begin(), scans.end(), [](const ScanFiles& a, const ScanFiles& b) { return a.id < b.id; });
  for (size_t i = 1; i < scans.size(); ++i)
    if (scans[i].id == scans[i - 1].id)
      throw InvalidInput("landmark-scan: two scans are called '" + scans[i].id + "' (" + scans[i - 1].mesh.string() +
                         " and " + scans[i].mesh.string() + "); rename one");
  if (scans.empty()) throw InvalidInput("landmark-scan: no scans to look at");
  return scans;
}

LandmarkScansSummary landmark_scans(const LandmarkScansOptions& options, const Progress& progress) {
  std::vector<ScanFiles> files = list_scans(options.inputs);
  for (ScanFiles& scan : files) scan.landmarks.reset();  // found, not read
  check_output(options, files);
  check_format(options);
  const MultiresTemplate reference =
      options.reference.empty() ? default_reference() : build_template(load_reference_file(options.reference));
  LandmarkScansSummary summary;
  ScanLandmarker first = make_scan_landmarker(reference, options.reference.empty(), options.method, options.predictor);
  summary.used_pictures = first.uses_pictures();
  LandmarkerPool pool(std::move(first));
  const int n = static_cast<int>(files.size()), jobs = options.jobs > 0 ? options.jobs : hardware_threads();
  const int threads = std::max(1, jobs / n);  // of one scan
  summary.scans.resize(files.size());
  std::mutex mutex;
  int done = 0;
  parallel_for(n, jobs, [&](int i) {
    summary.scans[static_cast<size_t>(i)] =
        landmark_one(files[static_cast<size_t>(i)], options, reference, threads, pool);
    const std::lock_guard lock(mutex);
    ++done;
    if (progress) progress({"landmarks", done, n, files[static_cast<size_t>(i)].id});
  });
  for (const LandmarkedScan& o : summary.scans)
    ++(o.by_hand ? summary.by_hand : o.found ? summary.found : summary.failed);
  if (is_folder(options)) write_file(options.output / "landmarks.csv", table(summary.scans));
  return summary;
}

}  // namespace facewright
