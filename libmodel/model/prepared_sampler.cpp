// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/prepared_sampler.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr Eigen::Index kBlock = 32;  // rows whose sums stay in registers

/// sum[r] = sum_k c[k] basis[k][r], the modes in order.
void add_up(const float* basis, const float* c, Eigen::Index modes, double* sum) {
  using Four = float __attribute__((vector_size(16)));
  constexpr int groups = kBlock / 4;
  Four total[groups] = {};
  for (Eigen::Index k = 0; k < modes; ++k, basis += kBlock) {
    for (int g = 0; g < groups; ++g) {
      Four rows;
      std::memcpy(&rows, basis + 4 * g, sizeof rows);
      total[g] += rows * c[k];
    }
  }
  for (int g = 0; g < groups; ++g)
    for (int i = 0; i < 4; ++i) sum[4 * g + i] = static_cast<double>(total[g][i]);
}

}  // namespace

PreparedSampler::PreparedSampler(const PcaModel& model) : modes_(model.mode_count()), mean_(model.mean) {
  validate(model);
  const Eigen::Index rows = mean_.size(), blocks = (rows + kBlock - 1) / kBlock;
  basis_.assign(static_cast<size_t>(blocks * modes_ * kBlock), 0);
  for (Eigen::Index k = 0; k < modes_; ++k) {
    const double sigma = std::sqrt(model.variances[k]);
    for (Eigen::Index r = 0; r < rows; ++r)
      basis_[static_cast<size_t>((r / kBlock * modes_ + k) * kBlock + r % kBlock)] =
          static_cast<float>(sigma * model.basis(r, k));
  }
}

void PreparedSampler::instance(const Eigen::VectorXd& c, Vertices& out) const {
  if (c.size() > modes_)
    throw InvalidInput("model: got " + std::to_string(c.size()) + " coefficients for " + std::to_string(modes_) +
                       " modes");
  const Eigen::Index rows = mean_.size();
  const Eigen::VectorXf factors = c.cast<float>();
  out.resize(rows / 3, 3);
  const double* mean = mean_.data();
  double* to = out.data();
  for (Eigen::Index first = 0; first < rows; first += kBlock) {
    double sum[kBlock];
    add_up(basis_.data() + first * modes_, factors.data(), c.size(), sum);
    const Eigen::Index count = std::min(kBlock, rows - first);
    for (Eigen::Index r = 0; r < count; ++r) to[first + r] = mean[first + r] + sum[r];
  }
}

Vertices PreparedSampler::instance(const Eigen::VectorXd& c) const {
  Vertices out;
  instance(c, out);
  return out;
}

}  // namespace facewright
