// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/symmetrise.h"

#include <cmath>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

// Half the sum of every row and its partner's reflection, made so that partners agree to the last bit.
Vertices mean_with_image(const Vertices& V, const std::vector<int>& mirror) {
  Vertices S = V;
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    const int m = mirror[static_cast<size_t>(v)];
    if (m < v) continue;
    const Eigen::RowVector3d image(-V(m, 0), V(m, 1), V(m, 2));
    S.row(v) = 0.5 * (V.row(v) + image);
    S.row(m) << -S(v, 0), S(v, 1), S(v, 2);
    if (m == v) S(v, 0) = 0;
  }
  return S;
}

}  // namespace

SymmetricFace symmetrise(const Vertices& registered, const Vertices& neutral, const std::vector<int>& mirror,
                         const Eigen::VectorXd& weights) {
  if (registered.rows() != neutral.rows() || weights.size() != neutral.rows() ||
      static_cast<Eigen::Index>(mirror.size()) != neutral.rows())
    throw InvalidInput(
        "symmetrise: the registered face, the reference, the mirror table and the weights must have one "
        "row per vertex; a reference without left-right symmetry cannot be used");
  constexpr int most_rounds = 100;
  SymmetricFace face;
  face.head_from_scan = fit_similarity(registered, neutral, weights, Scaling::fixed);
  Vertices in_head = face.head_from_scan.apply(registered);
  for (int round = 0; round < most_rounds; ++round) {
    face.V = mean_with_image(in_head, mirror);
    const Similarity step = fit_similarity(in_head, face.V, weights, Scaling::fixed);
    face.head_from_scan = step * face.head_from_scan;
    in_head = face.head_from_scan.apply(registered);
    if ((step.R - Eigen::Matrix3d::Identity()).norm() < 1e-9 && step.t.norm() < 1e-7) break;
  }
  face.V = mean_with_image(in_head, mirror);
  face.rms = std::sqrt(weights.dot((in_head - face.V).rowwise().squaredNorm()) / weights.sum());
  return face;
}

bool is_midline_landmark(const std::string& name, const Eigen::Vector3d& position, double reach) {
  return mirrored_landmark(name) == name && std::abs(position.x()) < reach;
}

Landmarks symmetrise(const Landmarks& landmarks) {
  Landmarks result = landmarks;
  for (const auto& [name, mark] : landmarks) {
    const std::string twin = mirrored_landmark(name);
    Eigen::Vector3d p = mark.position;
    if (twin == name) {
      if (is_midline_landmark(name, p)) p.x() = 0;
      result[name].position = p;
      continue;
    }
    if (const auto other = landmarks.find(twin); other != landmarks.end()) {
      const Eigen::Vector3d q = other->second.position;
      p = 0.5 * (p + Eigen::Vector3d(-q.x(), q.y(), q.z()));
    }
    result[name].position = p;
    result[twin].position = {-p.x(), p.y(), p.z()};
    result[twin].stddev = mark.stddev;
  }
  return result;
}

}  // namespace facewright
