// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <string>

#include "libmodel/building/metric_distances.h"
#include "libmodel/building/metrics.h"
#include "libmodel/building/pca.h"
#include "libmodel/building/sample_modes.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

constexpr Eigen::Index kTile = 1024;  // vertices per block
constexpr int kBatch = 16;            // random faces that share the reading of a block

struct Drawn {
  std::vector<int> modes;
  Eigen::MatrixXd coordinates;  // (samples x K) along the unit modes, mm
  Eigen::MatrixXi nearest;      // (samples x modes) row of the nearest training sample
};

// Squared distance to sample j = sum over modes up to M of (c_k - s_jk)^2, plus what lies beyond M in the sample.
void find_nearest(const SampleModes& model, Drawn& drawn, int s) {
  const Eigen::MatrixXd& scores = model.scores;
  const Eigen::Index K = drawn.coordinates.cols();
  Eigen::VectorXd d = scores.rowwise().squaredNorm();  // M = 0
  Eigen::Index k = 0;
  for (size_t m = 0; m < drawn.modes.size(); ++m) {
    for (; k < std::min<Eigen::Index>(drawn.modes[m], K); ++k)
      d.array() += (drawn.coordinates(s, k) - scores.col(k).array()).square() - scores.col(k).array().square();
    Eigen::Index best = 0;
    d.minCoeff(&best);
    drawn.nearest(s, static_cast<Eigen::Index>(m)) = static_cast<int>(best);
  }
}

Drawn draw(const SampleModes& model, std::vector<int> modes, const MetricsOptions& options) {
  Drawn drawn;
  const Eigen::Index K = std::min<Eigen::Index>(modes.empty() ? 0 : modes.back(), model.variances.size());
  drawn.modes = std::move(modes);
  drawn.coordinates.resize(options.samples, K);
  drawn.nearest.resize(options.samples, static_cast<Eigen::Index>(drawn.modes.size()));
  parallel_for(options.samples, options.threads, [&](int s) {
    Random random = Random::stream(options.seed, static_cast<std::uint64_t>(s));
    for (Eigen::Index k = 0; k < K; ++k) drawn.coordinates(s, k) = std::sqrt(model.variances[k]) * random.normal();
    find_nearest(model, drawn, s);
  });
  return drawn;
}

// (D x K) unit modes.
SampleMatrix lift_modes(const SampleMatrix& X, const Eigen::RowVectorXd& mean, const Eigen::MatrixXd& W, int threads) {
  SampleMatrix basis(X.cols(), W.cols());
  const Eigen::Index width = 3 * kTile;
  parallel_for(static_cast<int>((X.cols() + width - 1) / width), threads, [&](int b) {
    const Eigen::Index col = b * width, count = std::min(width, X.cols() - col);
    const SampleMatrix block = X.middleCols(col, count).rowwise() - mean.segment(col, count);
    basis.middleRows(col, count).noalias() = block.transpose() * W;
  });
  return basis;
}

class Sampler {
 public:
  Sampler(const MetricsInput& input, const Drawn& drawn, const Eigen::RowVectorXd& mean, const SampleMatrix& basis)
      : input_(input),
        drawn_(drawn),
        mean_(mean),
        basis_(basis),
        weights_(input.distance_weights / input.distance_weights.sum()) {}

  // Distances of a batch of random faces at all mode counts, and of the landmarks.
  void measure_batch(int first, int count, Eigen::MatrixXd& vertices, Eigen::MatrixXd& landmarks) const {
    const Eigen::Index N = weights_.size();
    for (Eigen::Index v = 0; v < N; v += kTile) {
      const Eigen::Index tile = std::min(kTile, N - v);
      SampleMatrix faces = mean_.segment(3 * v, 3 * tile).replicate(count, 1);
      Eigen::Index k = 0;
      for (size_t m = 0; m < drawn_.modes.size(); ++m) {
        const Eigen::Index next = std::min<Eigen::Index>(drawn_.modes[m], basis_.cols());
        faces.noalias() += drawn_.coordinates.block(first, k, count, next - k) *
                           basis_.block(3 * v, k, 3 * tile, next - k).transpose();
        k = next;
        for (int s = 0; s < count; ++s) add(faces, s, first + s, m, v, tile, vertices, landmarks);
      }
    }
  }

  // The random face at the probe's vertices.
  Vertices points(int s, int modes, const SurfaceProbe& probe) const {
    const Eigen::Index k = std::min<Eigen::Index>(modes, basis_.cols());
    Vertices P(static_cast<Eigen::Index>(probe.vertices.size()), 3);
    for (Eigen::Index p = 0; p < P.rows(); ++p) {
      const Eigen::Index row = 3 * Eigen::Index(probe.vertices[static_cast<size_t>(p)]);
      P.row(p) = mean_.segment<3>(row);
      P.row(p) += (basis_.block(row, 0, 3, k) * drawn_.coordinates.row(s).head(k).transpose()).transpose();
    }
    return P;
  }

