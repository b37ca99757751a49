// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/denoise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"
#include "tests/libregister/registration/bumpy_face.h"
#include "tests/libregister/registration/denoise_planted.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

constexpr double kSpacing = 1.8;  // mm: a quarter of a million quadrics a test would be slow in a debug build

Mesh noisy_bumps(double sigma, double spacing = kSpacing) {
  Mesh m = planted_surface(spacing, 1);
  plant_noise(m, sigma, 2);
  return m;
}

double inner_rms(const Mesh& m) {
  const auto border = boundary_vertices(m.V.rows(), m.F);
  double sum = 0;
  int n = 0;
  for (Eigen::Index i = 0; i < m.V.rows(); ++i)
    if (!border[static_cast<size_t>(i)]) {
      const double d = planted_distance(m.V.row(i));
      sum += d * d, ++n;
    }
  return std::sqrt(sum / n);
}

DenoiseResult denoised(const Mesh& m, DenoiseMethod method) {
  DenoiseOptions o;
  o.method = method;
  return denoise(m, o);
}

struct Verdict {
  double precision, recall;
};

Verdict verdict(const std::vector<int>& found, const std::vector<char>& planted) {
  const auto right = std::count_if(found.begin(), found.end(), [&](int i) { return planted[static_cast<size_t>(i)]; });
  const int all = std::accumulate(planted.begin(), planted.end(), 0);
  return {found.empty() ? 1.0 : static_cast<double>(right) / static_cast<double>(found.size()),
          static_cast<double>(right) / std::max(1, all)};
}

TEST(EstimateNoise, FindsThePlantedDeviation) {
  const Mesh m = bumpy_face(101, 131);
  for (const double sigma : {0.1, 0.3, 0.6}) EXPECT_NEAR(estimate_noise(noisy(m, sigma, 1), m.F), sigma, 0.1 * sigma);
}

TEST(EstimateNoise, IsNotFooledBySpikes) {
  Mesh m = noisy_bumps(0.2);
  plant_spikes(m, 0.01, 0, 5);
  EXPECT_NEAR(estimate_noise(m.V, m.F), 0.2, 0.04);
}

TEST(Denoise, LeavesACleanScanBitIdentical) {
  for (const Mesh& m : {bumpy_face(101, 131), planted_surface(kSpacing, 1)}) {
    const DenoiseResult r = denoise(m);
    EXPECT_THAT(r.mesh.V, SameBytes(m.V));
    EXPECT_EQ(r.summary.spikes, 0);
    EXPECT_EQ(r.summary.filtered, 0);
  }
}

TEST(Denoise, LeavesAtMostAThirdOfTheNoise) {
  for (const double sigma : {0.1, 0.3, 0.6}) {
    const Mesh m = noisy_bumps(sigma, 1.3);
    EXPECT_LT(inner_rms(denoise(m).mesh), sigma / 3) << sigma;
  }
}

TEST(Denoise, EveryMethodLeavesAtMostSixTenthsOfTheNoise) {
  const Mesh m = noisy_bumps(0.3, 1.3);
  for (const auto method : {DenoiseMethod::median, DenoiseMethod::gaussian, DenoiseMethod::bilateral})
    EXPECT_LT(inner_rms(denoised(m, method).mesh), 0.6 * 0.3) << static_cast<int>(method);
}

TEST(Denoise, BilateralFilterKeepsABumpOfThreeMillimetres) {
  for (const double sigma : {0.0, 0.1, 0.3})
    EXPECT_LT(std::abs(mean_bump_loss(denoised(noisy_bumps(sigma, 1.3), DenoiseMethod::bilateral).mesh.V, 3)), 0.05)
        << sigma;
}

TEST(Denoise, QuadricsKeepBumpsOfEverySize) {
  const Vertices V = denoised(noisy_bumps(0.3, 1.3), DenoiseMethod::gaussian).mesh.V;
  EXPECT_LT(mean_bump_loss(V, 3), 0.15);
  EXPECT_LT(mean_bump_loss(V, 6), 0.03);
  EXPECT_LT(mean_bump_loss(V, 12), 0.01);
  EXPECT_LT(mean_bump_loss(denoised(planted_surface(1.3, 1), DenoiseMethod::gaussian).mesh.V, 3), 0.02);
}

TEST(Denoise, FindsSingleSpikesAndNothingElse) {
  for (const double share : {0.001, 0.005, 0.02}) {
    Mesh m = noisy_bumps(0.15);
    const auto planted = plant_spikes(m, share, 0, 3);
    const Verdict v = verdict(denoise(m).spikes, planted);
    EXPECT_GE(v.precision, 0.98) << share;
    EXPECT_GE(v.recall, 0.98) << share;
  }
}

