// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/landmarks.h"
#include "libregister/landmarking/scan_landmarks.h"

namespace facewright {

/// True for ibug 1..17, the outline of the face: a line without places of its own.
bool is_jaw_landmark(const std::string& name);

/// Left-right difference of landmarks: rms distance of the mirror image, names exchanged and laid on, from them; mm.
/// 0 with fewer than three pairs.
double landmark_asymmetry(const Landmarks& landmarks);

/// Deviations for landmarks read off a template: what was detected at the place, and how far off it was, or a general
/// one where nothing was seen; more on the outline. Over the three axes, mm.
void state_deviations(const Landmarks& detected, Landmarks* read);

/// Why these landmarks cannot be used, or nothing.
std::string landmark_failure(const FindLandmarksSummary& summary);
/// Why a person should look at them, or nothing.
std::string landmark_doubt(const FindLandmarksSummary& summary);

}  // namespace facewright
