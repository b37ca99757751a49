// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

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
/// As digits, 0 to 9, and back.
std::string weight_digits(const Eigen::VectorXd& weights);
Eigen::VectorXd weights_from_digits(const std::string& digits);

/// One letter per vertex: m matched, r mirrored, i interpolated, f free.
std::string origin_letters(const std::vector<MatchOrigin>& origins);

}  // namespace facewright