 private:
  void add(const SampleMatrix& faces, int row, int s, size_t m, Eigen::Index v, Eigen::Index tile,
           Eigen::MatrixXd& vertices, Eigen::MatrixXd& landmarks) const {
    const auto column = static_cast<Eigen::Index>(m);
    const int j = drawn_.nearest(s, column);
    const Eigen::Map<const Vertices> face(faces.row(row).data(), tile, 3),
        scan(input_.samples.row(j).data() + 3 * v, tile, 3);
    vertices(s, column) += weights_.segment(v, tile).dot((face - scan).rowwise().norm());
    for (const int l : input_.landmarks)
      if (l >= v && l < v + tile)
        landmarks(s, column) += (face.row(l - v) - scan.row(l - v)).norm() / double(input_.landmarks.size());
  }

  const MetricsInput& input_;
  const Drawn& drawn_;
  const Eigen::RowVectorXd& mean_;
  const SampleMatrix& basis_;
  Eigen::VectorXd weights_;
};

// Surface distances cost by far the most: some sixteen of a long list of mode counts are enough for a curve.
std::vector<Eigen::Index> thinned(const std::vector<int>& modes) {
  std::vector<Eigen::Index> places;
  double next = 0;
  for (size_t m = 0; m < modes.size(); ++m)
    if (modes[m] >= next || m + 1 == modes.size()) {
      places.push_back(static_cast<Eigen::Index>(m));
      next = std::max(modes[m] + 0.5, 1.25 * modes[m]);
    }
  return places;
}

// One search tree per training sample, for all random faces that are nearest to it.
Eigen::MatrixXd surface_distances(const MetricsInput& input, const MetricsOptions& options, const Drawn& drawn,
                                  const Sampler& sampler, const SurfaceProbe& probe,
                                  const std::vector<Eigen::Index>& places, const Progress& progress) {
  const int samples = std::min(options.samples, options.surface_samples), n = static_cast<int>(input.samples.rows());
  Eigen::MatrixXd table = Eigen::MatrixXd::Zero(samples, static_cast<Eigen::Index>(places.size()));
  std::atomic<int> done = 0;
  parallel_for(n, options.threads, [&](int j) {
    if ((drawn.nearest.topRows(samples).array() == j).any()) {
      const SurfaceIndex surface(Eigen::Map<const Vertices>(input.samples.row(j).data(), input.samples.cols() / 3, 3),
                                 input.F);
      for (int s = 0; s < samples; ++s)
        for (size_t p = 0; p < places.size(); ++p)
          if (drawn.nearest(s, places[p]) == j)
            table(s, static_cast<Eigen::Index>(p)) =
                surface_distance(surface, probe, sampler.points(s, drawn.modes[size_t(places[p])], probe));
    }
    if (progress) progress({"specificity, surface", ++done, n, ""});
  });
  return table;
}

}  // namespace

SpecificityResult specificity(const MetricsInput& input, const MetricsOptions& options, const Progress& progress) {
  check_metrics(input, options);
  SpecificityResult result;
  const int n = static_cast<int>(input.samples.rows());
  std::vector<int> modes = mode_counts(options.modes, n - 1);
  if (options.samples == 0 || modes.empty()) return result;
  std::vector<int> all(static_cast<size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::RowVectorXd mean = mean_of_rows(input.samples, all);
  const SampleModes model =
      sample_modes(gram_matrix(input.samples, mean, options.threads), all, rounding_variance(mean));
  const Drawn drawn = draw(model, std::move(modes), options);
  const SampleMatrix basis =
      lift_modes(input.samples, mean, model.weights.leftCols(drawn.coordinates.cols()), options.threads);
  const Sampler sampler(input, drawn, mean, basis);
  Eigen::MatrixXd vertices = Eigen::MatrixXd::Zero(options.samples, drawn.nearest.cols()), landmarks = vertices;
  const int batches = (options.samples + kBatch - 1) / kBatch;
  std::atomic<int> done = 0;
  parallel_for(batches, options.threads, [&](int b) {
    sampler.measure_batch(b * kBatch, std::min(kBatch, options.samples - b * kBatch), vertices, landmarks);
    if (progress) progress({"specificity", ++done, batches, ""});
  });
  result.nearest.vertices = curve_of(drawn.modes, std::move(vertices));
  if (!input.landmarks.empty()) result.nearest.landmarks = curve_of(drawn.modes, std::move(landmarks));
  const SurfaceProbe probe = surface_probe(input, options);
  if (!probe.empty() && options.surface_samples > 0) {
    const std::vector<Eigen::Index> places = thinned(drawn.modes);
    std::vector<int> counts;
    for (const Eigen::Index p : places) counts.push_back(drawn.modes[static_cast<size_t>(p)]);
    result.nearest.surface =
        curve_of(std::move(counts), surface_distances(input, options, drawn, sampler, probe, places, progress));
  }
  return result;
}

}  // namespace facewright
