// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/building/gain_balance.h"
#include "libmodel/core/similarity.h"
#include "libregister/intake/scan.h"
#include "libregister/registration/register_scan.h"
#include "libregister/subdivision/hierarchy.h"

namespace facewright {

/// What decides which edges the adaptive levels split first: how far registered faces deviate from the coarser surface,
/// the reference's edge length and bend, or its edge length alone.
enum class LevelCriterion { deviation, bend, length };
const char* criterion_name(LevelCriterion criterion);

/// What a build does, in order; the results of a stage lie in OUT, where the next one finds them.
enum class BuildStage { landmarks, levels, registration, model };

/// Scan number i (from 0, in order of id) belongs to part 1 + i % count. Count 0: all scans.
struct BuildPart {
  int number = 0, count = 0;
  bool holds(size_t scan) const {
    return count == 0 || static_cast<int>(scan % static_cast<size_t>(count)) + 1 == number;
  }
};

/// Everything `build-model` can be told.
struct BuildPipelineOptions {
  std::filesystem::path scans;           ///< folder of scans with their landmarks, or a manifest (a file)
  std::filesystem::path output;          ///< folder to make; see docs/file-formats.md for what it will hold
  int jobs = 0;                          ///< scans registered at once, 0 = all cores; does not change a byte
  double memory = 0;                     ///< 10^9 bytes to keep within, 0 = no limit: jobs, and how scans are gathered
  std::uint64_t seed = 1;                ///< of the pictures' random faces
  bool resume = false;                   ///< keep scans whose inputs and options are unchanged since an earlier run
  BuildStage until = BuildStage::model;  ///< the last stage that is done
  BuildPart part;  ///< of the scans, to be done here: for runs side by side; only until landmarks or registration
  bool find_landmarks = true;  ///< on scans that lack some or all; false: use what is given
  ScanOptions scan;
  RegisterOptions registration;
  std::filesystem::path reference;            ///< a user's reference file or mesh, or empty: the built-in face
  std::filesystem::path reference_landmarks;  ///< landmarks of that mesh; empty: a reference file
  LevelCriterion criterion = LevelCriterion::deviation;
  /// Register to the mean of the faces that decide the levels instead of the reference's own shape.
  bool mean_as_reference = true;
  bool symmetric = true;  ///< false: left and right are refined independently, even if the reference is symmetric
  std::vector<int> levels = kSurreyLevels;       ///< vertex budgets of the model's levels
  double variance_share = 0.99;                  ///< of shape and colour kept in the model [huber2016]
  Scaling scaling = Scaling::fixed;              ///< free: size is no part of the shape
  GainBalance gain_balance = GainBalance::none;  ///< of the scans' colours
  double prune_quantile = 0;         ///< of chi-squared beyond which a shape is left out [booth2016]; 0: never
  std::vector<std::string> exclude;  ///< ids of scans to leave out of the model
  std::string terms;                 ///< licence and consent, for the model card
  int least_scans = 3;               ///< fewer registered scans than this make no model

  bool has_manifest() const { return std::filesystem::is_regular_file(scans); }
};

}  // namespace facewright
