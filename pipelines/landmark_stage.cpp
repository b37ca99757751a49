// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/landmark_stage.h"

#include <map>
#include <mutex>
#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/landmark_names.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/sha256.h"
#include "pipelines/landmark_picture.h"
#include "pipelines/landmark_record.h"
#include "pipelines/landmarker_pool.h"
#include "pipelines/scan_stage.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

// Errors of landmarks that were found are alike in places that lie together, so that many of them tell less than as
// many independent ones: by so much less is each trusted. Swept on simulated scans (docs/landmarking.md).
constexpr double kDependence = 6;
constexpr int kFirstInner = 18, kLastInner = 68;  // of ibug's; the jaw before them has no points of its own

bool has_all(const Landmarks& landmarks) {
  for (int i = kFirstInner; i <= kLastInner; ++i)
    if (landmarks.count(std::to_string(i)) == 0) return false;
  return true;
}

std::string key_of(const ScanFiles& files, const BuildPipelineOptions& options) {
  std::string material =
      std::string(FACEWRIGHT_VERSION) + sha256(read_file(files.mesh)) + std::to_string(static_cast<int>(files.units)) +
      std::to_string(static_cast<int>(options.scan.units)) + file_axis_name(options.scan.frame.up) +
      file_axis_name(options.scan.frame.front) + std::to_string(static_cast<int>(options.scan.frame.handedness));
  if (const auto texture = texture_file(files.mesh)) material += sha256(read_file(*texture));
  if (files.landmarks) material += sha256(read_file(*files.landmarks));
  for (const fs::path& file :
       {options.reference, options.reference_landmarks, options.scan.landmark_names.value_or(fs::path())})
    if (!file.empty()) material += sha256(read_file(file));
  return sha256(material);
}

// The landmarks that are missing from the scan's own, found; in the file's units.
Landmarks completed(const ScanFiles& files, const BuildPipelineOptions& options, const MultiresTemplate& reference,
                    LandmarkerPool& pool, const fs::path& picture) {
  ScanOptions intake = options.scan;
  if (!files.landmarks) intake.reference = &reference;  // else they tell
  const Scan scan = load_scan(files, intake);
  if (scan.frame && scan.frame->mirrored)
    throw InvalidInput(
        "the scan's axes are left-handed: " + scan.units_reason +
        ". Mirror the file (negate one coordinate and turn its triangles over) and its texture stays right");
  const FindLandmarksResult result = pool.find(scan, {});
  std::vector<std::string> text = {files.id};
  if (!result.summary.found) text.push_back(result.summary.reason);
  if (!result.summary.doubt.empty()) text.push_back("to be looked at: " + result.summary.doubt);
  write_png(picture, landmark_picture(scan, result, text));
  if (!result.summary.found) throw InvalidInput(result.summary.reason);
  Landmarks all = scan.landmarks;
  for (auto [name, mark] : result.landmarks) {
    if (name.find_first_not_of("0123456789") != name.npos) continue;  // cheeks and foreheads have no marks of their own
    mark.stddev *= kDependence;
    all.emplace(name, mark);
  }
  for (auto& [name, mark] : all) {
    mark.position /= scan.mm_per_unit;
    mark.stddev /= scan.mm_per_unit;
  }
  return all;
}

enum class Standing { given, by_hand, kept, in_vain, wanted };

// What a scan has already.
Standing standing_of(const ScanFiles& files, const std::string& key, const BuildPipelineOptions& options,
                     const OutputTree& tree) {
  const fs::path file = tree.landmarks(files.id);
  if (is_by_hand(file)) return Standing::by_hand;
  const auto record = landmark_record(file);
  if (options.resume && record && record->key == key) {
    if (!record->reason.empty()) return Standing::in_vain;
    if (fs::exists(file)) return Standing::kept;
  }
  if (!files.landmarks) return Standing::wanted;
  Landmarks own = read_landmarks(*files.landmarks);
  if (options.scan.landmark_names) own = rename_landmarks(own, read_landmark_names(*options.scan.landmark_names));
  return has_all(own) ? Standing::given : Standing::wanted;
}

}  // namespace

LandmarkStageSummary landmark_stage(std::vector<ScanFiles>* files, const ReferenceFace& reference,
                                    const BuildPipelineOptions& options, const OutputTree& tree,
                                    const Progress& progress) {
  LandmarkStageSummary summary;
  std::vector<std::pair<ScanFiles*, std::string>> wanted;  // and their keys
  const auto take_from_output = [&](ScanFiles& f) { f.landmarks = tree.landmarks(f.id), f.has_our_names = true; };
  for (ScanFiles& f : *files) {
    std::string key;
    Standing standing = Standing::given;  // a scan that cannot be read is for its registration to explain
    try {
      key = key_of(f, options);
      standing = standing_of(f, key, options, tree);
    } catch (const IoError&) {
    } catch (const InvalidInput&) {
    }
    const bool has_own = f.landmarks.has_value();
    if (standing == Standing::by_hand || standing == Standing::kept) take_from_output(f);
    if (standing == Standing::given) ++summary.given;
    if (standing == Standing::by_hand) ++summary.by_hand;
    if (standing == Standing::kept) ++(has_own ? summary.completed : summary.found);
    if (standing == Standing::wanted) wanted.emplace_back(&f, key);
    if (standing == Standing::in_vain && !has_own) summary.failed[f.id] = landmark_record(tree.landmarks(f.id))->reason;
  }
  if (wanted.empty()) return summary;

  const MultiresTemplate face = options.reference.empty() ? default_reference() : build_template(reference);
  LandmarkerPool pool(make_scan_landmarker(face, options.reference.empty(), LandmarkMethod::automatic));
  std::mutex mutex;
  const int total = static_cast<int>(wanted.size());
  int done = 0;
  if (progress) progress({"landmarks", 0, total, ""});
  parallel_for(total, options.jobs, [&](int i) {
    ScanFiles& scan = *wanted[static_cast<size_t>(i)].first;
    const std::string& key = wanted[static_cast<size_t>(i)].second;
    const fs::path file = tree.landmarks(scan.id);
    Landmarks marks;
    std::string reason;
    try {
      marks = completed(scan, options, face, pool, tree.landmark_picture(scan.id));
    } catch (const InvalidInput& error) {
      reason = error.what();
    } catch (const IoError& error) {
      reason = error.what();
    }
    if (reason.empty()) {
      write_found_landmarks(file, marks, key);
    } else {
      write_search_in_vain(file, reason, key);
      write_png(tree.landmark_picture(scan.id), failure_picture(scan.mesh, {scan.id + ": no landmarks", reason}));
    }
    const std::lock_guard lock(mutex);
    if (reason.empty()) {
      ++(scan.landmarks ? summary.completed : summary.found);
      take_from_output(scan);
    } else if (!scan.landmarks) {
      summary.failed[scan.id] = reason;
    }
    if (progress) progress({"landmarks", ++done, total, scan.id + (reason.empty() ? "" : ": " + reason)});
  });
  return summary;
}

}  // namespace facewright
