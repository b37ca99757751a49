// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "libmodel/geometry/normals.h"
#include "libregister/registration/denoise_filters.h"

namespace facewright {
namespace {

constexpr double kPassesPerRadian = 15, kKernelPerTilt = 1.75;

Vertices centroids(const Vertices& V, const Faces& F) {
  Vertices C(F.rows(), 3);
  for (Eigen::Index f = 0; f < F.rows(); ++f) C.row(f) = (V.row(F(f, 0)) + V.row(F(f, 1)) + V.row(F(f, 2))) / 3;
  return C;
}

// Triangles that share a vertex with each triangle, itself among them, and their weights: area times a Gaussian of the
// centroids' distance.
struct Neighbours {
  std::vector<int> offsets = {0}, faces;
  std::vector<double> weights;
};

Neighbours neighbours(const Vertices& V, const Faces& F, const ScanGraph& graph) {
  const Vertices C = centroids(V, F);
  const Eigen::VectorXd A = face_areas(V, F);
  Neighbours n;
  n.faces.reserve(static_cast<size_t>(F.rows()) * 13);
  std::vector<int> stamp(static_cast<size_t>(F.rows()), -1);
  double spacing = 0;
  for (int f = 0; f < F.rows(); ++f) {
    for (int k = 0; k < 3; ++k)
      for (const int* g = graph.faces.begin(F(f, k)); g != graph.faces.end(F(f, k)); ++g) {
        if (stamp[static_cast<size_t>(*g)] == f) continue;
        stamp[static_cast<size_t>(*g)] = f;
        n.faces.push_back(*g);
        n.weights.push_back((C.row(*g) - C.row(f)).squaredNorm());
        spacing += std::sqrt(n.weights.back());
      }
    n.offsets.push_back(static_cast<int>(n.faces.size()));
  }
  spacing /= static_cast<double>(n.faces.size() - static_cast<size_t>(F.rows()));
  for (size_t k = 0; k < n.faces.size(); ++k)
    n.weights[k] = A[n.faces[k]] * std::exp(-0.5 * n.weights[k] / (spacing * spacing));
  return n;
}

void filter_normals(Vertices& N, const Neighbours& n, double sigma, int passes) {
  Vertices next(N.rows(), 3);
  const double scale = 1 / (sigma * sigma);  // |n_f - n_g|^2 / 2 = 1 - n_f . n_g
  for (int pass = 0; pass < passes; ++pass) {
    for (Eigen::Index f = 0; f < N.rows(); ++f) {
      const Eigen::RowVector3d own = N.row(f);
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (int k = n.offsets[static_cast<size_t>(f)]; k < n.offsets[static_cast<size_t>(f) + 1]; ++k) {
        const Eigen::RowVector3d other = N.row(n.faces[static_cast<size_t>(k)]);
        sum += n.weights[static_cast<size_t>(k)] * std::exp(scale * (own.dot(other) - 1)) * other;
      }
      const double length = sum.norm();
      if (length > 0)
        next.row(f) = sum / length;
      else
        next.row(f) = own;
    }
    N.swap(next);
  }
}

void fit_vertices(Vertices& V, const Faces& F, const ScanGraph& graph, const Vertices& N, int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    const Vertices C = centroids(V, F);
    for (int i = 0; i < V.rows(); ++i) {
      if (graph.border[static_cast<size_t>(i)] || graph.faces.degree(i) < 3) continue;
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (const int* f = graph.faces.begin(i); f != graph.faces.end(i); ++f)
        sum += N.row(*f).dot(C.row(*f) - V.row(i)) * N.row(*f);
      V.row(i) += sum / graph.faces.degree(i);
    }
  }
}

}  // namespace

Vertices bilateral_normals(const Vertices& V, const Faces& F, const ScanGraph& graph, double noise, double mean_edge,
                           const DenoiseOptions& options) {
  // Noise tilts the normals by some noise / mean_edge radians: as many passes as that needs, and a kernel wide enough
  // to see through it.
  const double tilt = noise / std::max(mean_edge, 1e-9);
  const int passes = options.normal_passes > 0
                         ? options.normal_passes
                         : std::min(8, 1 + static_cast<int>(std::lround(kPassesPerRadian * tilt)));
  Vertices N = face_normals(V, F), out = V;
  filter_normals(N, neighbours(V, F, graph), std::max(options.bilateral_sigma, kKernelPerTilt * tilt), passes);
  fit_vertices(out, F, graph, N, options.vertex_passes);
  return out;
}

}  // namespace facewright
