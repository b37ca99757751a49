// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/merge_textures.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr double dark = 0.01;  // linear light below which ratios say nothing

void check(const std::vector<Image>& isomaps, const std::vector<double>& resolutions, const MergeOptions& options) {
  if (isomaps.empty()) throw InvalidInput("merge: expected at least one isomap");
  for (const Image& image : isomaps)
    if (image.empty() || image.channels != 4 || image.width != isomaps[0].width || image.height != isomaps[0].height)
      throw InvalidInput("merge: expected RGBA isomaps of one size, the first has " + std::to_string(isomaps[0].width) +
                         " x " + std::to_string(isomaps[0].height) + " texels");
  if (!resolutions.empty() && resolutions.size() != isomaps.size())
    throw InvalidInput("merge: expected one resolution per isomap");
  for (const double r : resolutions)
    if (!(r >= 0) || !std::isfinite(r)) throw InvalidInput("merge: resolutions must be finite and not negative");
  if (!(options.outlier > 0) || !(options.sharpness > 0))
    throw InvalidInput("merge options: expected outlier > 0 and sharpness > 0");
}

/// Median of log(a / b) per channel where both are well seen, and how many texels that are.
std::pair<Eigen::Vector3d, size_t> log_ratio(const Image& a, const Image& b) {
  std::array<std::vector<double>, 3> logs;
  const size_t texels = a.data.size() / 4, stride = std::max<size_t>(1, texels / 65536);
  for (size_t i = 0; i < texels; i += stride) {
    const std::uint8_t *p = a.data.data() + 4 * i, *q = b.data.data() + 4 * i;
    if (p[3] < 128 || q[3] < 128) continue;
    for (size_t k = 0; k < 3; ++k) {
      if (p[k] > 250 || q[k] > 250) continue;  // clipped
      logs[k].push_back(std::log((linear_from_srgb8(p[k]) + dark) / (linear_from_srgb8(q[k]) + dark)));
    }
  }
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  size_t count = texels;
  for (size_t k = 0; k < 3; ++k) {
    count = std::min(count, logs[k].size());
    if (logs[k].empty()) continue;
    const auto middle = logs[k].begin() + static_cast<std::ptrdiff_t>(logs[k].size() / 2);
    std::nth_element(logs[k].begin(), middle, logs[k].end());
    median[static_cast<Eigen::Index>(k)] = *middle;
  }
  return {median, count};
}

/// Gains g with log g_i - log g_j = -ratio_ij for the pairs that overlap; their logarithms have mean 0 (a weak pull to
/// 0 settles images without overlap).
std::vector<Eigen::Vector3d> gains_of(const std::vector<Image>& isomaps) {
  const auto n = static_cast<Eigen::Index>(isomaps.size());
  Eigen::MatrixXd H = 1e-6 * Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(n, 3);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = i + 1; j < n; ++j) {
      const auto [ratio, count] = log_ratio(isomaps[static_cast<size_t>(i)], isomaps[static_cast<size_t>(j)]);
      if (count < 50) continue;
      const double w = std::sqrt(static_cast<double>(count));
      H(i, i) += w, H(j, j) += w, H(i, j) -= w, H(j, i) -= w;
      rhs.row(i) -= w * ratio.transpose(), rhs.row(j) += w * ratio.transpose();
    }
  Eigen::MatrixXd log_gain = H.ldlt().solve(rhs);
  log_gain.rowwise() -= log_gain.colwise().mean().eval();
  std::vector<Eigen::Vector3d> gains;
  for (Eigen::Index i = 0; i < n; ++i) gains.emplace_back(log_gain.row(i).transpose().array().exp());
  return gains;
}

struct Sample {
  Eigen::Vector3d linear, encoded;
  double weight = 0;
  size_t image = 0;
};

/// Per channel the value with half the weight on either side.
Eigen::Vector3d weighted_median(const std::vector<Sample>& samples) {
  double total = 0;
  for (const Sample& s : samples) total += s.weight;
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  std::vector<std::pair<double, double>> sorted(samples.size());
  for (int k = 0; k < 3; ++k) {
    for (size_t i = 0; i < samples.size(); ++i) sorted[i] = {samples[i].encoded[k], samples[i].weight};
    std::sort(sorted.begin(), sorted.end());
    double sum = 0;
    for (const auto& [value, weight] : sorted) {
      median[k] = value, sum += weight;
      if (sum >= total / 2) break;
    }
  }
  return median;
}

/// Weighs samples far from the median down; how many lost more than half.
int weigh_down_outliers(std::vector<Sample>& samples, double scale) {
  if (samples.size() < 3) return 0;
  // One strong outlier may hold half of the weight: look for the median with weights evened out.
  std::vector<Sample> even = samples;
  double largest = 0;
  for (const Sample& s : even) largest = std::max(largest, s.weight);
  for (Sample& s : even) s.weight = std::max(s.weight, 0.25 * largest);
  const Eigen::Vector3d median = weighted_median(even);
  int outlying = 0;
  for (Sample& s : samples) {
    const double distance2 = (s.encoded - median).squaredNorm() / (scale * scale);
    s.weight /= 1 + distance2 * distance2;
    outlying += distance2 > 1;
  }
  return outlying;
}

}  // namespace

MergedTexture merge_textures(const std::vector<Image>& isomaps, const std::vector<double>& resolutions,
                             const MergeOptions& options) {
  check(isomaps, resolutions, options);
  MergedTexture result;
  MergeSummary& summary = result.summary;
  summary.gains.assign(isomaps.size(), Eigen::Vector3d::Ones());
  if (options.compensate_gain) summary.gains = gains_of(isomaps);
  summary.shares.assign(isomaps.size(), 0);
  result.isomap = Image(isomaps[0].width, isomaps[0].height, 4);
  const double best =
      resolutions.empty() ? 1 : std::max(*std::max_element(resolutions.begin(), resolutions.end()), 1e-9);
  double merged = 0, taken = 0, outlying = 0;
  std::vector<Sample> samples;
  for (size_t i = 0; i < result.isomap.data.size() / 4; ++i) {
    samples.clear();
    int alpha = 0;
    for (size_t m = 0; m < isomaps.size(); ++m) {
      const std::uint8_t* p = isomaps[m].data.data() + 4 * i;
      if (p[3] == 0) continue;
      Sample s;
      const double sharp = resolutions.empty() ? 1 : std::max(resolutions[m] / best, 1e-3);
      s.weight = std::pow(p[3] / 255.0 * sharp, options.sharpness), s.image = m;
      for (int k = 0; k < 3; ++k) {
        s.linear[k] = summary.gains[m][k] * (linear_from_srgb8(p[k]) + dark) - dark;
        s.encoded[k] = srgb_from_linear(std::clamp(s.linear[k], 0.0, 1.0));
      }
      alpha = std::max(alpha, int{p[3]});
      samples.push_back(s);
    }
    if (samples.empty()) continue;
    outlying += weigh_down_outliers(samples, options.outlier);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0;
    for (const Sample& s : samples) sum += s.weight * s.linear, weight += s.weight;
    for (const Sample& s : samples) summary.shares[s.image] += s.weight / weight;
    merged += 1, taken += static_cast<double>(samples.size());
    std::uint8_t* out = result.isomap.data.data() + 4 * i;
    for (int k = 0; k < 3; ++k) out[k] = srgb8_from_linear(sum[k] / weight);
    out[3] = static_cast<std::uint8_t>(alpha);
  }
  for (double& share : summary.shares) share /= std::max(merged, 1.0);
  summary.outlying = outlying / std::max(taken, 1.0);
  return result;
}

}  // namespace facewright
