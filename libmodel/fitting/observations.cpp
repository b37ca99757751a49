// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/observations.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

namespace facewright {
namespace {

/// 1..17 for the ibug names of the jaw line, else 0.
int jaw_place(const std::string& name) {
  int number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool whole = error == std::errc() && end == name.data() + name.size();
  return whole && number >= 1 && number <= 17 ? number : 0;
}

/// Where a landmark stands on the outline of the face.
struct OutlinePlace {
  int jaw_place = 0;      ///< see Observation
  double share = -1;      ///< of the way from the ear to the chin if the mapping names it, else -1
  bool is_right = false;  ///< of the subject
};

OutlinePlace outline_place(const std::string& name, const ContourLandmarks& contour) {
  if (contour.right.empty() && contour.left.empty()) return {jaw_place(name)};
  for (const bool is_right : {true, false}) {
    const std::vector<std::string>& line = is_right ? contour.right : contour.left;
    const auto at = std::find(line.begin(), line.end(), name);
    if (at == line.end()) continue;
    const auto i = static_cast<double>(at - line.begin()), n = static_cast<double>(line.size());
    const double along = i / std::max(n - 1, 1.0);
    const int step = static_cast<int>(std::lround(7 * along));  // the jaw has eight places on each side of the chin
    return {(is_right ? 1 : 10) + step, is_right ? along : 1 - along, is_right};
  }
  return {};
}

/// The vertex of a contour landmark that the mapping gives none: the model's own of that name, or one as far along the
/// model's contour. It is where the search starts.
std::optional<int> vertex_on_contour(const OutlinePlace& place, const MorphableModel& model, const std::string& name) {
  if (const auto mark = model.landmarks().find(name); mark != model.landmarks().end()) return mark->second.vertex;
  const FaceContours contours = model.contours();
  const std::vector<int>& line = place.is_right ? contours.right : contours.left;
  if (line.empty()) return std::nullopt;
  const auto height = [&](int v) { return model.shape().mean[3 * v + 1]; };
  const double share = height(line.front()) > height(line.back()) ? place.share : 1 - place.share;
  return line[static_cast<size_t>(std::lround(share * static_cast<double>(line.size() - 1)))];
}

/// Index of the observation at each place of the jaw line, -1 where there is none.
std::array<int, 18> jaw_line(const std::vector<Observation>& seen) {
  std::array<int, 18> line{};
  line.fill(-1);
  for (size_t k = 0; k < seen.size(); ++k)
    if (seen[k].jaw_place > 0) line[static_cast<size_t>(seen[k].jaw_place)] = static_cast<int>(k);
  return line;
}

/// The nearest observed place on the jaw line from `place` in direction `step`, or -1.
int next_on_jaw(const std::array<int, 18>& line, int place, int step) {
  for (int p = place + step; p >= 1 && p <= 17; p += step)
    if (line[static_cast<size_t>(p)] >= 0) return line[static_cast<size_t>(p)];
  return -1;
}

}  // namespace

std::vector<Observation> observations(const ImageLandmarks& landmarks, const MorphableModel& model,
                                      const LandmarkMapper& mapper) {
  std::vector<Observation> seen;
  for (const auto& [name, mark] : landmarks) {
    if (!mark.position.allFinite()) continue;
    const OutlinePlace outline = outline_place(name, mapper.contour());
    auto vertex = mapper.vertex(name, model.landmarks());
    if (!vertex && outline.share >= 0) vertex = vertex_on_contour(outline, model, name);
    if (!vertex || *vertex < 0 || *vertex >= model.vertex_count()) continue;
    seen.push_back({name, *vertex, mark.position, mark.stddev, outline.jaw_place});
  }
  return seen;
}

std::vector<Information> informations(const std::vector<Observation>& seen,
                                      const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>& projected,
                                      double yaw, const ObservationNoise& noise) {
  constexpr int chin = 9;
  const std::array<int, 18> line = jaw_line(seen);
  std::vector<Information> W(seen.size(), Information::Zero());
  for (size_t k = 0; k < seen.size(); ++k) {
    const Observation& o = seen[k];
    const bool jaw = o.jaw_place > 0 && noise.jaw != JawMode::fixed;
    const double sigma = (o.sigma_px > 0 ? o.sigma_px : noise.sigma_px) * (jaw ? noise.jaw_factor : 1);
    W[k] = Information::Identity() / (sigma * sigma);
    if (!jaw) continue;
    if (noise.jaw == JawMode::contour) {
      W[k].setZero();
      continue;
    }
    if (noise.jaw == JawMode::exclude) {
      if (o.jaw_place != chin) W[k].setZero();
      continue;
    }
    const bool hidden =
        (yaw > noise.largest_yaw && o.jaw_place > chin) || (yaw < -noise.largest_yaw && o.jaw_place < chin);
    const int before = next_on_jaw(line, o.jaw_place, -1), after = next_on_jaw(line, o.jaw_place, +1);
    if (hidden || before < 0 || after < 0) {  // the ends slide without limit
      W[k].setZero();
      continue;
    }
    const Eigen::Vector2d tangent = (projected.row(after) - projected.row(before)).transpose();
    const Eigen::Vector2d normal = Eigen::Vector2d(-tangent[1], tangent[0]).normalized();
    W[k] = normal * normal.transpose() / (sigma * sigma);
  }
  return W;
}

}  // namespace facewright
