// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/global_mapping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/core/random.h"
#include "libregister/registration/semilandmarks.h"
#include "libregister/registration/thin_plate_spline.h"

namespace facewright {
namespace {

Vertices positions(const Landmarks& landmarks, const std::vector<std::string>& names) {
  Vertices X(static_cast<Eigen::Index>(names.size()), 3);
  for (size_t i = 0; i < names.size(); ++i) X.row(static_cast<Eigen::Index>(i)) = landmarks.at(names[i]).position;
  return X;
}

double median(const Eigen::VectorXd& x) {
  std::vector<double> values(x.data(), x.data() + x.size());
  return median_of(values);
}

// Residuals of B about S(A), in millimetres of the reference.
Eigen::VectorXd residuals(const Similarity& S, const Vertices& A, const Vertices& B) {
  return (S.apply(A) - B).rowwise().norm() / S.s;
}

struct RobustFit {
  Similarity S;
  double cost = 0;  // sum of residuals truncated at the inlier distance
};

void try_triple(const Vertices& A, const Vertices& B, const std::array<int, 3>& pick, double inlier, RobustFit* best) {
  Vertices a(3, 3), b(3, 3);
  for (int k = 0; k < 3; ++k) a.row(k) = A.row(pick[k]), b.row(k) = B.row(pick[k]);
  Similarity S;
  try {
    S = fit_similarity(a, b);
  } catch (const InvalidInput&) {
    return;  // three points on a line say nothing
  }
  if (!(S.s > 0) || !std::isfinite(S.s)) return;
  const double cost = residuals(S, A, B).array().min(inlier).sum();
  if (best->cost < 0 || cost < best->cost) *best = {S, cost};
}

RobustFit best_triple(const Vertices& A, const Vertices& B, double inlier) {
  constexpr int kExhaustive = 20000, kDraws = 5000;
  const int K = static_cast<int>(A.rows());
  RobustFit best{{}, -1};
  if (static_cast<double>(K) * (K - 1) * (K - 2) / 6 <= kExhaustive) {
    for (int i = 0; i < K; ++i)
      for (int j = 0; j < i; ++j)
        for (int k = 0; k < j; ++k) try_triple(A, B, {i, j, k}, inlier, &best);
    return best;
  }
  Random random(20060000);
  for (int draw = 0; draw < kDraws; ++draw) {
    const int i = random.index(K), j = random.index(K), k = random.index(K);
    if (i != j && j != k && i != k) try_triple(A, B, {i, j, k}, inlier, &best);
  }
  return best;
}

Similarity tukey_refine(Similarity S, const Vertices& A, const Vertices& B) {
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Eigen::VectorXd r = residuals(S, A, B);
    const double c = 4.685 * std::max(1.4826 * median(r), 1.0);  // 95 % efficiency under normal errors
    const Eigen::VectorXd w = (r.array() < c).select((1 - (r.array() / c).square()).square(), 0.0);
    if ((w.array() > 0).count() < 3) break;
    S = fit_similarity(A, B, w);
  }
  return S;
}

RobustFit robust_similarity(const Vertices& A, const Vertices& B, double inlier) {
  RobustFit fit = best_triple(A, B, inlier);
  if (fit.cost < 0) throw InvalidInput("alignment: the landmarks lie on a line");
  fit.S = tukey_refine(fit.S, A, B);
  fit.cost = residuals(fit.S, A, B).array().min(inlier).sum();
  return fit;
}

Landmarks swap_left_right(const Landmarks& landmarks) {
  Landmarks swapped;
  for (const auto& [name, point] : landmarks) swapped[mirrored_landmark(name)] = point;
  return swapped;
}

void check_scale(double s, const AlignOptions& options) {
  if (s >= options.lowest_scale && s <= options.highest_scale) return;
  std::ostringstream m;
  m << "alignment: the scan's landmarks are " << s << " times the size of the reference face, expected "
    << options.lowest_scale << " to " << options.highest_scale
    << "; check the units (--units mm|cm|m) and the landmarks";
  throw InvalidInput(m.str());
}

}  // namespace

