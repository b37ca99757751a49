// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/core/stage_clock.h"
#include "libregister/registration/appearance_guide.h"
#include "libregister/registration/conform.h"
#include "libregister/registration/denoise.h"
#include "libregister/registration/global_mapping.h"
#include "libregister/registration/matching.h"

namespace facewright {

/// How one resolution level is conformed: values go geometrically from `first` to `last` over the iterations.
struct LevelSchedule {
  int iterations = 3;
  double smoothing_first = 2, smoothing_last = 1;  ///< mm, ConformOptions::smoothing_length
  double welsch_first = 2, welsch_last = 1;        ///< mm, MatchOptions::welsch_width
  double highest_distance = 5;                     ///< mm, MatchOptions::highest_distance
  double highest_angle_deg = 45;                   ///< degrees, MatchOptions::highest_angle
  double landmark_weight = 0.1;                    ///< ConformOptions::landmark_weight
  bool move_rest = false;  ///< each iteration starts from the last result instead of the level's first shape
};

/// The schedule of the built-in reference's four levels: docs/registration.md has the sweep behind it.
std::vector<LevelSchedule> default_schedule();

struct RegisterOptions {
  DenoiseOptions denoise;
  AlignOptions align;
  GlobalMapOptions global;
  std::vector<LevelSchedule> levels = default_schedule();  ///< one per level; the last is reused for further levels
  double landmark_stddev = 1.0;  ///< mm, where a landmark has none of its own: manual placement repeats to 1-2 mm
  int guide_rounds = 3;          ///< how often colour is looked at, if there is a guide
  bool use_mirror = true;        ///< mirror fallback in matching
  bool match_vertices = false;   ///< match to scan vertices instead of the surface (literal IMDR)
  bool keep_stages = false;      ///< keep the mesh after every stage
};

/// What is reported of one registration.
struct RegisterSummary {
  DenoiseSummary denoise;
  double scale = 1;  ///< scan over reference
  int landmarks_used = 0;
  std::vector<std::string> landmarks_rejected;
  bool swapped_left_right = false;
  double leave_one_out_rms = 0;  ///< mm, of the landmarks: how well the others foretell one
  double landmark_noise = 0;     ///< mm, estimated; 0: too few landmarks to tell
  int guided = 0;                ///< places found by their colour
  int matched = 0, mirrored = 0, interpolated = 0, free = 0;  ///< vertices of the finest level
  std::array<int, kMatchStatusCount> match_status{};          ///< vertices per MatchStatus in the last iteration
  double surface_mean = 0, surface_p95 = 0;                   ///< mm, matched vertices to the denoised scan
  double landmark_mean = 0, landmark_max = 0;                 ///< mm, at the landmarks used
  int folds = 0;                                              ///< folded edges of the finest level
  double fold_percent = 0;                                    ///< share of interior edges
  bool acceptable = true;                                     ///< false: see `concern`
  std::string concern;                                        ///< why a person should look at it
  StageSeconds seconds;                                       ///< wall time per stage, in their order
};

struct RegistrationStage {
  std::string name;
  Mesh mesh;
};

struct RegistrationResult {
  Vertices V;                         ///< (N x 3) finest level, the scan's frame, mm
  std::vector<MatchOrigin> origins;   ///< (N)
  std::vector<NearestPoint> nearest;  ///< (N) places on the denoised scan
  Eigen::VectorXd visibility;         ///< (N) 0..1, weight of the last match
  Landmarks landmarks;                ///< the scan's landmarks as used
  Mesh denoised;                      ///< the scan after denoising
  RegisterSummary summary;
  std::vector<RegistrationStage> stages;
};

/// IMDR registration of one scan (millimetres) to the reference: denoising, global mapping, then per level local
/// matching and conformation, and 4-8 refinement to the next level. [tena2006, huber2016] Throws InvalidInput when the
/// landmarks do not show a face; poor quality is told in the summary. With a guide and vertex colours, places found by
/// their colour join the landmarks.
RegistrationResult register_scan(const Mesh& scan, const Landmarks& landmarks, const MultiresTemplate& reference,
                                 const RegisterOptions& options = {}, const AppearanceGuide* guide = nullptr);

}  // namespace facewright
