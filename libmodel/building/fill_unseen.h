// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/registered_set.h"

namespace facewright {

struct FillUnseenOptions {
  double min_visibility = 0.5;     ///< 0..1; entries below count as filled in the summary
  int modes = -1;                  ///< of the model that fills; -1: what foretells held-out values best
  int most_modes = 40;             ///< tried when `modes` is -1; never more than a third of the samples
  double correlation_length = 16;  ///< mm, of what the modes do not explain; 0: neighbours are not asked
  int max_iterations = 50;         ///< of expectation-maximisation
  double tolerance = 1e-4;         ///< stop when filled values change by less than this (root mean square)
  std::uint64_t seed = 1;          ///< of the values held out
  int threads = 0;                 ///< 0 = all
};

/// Root mean square errors on values that were seen but hidden from the filling, in the units of the values.
struct HeldOutError {
  double mean = 0;    ///< of the mean of those who saw the vertex, the fill that is never used
  double filled = 0;  ///< of the model with the chosen number of modes, neighbours not asked
};

struct FillUnseenSummary {
  double filled_share = 0;            ///< of all (sample, vertex) pairs
  double worst_sample_share = 0;      ///< largest share of one sample that was filled
  int worst_sample = -1;              ///< -1: none had to be
  std::vector<double> sample_shares;  ///< (S) share of each sample that was filled
  int never_seen = 0;                 ///< vertices that no sample saw: filled from their neighbours, or left as given
  int modes = 0;                      ///< used
  double noise = 0;                   ///< standard deviation of what the modes do not explain
  double edge_correlation = 0;        ///< of that, at the two ends of an edge
  double uncertain_share = 0;  ///< posterior variance of the filled values over all variance: what a PCA of them lacks
  HeldOutError held_out;       ///< zeros when `modes` was given
  int iterations = 0;
  bool converged = true;
  double last_change = 0;
  FillUnseenOptions options;
};

struct FillUnseenResult {
  SampleMatrix values;  ///< (S x 3N) fully seen entries unchanged
  FillUnseenSummary summary;
};

/// Completes samples that were seen partly or badly (colours of occluded skin) from the statistics of all: weighted
/// probabilistic PCA with missing data [roweis1998, tipping1999, ilin2010], then what the modes leave unexplained is
/// carried in from the seen neighbours on the surface (V, F) as a correlated Gaussian field [lindgren2011].
/// `visibility` (S x N) is the precision of a value relative to a fully seen one: the result is w * value + (1 - w) *
/// expectation, so 1 keeps and 0 replaces a value. The number of modes is the one that foretells contiguous patches of
/// seen values best, hidden for the purpose. Throws InvalidInput for sizes that do not fit or values out of range.
/// O(iterations S N modes) plus a sparse solve per sample.
FillUnseenResult fill_unseen(SampleMatrix values, const SampleMatrix& visibility, const Vertices& V, const Faces& F,
                             const FillUnseenOptions& options = {});
/// The same without a surface: neighbours are not asked, values held out are scattered.
FillUnseenResult fill_unseen(SampleMatrix values, const SampleMatrix& visibility,
                             const FillUnseenOptions& options = {});

/// fill_unseen in two steps, for sets that do not fit into memory: learns from some of the samples, then completes any,
/// one by one. A sample it learnt from comes out as fill_unseen has it.
class UnseenFill {
 public:
  /// As fill_unseen; at least one sample.
  UnseenFill(const SampleMatrix& values, const SampleMatrix& visibility, const Vertices& V, const Faces& F,
             const FillUnseenOptions& options = {});
  ~UnseenFill();

  /// `row` (3N) by its `visibility` (N). Returns the posterior variance of what was filled, summed. May be called from
  /// several threads.
  double complete(Eigen::Ref<Eigen::RowVectorXd> row, const Eigen::RowVectorXd& visibility) const;
  /// Of a sample with this visibility (N), the share that is filled, as FillUnseenSummary::sample_shares.
  double filled_share(const Eigen::RowVectorXd& visibility) const;
  /// Of the samples learnt from; uncertain_share is 0.
  const FillUnseenSummary& summary() const;

 private:
  struct Model;
  std::unique_ptr<const Model> model_;
};

}  // namespace facewright
