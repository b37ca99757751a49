// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

/// Orders landmark names as people do: "2" before "10", numbers before words.
struct LandmarkNameOrder {
  bool operator()(const std::string& a, const std::string& b) const;
};

/// A landmark in D dimensions. 3D: millimetres. 2D: pixels, the centre of the top-left pixel is (0, 0), y down.
template <int D>
struct LandmarkPoint {
  Eigen::Matrix<double, D, 1> position = Eigen::Matrix<double, D, 1>::Zero();
  double stddev = 0;  ///< isotropic standard deviation, 0 = unknown
};

/// Name -> point. Names are the ibug-68 indices "1".."68" plus named extras.
using Landmarks = std::map<std::string, LandmarkPoint<3>, LandmarkNameOrder>;
using ImageLandmarks = std::map<std::string, LandmarkPoint<2>, LandmarkNameOrder>;

/// A landmark marked on a mesh: a surface point, and the vertex where one coincides (-1 elsewhere).
struct MeshLandmark {
  SurfacePoint point;
  int vertex = -1;
};
/// Landmarks of a reference face or model: name -> place on its mesh.
using LandmarkSet = std::map<std::string, MeshLandmark, LandmarkNameOrder>;

/// Positions of marked landmarks on the mesh (V, F).
Landmarks locate(const LandmarkSet& marks, const Vertices& V, const Faces& F);

/// The ibug-68 name of the landmark mirrored across the midline ("37" -> "46"); named extras swap a "left"/"right"
/// prefix or suffix ("left_gonion" -> "right_gonion"); anything else, midline points included, returns itself.
std::string mirrored_landmark(const std::string& name);

/// Names present in both, in landmark order.
std::vector<std::string> common_names(const Landmarks& a, const Landmarks& b);

}  // namespace facewright
