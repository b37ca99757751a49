// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/landmark_checks.h"

#include <cmath>
#include <cstdio>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/similarity.h"

namespace facewright {
namespace {

std::string with_number(const char* format, double x) {
  char text[160];
  std::snprintf(text, sizeof text, format, x);
  return text;
}

}  // namespace

bool is_jaw_landmark(const std::string& name) {
  return !name.empty() && name.size() <= 2 && name.find_first_not_of("0123456789") == name.npos &&
         std::stoi(name) <= 17;
}

double landmark_asymmetry(const Landmarks& landmarks) {
  std::vector<Eigen::Vector3d> mirrored, there;
  for (const auto& [name, mark] : landmarks) {
    const auto twin = landmarks.find(mirrored_landmark(name));
    if (twin == landmarks.end()) continue;
    mirrored.emplace_back(-mark.position.x(), mark.position.y(), mark.position.z());
    there.push_back(twin->second.position);
  }
  if (there.size() < 3) return 0;
  const auto n = static_cast<Eigen::Index>(there.size());
  const Vertices A = Eigen::Map<const Vertices>(mirrored[0].data(), n, 3);
  const Vertices B = Eigen::Map<const Vertices>(there[0].data(), n, 3);
  try {
    const Similarity S = fit_similarity(A, B, Scaling::fixed);
    return std::sqrt((S.apply(A) - B).squaredNorm() / static_cast<double>(n));
  } catch (const InvalidInput&) {
    return 0;  // on a line
  }
}

void state_deviations(const Landmarks& detected, Landmarks* read) {
  constexpr double kAlike = 1, kUnseen = 3, kOutline = 5;  // mm; measured: docs/landmarking.md
  for (auto& [name, mark] : *read) {
    const auto seen = detected.find(name);
    const double known = is_jaw_landmark(name) ? kOutline : seen == detected.end() ? kUnseen : kAlike;
    const double off = seen == detected.end() ? 0 : (seen->second.position - mark.position).norm();
    mark.stddev = std::hypot(known, 0.5 * off);
  }
}

std::string landmark_failure(const FindLandmarksSummary& s) {
  constexpr int kLeast = 30;
  const int valid = s.detected - static_cast<int>(s.dropped.size());
  if (valid < kLeast)
    return "only " + std::to_string(valid) + " landmarks agree with each other and a face, " + std::to_string(kLeast) +
           " are needed; place landmarks by hand";
  if (s.matched < 0.5)
    return with_number("only %.0f %% of the face template found the scan's surface; is the scan cut off?",
                       100 * s.matched);
  return {};
}

std::string landmark_doubt(const FindLandmarksSummary& s) {
  std::string doubt;
  const auto add = [&](const std::string& what) { doubt += (doubt.empty() ? "" : "; ") + what; };
  const bool pictures = s.method == "pictures";
  if (pictures && !s.face_seen) add("the detector sees no face in the front view");
  if (s.pose_score < 0.5) add(with_number("the surface is little like a face (%.2f)", s.pose_score));
  if (!pictures && s.likeness < 0.6) add(with_number("the relief is little like a face's (%.2f)", s.likeness));
  if (s.leave_one_out_rms > (pictures ? 5 : 8))
    add(with_number("the landmarks foretell each other only to %.1f mm", s.leave_one_out_rms));
  if (s.asymmetry > 6) add(with_number("left and right differ by %.1f mm", s.asymmetry));
  if (s.matched < 0.75) add(with_number("%.0f %% of the template found the surface", 100 * s.matched));
  return doubt;
}

}  // namespace facewright
