// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/relief_pose.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include "libmodel/core/parallel.h"
#include "libregister/landmarking/relief.h"

namespace facewright {
namespace {

constexpr double kPixel = 2;                            // mm
constexpr ReliefOptions kWide{4, 35, 30};               // the nose stands out of the face, not only its wings
constexpr PatchMatchOptions kWhole{40, 40, 0.15, 0.2};  // from brows to chin
constexpr double kHeights[] = {0.84, 0.92, 1, 1.08, 1.16};
constexpr double kHeightDeviation = 0.16, kHeightPenalty = 0.1;  // of ln(height); of the correlation, at one deviation
constexpr double kNods[] = {-12, -6, 0, 6, 12};                  // degrees

Similarity nodded(const Similarity& S, double angle, const Eigen::Vector3d& centre) {
  Similarity turned = S;
  turned.R = S.R * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()).toRotationMatrix();
  turned.t += S * centre - turned * centre;
  return turned;
}

FaceViewOptions in_pixels(FaceViewOptions view) {
  view.size = static_cast<int>(std::lround(view.field / kPixel));
  view.field = kPixel * view.size;
  return view;
}

// How far the scan lies before the pattern, in the middle: the median over the pixels that show both.
double gap(const Raster& scan, const Raster& pattern, const Eigen::Vector2d& middle, const Eigen::Vector2d& offset) {
  constexpr double kRadius = 60;  // mm
  const int dx = static_cast<int>(std::lround(offset.x())), dy = static_cast<int>(std::lround(offset.y()));
  std::vector<double> gaps;
  for (int y = 0; y < pattern.height; ++y)
    for (int x = 0; x < pattern.width; ++x) {
      if (!scan.inside(x + dx, y + dy) || (Eigen::Vector2d(x, y) - middle).norm() * kPixel > kRadius) continue;
      const size_t i = pattern.index(x, y), j = scan.index(x + dx, y + dy);
      if (pattern.triangle[i] >= 0 && scan.triangle[j] >= 0) gaps.push_back(scan.depth[j] - pattern.depth[i]);
    }
  if (gaps.empty()) return 0;
  const auto at = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), at, gaps.end());
  return *at;
}

struct Scored {
  ReliefPose pose;
  double score = -2;
};

// The best height and place of a face that looks where S looks.
Scored lay_upright(const Mesh& scan, const Mesh& reference, const Similarity& S, const FaceViewOptions& view) {
  const OrthographicCamera camera = view_camera(S, {}, view);
  const RasterOptions size{view.size, view.size};
  const Raster seen = rasterize(scan.V, scan.F, camera.affine(), size);
  const Relief scan_relief = relief(seen, kPixel, 1 / S.s, kWide);
  const Eigen::Vector2d middle = camera.affine().project(S * view.centre);
  Scored best;
  for (const double height : kHeights) {
    Vertices V = reference.V;
    V.col(1) = (height * (V.col(1).array() - view.centre.y()) + view.centre.y()).matrix();
    V = S.apply(V);
    const Raster pattern = rasterize(V, reference.F, camera.affine(), size);
    const auto match = match_relief(relief(pattern, kPixel, 1 / S.s, kWide), scan_relief, middle, kPixel, kWhole);
    if (!match) continue;
    const double far = match->offset.norm() * kPixel / kWhole.reach, odd = std::log(height) / kHeightDeviation;
    const double score = match->correlation - kWhole.penalty * far * far - kHeightPenalty * odd * odd;
    if (score <= best.score) continue;
    const Eigen::Vector3d move(S.s * kPixel * match->offset.x(), -S.s * kPixel * match->offset.y(),
                               gap(seen, pattern, middle, match->offset));
    const Eigen::Vector3d shift = camera.R.transpose() * move;
    best = {{{S.s, S.R, S.t + shift}, height, match->correlation, V.rowwise() + shift.transpose()}, score};
  }
  return best;
}

}  // namespace

ReliefPose lay_by_relief(const Mesh& scan, const Mesh& reference, const Similarity& scan_from_head,
                         const FaceViewOptions& view) {
  const FaceViewOptions coarse = in_pixels(view);
  std::vector<Scored> nods(std::size(kNods));
  parallel_for(static_cast<int>(nods.size()), view.threads, [&](int i) {
    const Similarity S = nodded(scan_from_head, kNods[i] * std::numbers::pi / 180, view.centre);
    nods[static_cast<size_t>(i)] = lay_upright(scan, reference, S, coarse);
  });
  const Scored& best =
      *std::max_element(nods.begin(), nods.end(), [](const Scored& a, const Scored& b) { return a.score < b.score; });
  if (best.score > -2) return best.pose;
  return {scan_from_head, 1, -1, scan_from_head.apply(reference.V)};
}

double relief_likeness(const Mesh& scan, const Mesh& laid, const Similarity& scan_from_head,
                       const FaceViewOptions& view) {
  const FaceViewOptions coarse = in_pixels(view);
  const OrthographicCamera camera = view_camera(scan_from_head, {}, coarse);
  const RasterOptions size{coarse.size, coarse.size};
  const auto relief_of = [&](const Mesh& mesh) {
    return relief(rasterize(mesh.V, mesh.F, camera.affine(), size), kPixel, 1 / scan_from_head.s, kWide);
  };
  PatchMatchOptions here = kWhole;
  here.reach = 1;  // not even a pixel
  const Eigen::Vector2d middle = camera.affine().project(scan_from_head * view.centre);
  const auto match = match_relief(relief_of(laid), relief_of(scan), middle, kPixel, here);
  return match ? match->correlation : -1;
}

}  // namespace facewright
