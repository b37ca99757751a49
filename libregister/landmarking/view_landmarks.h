// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libregister/landmarking/face_view.h"
#include "libregister/landmarking/image_landmarks.h"

namespace facewright {

/// What the predictor finds on pictures of the reference face itself from one side: its own convention.
struct ViewCalibration {
  ViewAngle angle;
  FaceBox box;       ///< pixels: where the detector sees the reference's face
  Landmarks places;  ///< head frame, mm: what it takes for each landmark
};

/// The sides from which a face is looked at.
std::vector<ViewAngle> default_view_angles();

/// Calibrations of all sides on the reference's mesh and landmarks (head frame); sides on which too little is found are
/// left out. Empty if the detector finds no face from the front.
std::vector<ViewCalibration> calibrate_views(FaceDetector& detector, const Mesh& reference, const Landmarks& marks,
                                             const std::vector<ViewAngle>& angles, const FaceViewOptions& options);

/// Whether the detector sees a face in the front view, and how far its box is from where the reference's would be.
struct FrontCheck {
  bool seen = false;
  double score = 0;   ///< of the detector
  double offset = 0;  ///< between the boxes' middles, in sizes of the calibrated one
  double scale = 1;   ///< size over calibrated size
};
FrontCheck check_front(FaceDetector& detector, const FaceView& front, const ViewCalibration& calibration);

/// The predictor's answers scatter with the box it is given; they are averaged over several boxes.
enum class Care {
  quick,    ///< five boxes
  thorough  ///< fifteen, on the picture and on its mirror image
};

/// The landmarks seen in one view, put on the surface, each moved by what the reference's own landmark differs from
/// what was found on the reference: the reference's convention.
Landmarks landmarks_in_view(const FaceDetector& detector, const FaceView& view, const Mesh& mesh,
                            const ViewCalibration& calibration, const Landmarks& marks,
                            const Similarity& scan_from_head, Care care);

/// Landmarks seen in several views fused by their geometric median [weiszfeld1937]. Deviations, over the three axes:
/// what the views stated or `floor` (mm), which they share, and what they differ by.
Landmarks fuse_views(const std::vector<Landmarks>& views, double floor);

}  // namespace facewright