TEST(Denoise, FindsClustersOfTwoToTwelveSpikes) {
  Mesh m = noisy_bumps(0.3, 1.3);
  const auto planted = plant_spikes(m, 0, 40, 4);
  const DenoiseResult r = denoise(m);
  const Verdict v = verdict(r.spikes, planted);
  EXPECT_GE(v.precision, 0.98);
  EXPECT_GE(v.recall, 0.98);
  double square = 0;
  for (const int i : r.spikes) {
    const double d = planted_distance(r.mesh.V.row(i));
    square += d * d;
    EXPECT_LE(r.reliability[i], 0.3);
  }
  // Single ones may lie under a cluster that hides a whole 3 mm bump.
  EXPECT_LT(std::sqrt(square / static_cast<double>(r.spikes.size())), 0.5);
}

TEST(Denoise, TwoNeighboursOnTheSameSideAreSpikes) {
  Mesh m = bumpy_face(61, 81);
  const int i = 20 * 62 + 30, j = i + 1;
  m.V(i, 2) += 10, m.V(j, 2) += 10.5;
  const DenoiseResult r = denoise(m);
  EXPECT_EQ(r.spikes, (std::vector<int>{i, j}));
  for (const int k : {i, j}) EXPECT_NEAR(r.mesh.V(k, 2), bumpy_face_height(r.mesh.V(k, 0), r.mesh.V(k, 1)), 0.2);
}

TEST(Denoise, PutsSpikesBackAndTouchesNothingElse) {
  Mesh m = bumpy_face(101, 131);
  const Mesh clean = m;
  const Vertices N = vertex_normals(m.V, m.F);
  std::vector<int> spikes;
  for (int i = 500; i < m.V.rows() - 500; i += 370) spikes.push_back(i);
  for (size_t k = 0; k < spikes.size(); ++k) m.V.row(spikes[k]) += (k % 2 ? 8 : -12) * N.row(spikes[k]);
  const DenoiseResult r = denoise(m);
  EXPECT_EQ(r.spikes, spikes);
  Vertices rest = r.mesh.V;
  for (const int i : spikes) {
    EXPECT_LT((r.mesh.V.row(i) - clean.V.row(i)).norm(), 0.5);
    EXPECT_LE(r.reliability[i], 0.3);
    rest.row(i) = clean.V.row(i);
  }
  EXPECT_THAT(rest, SameBytes(clean.V));
}

// A step such as a lid's edge or a nostril's rim: steep, but no vertex of it floats.
TEST(Denoise, ASharpStepIsNoSpike) {
  Mesh m = plane_grid(80, 80, 104, 104);
  for (Eigen::Index i = 0; i < m.V.rows(); ++i) {
    const double r = (m.V.row(i).head<2>() - Eigen::RowVector2d(52, 52)).norm();
    m.V(i, 2) = r < 8 ? -9 : 0;                         // a pit of 9 mm with a vertical wall
    if (std::abs(m.V(i, 0) - 20) < 0.7) m.V(i, 2) = 4;  // a fold one vertex wide
  }
  EXPECT_EQ(denoise(m).summary.spikes, 0);
}

TEST(Denoise, AVerdictOnEveryTwentiethVertexIsNotBelieved) {
  Mesh m = planted_surface(kSpacing, 1);
  plant_spikes(m, 0.09, 0, 3);
  const DenoiseResult r = denoise(m);
  EXPECT_EQ(r.summary.spikes, 0);
}