AlignResult align_landmarks(const Landmarks& reference, const Landmarks& scan, const AlignOptions& options) {
  const auto names = common_names(reference, scan);
  if (names.size() < 3)
    throw InvalidInput("alignment: " + std::to_string(names.size()) +
                       " landmarks in common with the reference face, at least 3 are needed (12 or more recommended)");
  const Vertices A = positions(reference, names);
  AlignResult result;
  result.landmarks = scan;
  RobustFit fit = robust_similarity(A, positions(scan, names), options.inlier_distance);
  if (const Landmarks swapped = swap_left_right(scan); common_names(reference, swapped) == names) {
    const RobustFit other = robust_similarity(A, positions(swapped, names), options.inlier_distance);
    if (other.cost < 0.8 * fit.cost) {  // mirrored labels fit a fifth better: they are swapped
      fit = other;
      result.landmarks = swapped;
      result.swapped_left_right = true;
    }
  }
  check_scale(fit.S.s, options);
  result.scan_from_reference = fit.S;
  const Eigen::VectorXd r = residuals(fit.S, A, positions(result.landmarks, names));
  const double bound = std::max(options.inlier_distance, 3.5 * 1.4826 * median(r));
  double sum = 0;
  for (size_t i = 0; i < names.size(); ++i) {
    const double ri = r[static_cast<Eigen::Index>(i)];
    (ri <= bound ? result.used : result.rejected).push_back(names[i]);
    if (ri <= bound) sum += ri * ri;
  }
  result.rms = std::sqrt(sum / std::max<size_t>(1, result.used.size()));
  const double agree = (r.array() <= options.inlier_distance).cast<double>().mean();
  if (agree < options.least_inliers) {
    std::ostringstream m;
    m << "alignment: only " << std::lround(100 * agree) << " % of the " << names.size() << " landmarks lie within "
      << options.inlier_distance << " mm of a face's; this is no face, or its landmarks are wrong";
    throw InvalidInput(m.str());
  }
  return result;
}

namespace {

// Residual spread of each landmark relative to the average one: stddev^2 / mean, 1 where unknown.
Eigen::VectorXd relative_variance(const Landmarks& landmarks, const std::vector<std::string>& names) {
  Eigen::VectorXd v = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(names.size()));
  double sum = 0;
  int known = 0;
  for (const auto& name : names)
    if (const double s = landmarks.at(name).stddev; s > 0) sum += s * s, ++known;
  if (known == 0) return v;
  for (size_t i = 0; i < names.size(); ++i)
    if (const double s = landmarks.at(names[i]).stddev; s > 0)
      v[static_cast<Eigen::Index>(i)] = std::clamp(s * s * known / sum, 0.01, 100.0);
  return v;
}

double least_lambda(const std::vector<std::string>& names, const GlobalMapOptions& options) {
  return static_cast<int>(names.size()) < options.least_for_smoothness ? 1.0 : 1e-4;
}

// Drops the landmarks that the others contradict. Judged where the residuals are least: smoothing would hide them among
// the others' larger ones.
std::vector<std::string> without_outliers(const Landmarks& reference, const GlobalMapOptions& options,
                                          std::vector<std::string> names, const Landmarks& scan,
                                          GlobalMapResult* result) {
  const auto limit = static_cast<size_t>(options.highest_dropped * static_cast<double>(names.size()));
  while (true) {
    const ThinPlateSpline spline =
        fit_thin_plate_spline(positions(reference, names), positions(scan, names), relative_variance(scan, names),
                              least_lambda(names, options), 0);
    const Eigen::VectorXd e = spline.leave_one_out().rowwise().norm();
    Eigen::Index worst;
    const double highest = e.maxCoeff(&worst);
    const double bound = std::max(options.outlier_distance, options.outlier_factor * 1.4826 * median(e));
    result->leave_one_out_rms = std::sqrt(e.squaredNorm() / static_cast<double>(e.size()));
    if (highest <= bound || result->dropped.size() >= limit) return names;
    result->dropped.push_back(names[static_cast<size_t>(worst)]);
    names.erase(names.begin() + worst);
  }
}

