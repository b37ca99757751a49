// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/semilandmarks.h"

#include <Eigen/Geometry>

namespace facewright {
namespace {

// Jaw, brows, lids, outer and inner lips, each from one landmark that stays to the next.
const std::vector<std::vector<int>> kCurves = {
    {1, 2, 3, 4, 5, 6, 7, 8, 9},
    {9, 10, 11, 12, 13, 14, 15, 16, 17},
    {18, 19, 20, 21, 22},
    {23, 24, 25, 26, 27},
    {37, 38, 39, 40},
    {40, 41, 42, 37},
    {43, 44, 45, 46},
    {46, 47, 48, 43},
    {49, 50, 51, 52},
    {52, 53, 54, 55},
    {55, 56, 57, 58, 59, 60, 49},
    {61, 62, 63, 64, 65},
    {65, 66, 67, 68, 61},
};

}  // namespace

std::map<std::string, Eigen::Vector3d> landmark_curve_tangents(const Landmarks& landmarks) {
  std::map<std::string, Eigen::Vector3d> tangents;
  for (const std::vector<int>& curve : kCurves)
    for (size_t i = 1; i + 1 < curve.size(); ++i) {
      const auto before = landmarks.find(std::to_string(curve[i - 1]));
      const auto after = landmarks.find(std::to_string(curve[i + 1]));
      if (before == landmarks.end() || after == landmarks.end()) continue;
      const Eigen::Vector3d d = after->second.position - before->second.position;
      if (d.norm() > 1e-6) tangents[std::to_string(curve[i])] = d.normalized();
    }
  return tangents;
}

void add_semilandmark(const Eigen::Vector3d& point, const Eigen::Vector3d& displacement, const Eigen::Vector3d& tangent,
                      double stddev, double slide, std::vector<SplineDatum>* data) {
  const Eigen::Vector3d a = tangent.unitOrthogonal(), b = tangent.cross(a);
  data->push_back({point, tangent, tangent.dot(displacement), slide * stddev});
  data->push_back({point, a, a.dot(displacement), stddev});
  data->push_back({point, b, b.dot(displacement), stddev});
}

}  // namespace facewright
