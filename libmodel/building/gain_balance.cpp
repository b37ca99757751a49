// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/gain_balance.h"

#include <cmath>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/median.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

class Balance {
 public:
  Balance(const SampleMatrix& colours, const SampleMatrix& visibility, const GainBalanceOptions& options)
      : colours_(colours),
        visibility_(visibility),
        options_(options),
        logs_(Eigen::MatrixXd::Zero(colours.rows(), 3)) {}

  void run(GainBalanceResult* result) {
    result->converged = false;
    while (!result->converged && result->iterations < options_.max_iterations) {
      ++result->iterations;
      const Eigen::RowVectorXd mean = balanced_mean();
      Eigen::MatrixXd next(logs_.rows(), 3);
      parallel_for(static_cast<int>(logs_.rows()), options_.threads, [&](int s) { next.row(s) = log_gains(s, mean); });
      next.rowwise() -= next.colwise().mean().eval();
      result->converged = (next - logs_).cwiseAbs().maxCoeff() < options_.tolerance;
      logs_ = next;
    }
    result->gains = logs_.array().exp().matrix();
  }

 private:
  double weight(Eigen::Index s, Eigen::Index v) const {
    const double w = visibility_.size() > 0 ? visibility_(s, v) : 1;
    return w < options_.least_weight ? 0 : w;
  }

  Eigen::RowVectorXd balanced_mean() const {
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(colours_.cols()), count = sum;
    for (Eigen::Index s = 0; s < colours_.rows(); ++s) {
      const Eigen::RowVector3d scale = (-logs_.row(s)).array().exp();
      for (Eigen::Index v = 0; v < colours_.cols() / 3; ++v) {
        const double w = weight(s, v);
        if (w <= 0) continue;
        sum.segment<3>(3 * v) += w * colours_.row(s).segment<3>(3 * v).cwiseProduct(scale);
        count.segment<3>(3 * v).array() += w;
      }
    }
    return (sum.array() / count.array().max(1e-300)).matrix();
  }

  Eigen::RowVector3d log_gains(int s, const Eigen::RowVectorXd& mean) const {
    std::vector<double> ratios[3];
    const bool one = options_.balance == GainBalance::exposure;
    for (Eigen::Index i = 0; i < colours_.cols(); ++i)
      if (weight(s, i / 3) > 0 && colours_(s, i) > options_.darkest && mean[i] > options_.darkest)
        ratios[one ? 0 : i % 3].push_back(std::log(colours_(s, i) / mean[i]));
    Eigen::RowVector3d logs;
    for (int c = 0; c < 3; ++c) logs[c] = one && c > 0 ? logs[0] : median_of(ratios[c]);
    return logs;
  }

  const SampleMatrix &colours_, &visibility_;
  const GainBalanceOptions& options_;
  Eigen::MatrixXd logs_;
};

}  // namespace

std::string to_string(GainBalance balance) {
  constexpr const char* kNames[] = {"none", "exposure", "channels"};  // in the order of GainBalance
  return kNames[static_cast<int>(balance)];
}

GainBalanceResult balance_gains(SampleMatrix colours, const SampleMatrix& visibility,
                                const GainBalanceOptions& options) {
  if (visibility.size() > 0 && (visibility.rows() != colours.rows() || visibility.cols() * 3 != colours.cols()))
    throw InvalidInput("gain balance: visibility and colours differ in size");
  GainBalanceResult result;
  result.gains = Eigen::MatrixXd::Ones(colours.rows(), 3);
  if (options.balance != GainBalance::none && colours.rows() > 1) {
    Balance(colours, visibility, options).run(&result);
    for (Eigen::Index s = 0; s < colours.rows(); ++s)
      for (Eigen::Index i = 0; i < colours.cols(); ++i) colours(s, i) /= result.gains(s, i % 3);
  }
  result.colours = std::move(colours);
  return result;
}

}  // namespace facewright
