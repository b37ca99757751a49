// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/similarity.h"
#include "libmodel/core/stage_clock.h"

namespace facewright {

enum class LandmarkMethod {
  automatic,  ///< pictures where dlib is there, geometry otherwise
  pictures,   ///< dlib's predictor on rendered views
  geometry,   ///< the shape alone
};
/// "auto", "dlib" or "geometry"; throws InvalidInput.
LandmarkMethod landmark_method_from_name(const std::string& name);

struct FindLandmarksOptions {
  bool use_colour = true;    ///< false: the pictures show clay, whatever the scan has
  bool refine = true;        ///< register the coarse reference and read all landmarks off it
  int picture_size = 640;    ///< pixels, 320 .. 2048: width and height of the rendered views
  double least_pose = 0.45;  ///< 0..1, CoarsePose::score: below it there is no face on the scan
  int threads = 1;           ///< 0 = all; the landmarks do not depend on it
  /// Where the head is (mm), known to 35 degrees and 50 mm, if it is known: faces elsewhere on the surface are none.
  std::optional<Similarity> scan_from_head = std::nullopt;
};

struct FindLandmarksSummary {
  bool found = false;
  std::string reason;      ///< why not, and what to do
  std::string method;      ///< "pictures" or "geometry"
  double pose_score = 0;   ///< 0..1, share of the face pattern that lies on the scan
  bool face_seen = false;  ///< the detector sees a face in the front view, where the geometry puts it
  double detector_score = 0;
  double likeness = 0;               ///< -1..1, geometry: correlation of the whole face's relief
  int views = 0;                     ///< pictures landmarks were found in
  int detected = 0;                  ///< landmarks found on the scan, before the template's are read off
  std::vector<std::string> dropped;  ///< detected ones that the others contradict
  double leave_one_out_rms = 0;      ///< mm: how well the detected landmarks foretell each other
  double matched = 0;                ///< 0..1, share of the template that found the scan's surface
  double asymmetry = 0;              ///< mm: rms of left-right differences of the landmarks about their mirror plane
  std::string doubt;                 ///< why a person should look at it; empty: nothing wrong
  StageSeconds seconds;
};

struct FindLandmarksResult {
  Landmarks landmarks;  ///< mm, the scan's own frame, with deviations; empty if not found
  Landmarks detected;   ///< what was seen before the template's landmarks were read off
  Similarity scan_from_head;
  FindLandmarksSummary summary;
};

/// Finds the landmarks of face scans in any orientation, millimetres. The method in words: docs/landmarking.md. Makes
/// a detector and pictures of the reference once (a second), then costs some seconds a scan; one per thread: copy().
class ScanLandmarker {
 public:
  /// `predictor`: see FaceDetector. With `automatic` a missing dlib or predictor means geometry; with `pictures` it is
  /// an error (InvalidInput, IoError).
  /// `reference_colours` (N x 3, of the finest level) or empty: pictures of it show what the predictor finds on
  /// coloured faces, which differs from clay about the eyes and brows.
  ScanLandmarker(const MultiresTemplate& reference, LandmarkMethod method = LandmarkMethod::automatic,
                 const std::filesystem::path& predictor = {}, const Colours& reference_colours = {});
  ~ScanLandmarker();
  ScanLandmarker(ScanLandmarker&&) noexcept;
  ScanLandmarker& operator=(ScanLandmarker&&) noexcept;

  /// `texture` belongs to mesh.uv, may be empty. No face is no error: the summary says so. Throws InvalidInput for an
  /// invalid mesh.
  FindLandmarksResult find(const Mesh& mesh, const Image& texture, const FindLandmarksOptions& options = {});
  ScanLandmarker copy() const;
  bool uses_pictures() const;

 private:
  struct Parts;
  struct Search;
  explicit ScanLandmarker(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace facewright
