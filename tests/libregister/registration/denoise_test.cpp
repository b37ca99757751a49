// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "tests/libregister/registration/bumpy_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

double rms_off_surface(const Vertices& V) {
  double sum = 0;
  int n = 0;
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    if (std::abs(V(i, 0)) > 55 || std::abs(V(i, 1)) > 75) continue;  // the border is not filtered
    const double h = V(i, 2) - bumpy_face_height(V(i, 0), V(i, 1));
    sum += h * h;
    ++n;
  }
  return std::sqrt(sum / n);
}

TEST(EstimateNoise, FindsThePlantedDeviation) {
  const Mesh m = bumpy_face(101, 131);
  for (const double sigma : {0.1, 0.3, 0.6}) EXPECT_NEAR(estimate_noise(noisy(m, sigma, 1), m.F), sigma, 0.1 * sigma);
}

TEST(Denoise, RemovesMoreThanFortyPercentOfTheNoise) {
  Mesh m = bumpy_face(101, 131);
  m.V = noisy(m, 0.3, 2);
  const double before = rms_off_surface(m.V);
  EXPECT_LT(rms_off_surface(denoise(m).mesh.V), 0.6 * before);
}

TEST(Denoise, LeavesACleanScanBitIdentical) {
  const Mesh m = bumpy_face(101, 131);
  const DenoiseResult r = denoise(m);
  EXPECT_THAT(r.mesh.V, SameBytes(m.V));
  EXPECT_EQ(r.summary.spikes, 0);
}

TEST(Denoise, PutsSpikesBackAndTouchesNothingElse) {
  Mesh m = bumpy_face(101, 131);
  const Mesh clean = m;
  const Vertices N = vertex_normals(m.V, m.F);
  std::vector<int> spikes;
  for (int i = 500; i < m.V.rows() - 500; i += 370) spikes.push_back(i);
  for (size_t k = 0; k < spikes.size(); ++k) m.V.row(spikes[k]) += (k % 2 ? 8 : -12) * N.row(spikes[k]);
  const DenoiseResult r = denoise(m);
  EXPECT_EQ(r.summary.spikes, static_cast<int>(spikes.size()));
  for (const int i : spikes) {
    EXPECT_LT((r.mesh.V.row(i) - clean.V.row(i)).norm(), 0.5);
    EXPECT_LE(r.reliability[i], 0.3);
  }
}

TEST(Denoise, MedianAndGaussianBothKeepAPlaneFlat) {
  const Mesh m = plane_grid(30, 30, 40, 40);
  for (const auto method : {DenoiseMethod::gaussian, DenoiseMethod::median}) {
    DenoiseOptions o;
    o.method = method;
    EXPECT_THAT(denoise(m, o).mesh.V, VerticesNear(m.V, 1e-9));
  }
}

TEST(Denoise, BorderIsUnreliableAndStays) {
  Mesh m = bumpy_face(51, 67);
  m.V = noisy(m, 0.3, 3);
  const DenoiseResult r = denoise(m);
  const auto border = boundary_vertices(m.V.rows(), m.F);
  for (Eigen::Index i = 0; i < m.V.rows(); ++i)
    if (border[static_cast<size_t>(i)]) {
      EXPECT_EQ(r.reliability[i], 0);
    }
}

TEST(Denoise, RefusesOptionsOutOfRange) {
  DenoiseOptions o;
  o.spike_isolation = 0.5;
  EXPECT_THROW(denoise(plane_grid(5, 5, 1, 1), o), InvalidInput);
}

}  // namespace
}  // namespace facewright