// Displacements of the reference's landmarks towards the scan's, in the reference's frame.
std::vector<SplineDatum> landmark_data(const Landmarks& reference, const std::vector<std::string>& names,
                                       const AlignResult& alignment, const GlobalMapOptions& options) {
  const Similarity reference_from_scan = alignment.scan_from_reference.inverse();
  std::map<std::string, Eigen::Vector3d> tangents;
  if (options.slide > 1) tangents = landmark_curve_tangents(reference);
  std::vector<SplineDatum> data;
  for (const std::string& name : names) {
    const LandmarkPoint<3>& point = alignment.landmarks.at(name);
    const Eigen::Vector3d& x = reference.at(name).position;
    const Eigen::Vector3d d = reference_from_scan * point.position - x;
    const double s =
        (point.stddev > 0 ? point.stddev : options.landmark_stddev) / std::sqrt(3.0) * reference_from_scan.s;
    if (const auto t = tangents.find(name); t != tangents.end())
      add_semilandmark(x, d, t->second, s, options.slide, &data);
    else
      add_displacement(x, d, s, &data);
  }
  return data;
}

// Root mean square of the deviations that the landmarks state, mm.
double stated_noise(const Landmarks& landmarks, const std::vector<std::string>& names,
                    const GlobalMapOptions& options) {
  double sum = 0;
  for (const auto& name : names) {
    const double s = landmarks.at(name).stddev;
    sum += s > 0 ? s * s : options.landmark_stddev * options.landmark_stddev;
  }
  return std::sqrt(sum / static_cast<double>(names.size()));
}

}  // namespace

GlobalMapResult global_mapping(const Vertices& reference, const SymmetryPlane* plane,
                               const Landmarks& reference_landmarks, const Landmarks& scan_landmarks,
                               const GlobalMapOptions& options, const AlignOptions& align) {
  if (!(options.slide >= 1)) throw InvalidInput("global mapping: slide must be 1 or more");
  GlobalMapResult result;
  result.alignment = align_landmarks(reference_landmarks, scan_landmarks, align);
  const AlignResult& alignment = result.alignment;
  const Similarity& S = alignment.scan_from_reference;
  result.V = S.apply(reference);
  if (static_cast<int>(alignment.used.size()) < options.least_for_spline) return result;
  // The spline works on the aligned reference, so that it only has to bend, and its affine part stays near identity.
  Landmarks moved;
  for (const auto& name : alignment.used) moved[name].position = S * reference_landmarks.at(name).position;
  try {
    const auto names = without_outliers(moved, options, alignment.used, alignment.landmarks, &result);
    if (static_cast<int>(names.size()) >= options.least_for_smoothness) {
      result.data = landmark_data(reference_landmarks, names, alignment, options);
      result.smoothness = estimate_smoothness(result.data, plane, options.smoothness);
      result.landmark_noise = result.smoothness.noise * stated_noise(alignment.landmarks, names, options);
      result.V = map_with_data(result, plane, {}, reference);
    } else {
      result.V =
          fit_thin_plate_spline(positions(moved, names), positions(alignment.landmarks, names),
                                relative_variance(alignment.landmarks, names), least_lambda(names, options))(result.V);
    }
    result.used_spline = true;
  } catch (const InvalidInput&) {
    result.data.clear();  // coplanar landmarks: the similarity stands
    result.landmark_noise = 0;
  }
  return result;
}

Vertices map_with_data(const GlobalMapResult& map, const SymmetryPlane* plane, const std::vector<SplineDatum>& further,
                       const Vertices& X) {
  std::vector<SplineDatum> data = map.data;
  data.insert(data.end(), further.begin(), further.end());
  return map.alignment.scan_from_reference.apply(X + SymmetricSpline(data, plane, map.smoothness)(X));
}

}  // namespace facewright