TEST(Denoise, EveryMethodKeepsAPlaneFlat) {
  const Mesh m = plane_grid(30, 30, 40, 40);
  for (const auto method : {DenoiseMethod::gaussian, DenoiseMethod::median, DenoiseMethod::bilateral}) {
    const Vertices V = denoised(m, method).mesh.V;
    EXPECT_LT(V.col(2).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Denoise, BorderStaysACurveAndLosesNoise) {
  const Mesh clean = planted_surface(kSpacing, 1);
  Mesh m = clean;
  plant_noise(m, 0.3, 2);
  for (const auto method : {DenoiseMethod::gaussian, DenoiseMethod::median, DenoiseMethod::bilateral}) {
    const DenoiseResult r = denoised(m, method);
    const auto border = boundary_vertices(m.V.rows(), m.F);
    double before = 0, after = 0;
    for (Eigen::Index i = 0; i < m.V.rows(); ++i) {
      if (!border[static_cast<size_t>(i)]) continue;
      EXPECT_EQ(r.reliability[i], 0);
      // Towards the inside no further than the noise along a tilted normal takes it.
      const Eigen::Vector3d n = planted_normal(clean.V.row(i)), d = r.mesh.V.row(i) - m.V.row(i);
      EXPECT_LT((d - n * n.dot(d)).norm(), 0.3);
      before += std::pow(planted_distance(m.V.row(i)), 2), after += std::pow(planted_distance(r.mesh.V.row(i)), 2);
    }
    EXPECT_LT(after, 0.6 * before);
  }
}

TEST(Denoise, CurtainsAtTheBorderAreUnreliable) {
  Mesh m = plane_grid(40, 40, 40, 40);
  const int corner = 20 * 41;  // on the left border; its neighbour inside is torn 8 mm back
  m.V(corner + 1, 2) = -8, m.V(corner + 42, 2) = -8, m.V(corner + 43, 2) = -8;
  const DenoiseResult r = denoised(m, DenoiseMethod::none);
  EXPECT_EQ(r.reliability[corner + 1], 0);
  EXPECT_EQ(r.reliability[10 * 41 + 20], 1);
}

TEST(Denoise, MovesWithTheScan) {
  Mesh m = noisy_bumps(0.3);
  plant_spikes(m, 0.005, 10, 3);
  Random random(9);
  const Eigen::Matrix3d R = random_rotation(random);
  const Eigen::RowVector3d t(30, -70, 500);
  Mesh turned = m;
  turned.V = (m.V * R.transpose()).rowwise() + t;
  for (const auto method : {DenoiseMethod::automatic, DenoiseMethod::median, DenoiseMethod::bilateral}) {
    const DenoiseResult a = denoised(m, method), b = denoised(turned, method);
    EXPECT_EQ(a.spikes, b.spikes);
    // Rounding may tip a window's last ring in or out at one vertex in ten thousand; it never moves anything far.
    const Vertices moved = (a.mesh.V * R.transpose()).rowwise() + t;
    EXPECT_LT((moved - b.mesh.V).rowwise().norm().mean(), 1e-6);
    EXPECT_LT((moved - b.mesh.V).rowwise().norm().maxCoeff(), 0.3);
  }
}

TEST(Denoise, SameScanSameBytes) {
  Mesh m = noisy_bumps(0.3);
  plant_spikes(m, 0.005, 10, 3);
  for (const auto method : {DenoiseMethod::automatic, DenoiseMethod::median, DenoiseMethod::bilateral})
    EXPECT_THAT(denoised(m, method).mesh.V, SameBytes(denoised(m, method).mesh.V));
}

TEST(Denoise, TellsWhatItDid) {
  Mesh m = noisy_bumps(0.3);
  const auto planted = plant_spikes(m, 0.005, 0, 3);
  const DenoiseResult r = denoise(m);
  EXPECT_EQ(r.summary.spikes, static_cast<int>(r.spikes.size()));
  EXPECT_TRUE(std::is_sorted(r.spikes.begin(), r.spikes.end()));
  EXPECT_GT(r.summary.filtered, 0.9 * static_cast<double>(m.V.rows()));
  EXPECT_NEAR(r.summary.rms_motion, 0.3, 0.05);
  EXPECT_EQ(r.mesh.F, m.F);
}

TEST(Denoise, RefusesOptionsOutOfRange) {
  const Mesh m = plane_grid(5, 5, 1, 1);
  const auto refused = [&m](auto change) {
    DenoiseOptions o;
    change(o);
    EXPECT_THROW(denoise(m, o), InvalidInput);
  };
  refused([](DenoiseOptions& o) { o.spike_isolation = 0; });
  refused([](DenoiseOptions& o) { o.widest = 1; });
  refused([](DenoiseOptions& o) { o.passes = -1; });
  refused([](DenoiseOptions& o) { o.bilateral_sigma = std::nan(""); });
  refused([](DenoiseOptions& o) { o.largest_cluster = 0; });
}

TEST(Denoise, TakesMeshesTooSmallToTellAnything) {
  for (const auto method : {DenoiseMethod::automatic, DenoiseMethod::gaussian, DenoiseMethod::median,
                            DenoiseMethod::bilateral, DenoiseMethod::none}) {
    EXPECT_EQ(denoised(Mesh(), method).mesh.V.rows(), 0);
    EXPECT_THAT(denoised(plane_grid(1, 1, 1, 1), method).mesh.V, VerticesNear(plane_grid(1, 1, 1, 1).V, 1e-9));
    EXPECT_THAT(denoised(icosphere(0, 50), method).mesh.V.rows(), 12);
  }
}

}  // namespace
}  // namespace facewright
