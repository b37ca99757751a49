// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libregister/intake/scan.h"
#include "libregister/registration/register_scan.h"

namespace facewright {

/// How a scan's registration went, as JSON text (the layout of OUT/scans/ID.json, docs/file-formats.md).
std::string describe_registration(const Scan& scan, const RegisterSummary& summary);

/// The same for people: a few lines on what was mended, used, rejected and found, and how long it took.
std::string summarise_registration(const RegisterSummary& summary);

/// The registered mesh on the finest level with the scan's colours, if it has any.
Mesh coloured_registration(const Scan& scan, const RegistrationResult& result, const Faces& F);

/// How far the colour of each registered vertex can be trusted, (N) 0..1: colour_reliability where it was matched, 0
/// elsewhere.
Eigen::VectorXd colour_weights(const RegistrationResult& result, const Faces& F);
/// As digits, 0 to 9.
std::string weight_digits(const Eigen::VectorXd& weights);
/// One letter per vertex: m matched, r mirrored, i interpolated, f free.
std::string origin_letters(const std::vector<MatchOrigin>& origins);

/// What the two wrote, for a mesh of `vertices`: colour weights, (N) 0..1, and 1 where a vertex was matched, else 0.
/// Throw IoError for another number of characters.
Eigen::VectorXd read_colour_weights(const std::filesystem::path& file, Eigen::Index vertices);
Eigen::VectorXd read_matched(const std::filesystem::path& file, Eigen::Index vertices);

}  // namespace facewright
