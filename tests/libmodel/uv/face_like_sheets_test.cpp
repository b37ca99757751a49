// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/uv/isomap.h"
#include "surfaces.h"

namespace facewright {
namespace {

using testing::round_sheet;
using testing::Sheet;
using testing::sheet;

// A cap of a sphere up to `angle` from its pole.
Eigen::Vector3d on_cap(double angle, double r, double a, double radius = 90) {
  const double t = angle * r;
  return radius * Eigen::Vector3d(std::sin(t) * std::sin(a), std::sin(t) * std::cos(a), std::cos(t));
}
Sheet cap(double angle, int rings = 9) {
  return round_sheet(rings, [=](double r, double a) { return on_cap(angle, r, a); });
}
// A head seen from the front with a nose as long as it is wide.
Sheet deep_nose(double length) {
  return round_sheet(9, [=](double r, double a) {
    const double across = r * std::sin(a), up = r * std::cos(a);
    const double bump = std::exp(-30 * (across * across + 0.4 * up * up));
    return Eigen::Vector3d(on_cap(1.3, r, a) + Eigen::Vector3d(0, 0, length * bump));
  });
}
Sheet noisy(Sheet s, double sigma) {
  Random random(3);
  for (Eigen::Index i = 0; i < s.V.size(); ++i) s.V.data()[i] += sigma * random.normal();
  return s;
}

void expect_one_to_one(const Sheet& s, const IsomapOptions& options = {}) {
  const IsomapResult result = isomap_uv(s.V, s.F, s.mirror, options);
  const IsomapSummary& r = result.summary;
  EXPECT_TRUE(result.uv.allFinite());
  EXPECT_EQ(r.distortion.flips, 0) << r.repair;
  EXPECT_EQ(overlap_share(result.uv, s.F, 2048), 0) << r.repair;
  EXPECT_GE(result.uv.minCoeff(), 0);
  EXPECT_LE(result.uv.maxCoeff(), 1);
  std::printf("[ figures  ] %s; %d steps, %s; stress %.3f to %.3f, L2 %.3f, Linf %.1f\n", r.repair.c_str(),
              r.iterations, r.stop.c_str(), r.stress, r.final_stress, r.distortion.l2, r.distortion.linf);
}

TEST(FaceLikeSheets, ADeepNoseMapsOneToOne) {
  for (const double length : {40.0, 160.0}) expect_one_to_one(deep_nose(length));
}

TEST(FaceLikeSheets, MoreThanHalfAHeadMapsOneToOne) {
  for (const double angle : {1.6, 2.2, 2.7}) expect_one_to_one(cap(angle));
}

TEST(FaceLikeSheets, ANoisyMeshMapsOneToOne) {
  expect_one_to_one(noisy(cap(1.3), 1.5));
  expect_one_to_one(noisy(cap(1.3), 5));  // half an edge: folded triangles
}

TEST(FaceLikeSheets, SeveralHolesMapOneToOne) {
  const Sheet s = cap(1.4, 10);
  const auto hole = [&](int v, double x, double y, double radius) {
    return (s.plane.row(v) - Eigen::RowVector2d(x, y)).norm() < radius;
  };
  expect_one_to_one(testing::without_vertices(
      s, [&](int v) { return hole(v, 0.4, 0.3, 0.15) || hole(v, -0.4, 0.3, 0.15) || hole(v, 0, -0.4, 0.2); }));
}

TEST(FaceLikeSheets, ALongSlitMapsOneToOneOpenOrClosed) {
  const int m = 21, k = 11;
  const Sheet s = sheet(m, k, [](double a, double b) {
    return Eigen::Vector3d(90 * std::sin(a), 80 * b,
                           90 * std::cos(a) - 10 * b * b + 0.7 * std::sin(17 * b * (1 + a * a)));
  });
  for (const double gap : {5.0, 0.0}) expect_one_to_one(testing::with_slit(s, m, 4, 2, 18, gap));
  for (const double gap : {0.1, 1e-6}) {
    Sheet cut = testing::with_slit(s, m, 4, 2, 18, gap);
    cut.mirror.clear();
    expect_one_to_one(cut);
  }
}

TEST(FaceLikeSheets, ASheetOverlappingItselfWhenUnrolledIsTakenApart) {
  // A flat ring of 1.2 turns: nothing folds, but its ends lie on each other.
  const Sheet ring = sheet(61, 5, [](double s, double t) {
    const double a = 1.2 * std::numbers::pi * s, r = 50 + 15 * t;
    return Eigen::Vector3d(r * std::sin(a), r * std::cos(a), 12 * s);
  });
  expect_one_to_one(ring);
}

TEST(FaceLikeSheets, TrianglesWithoutAreaDoNoHarm) {
  Sheet s = cap(1.2);
  s.V.row(30) = s.V.row(31);  // an edge of no length
  s.mirror.clear();
  expect_one_to_one(s);
}

TEST(FaceLikeSheets, SymmetricVerticesWithOtherTrianglesMapOneToOne) {
  Sheet s = noisy(cap(1.4), 1);
  expect_one_to_one(s);
  Sheet grid = sheet(
      15, 15, [](double a, double b) { return Eigen::Vector3d(50 * a, 50 * b, 60 * std::exp(-6 * (a * a + b * b))); });
  for (Eigen::Index f = 0; f + 1 < grid.F.rows(); f += 2) {  // all diagonals the same way
    const int v = grid.F.row(f).minCoeff();
    grid.F.row(f) << v, v + 1, v + 16;
    grid.F.row(f + 1) << v, v + 16, v + 15;
  }
  expect_one_to_one(grid);
}

TEST(FaceLikeSheets, ManyVerticesUseSpreadSources) {
  const Sheet s = cap(1.3, 20);  // 1261 vertices
  const IsomapSummary r = isomap_uv(s.V, s.F, s.mirror).summary;
  EXPECT_LE(r.source_count, 301);
  EXPECT_EQ(r.distortion.flips, 0);
  EXPECT_EQ(r.overlap, 0);
  EXPECT_EQ(r.stop, "converged");
}

std::string refusal(const Vertices& V, const Faces& F) {
  try {
    isomap_uv(V, F, {});
  } catch (const InvalidInput& e) {
    return e.what();
  }
  return "accepted";
}

TEST(FaceLikeSheets, RefusalsNameTheCure) {
  const Sheet s = cap(1.0, 4);
  Faces closed(4, 3);
  closed << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3;
  EXPECT_NE(refusal(s.V.topRows(4), closed).find("cut"), std::string::npos);
  Vertices twice(2 * s.V.rows(), 3);
  twice << s.V, (s.V.rowwise() + Eigen::RowVector3d(300, 0, 0));
  Faces both(2 * s.F.rows(), 3);
  both << s.F, (s.F.array() + static_cast<int>(s.V.rows())).matrix();
  EXPECT_NE(refusal(twice, both).find("largest piece"), std::string::npos);
  // A torus with one triangle missing: one border, one handle.
  const int n = 8;
  Vertices torus(n * n, 3);
  Faces F(2 * n * n, 3);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double a = 2 * std::numbers::pi * i / n, b = 2 * std::numbers::pi * j / n;
      torus.row(i * n + j) << (3 + std::cos(b)) * std::cos(a), (3 + std::cos(b)) * std::sin(a), std::sin(b);
      const int p = i * n + j, q = (i + 1) % n * n + j, r = (i + 1) % n * n + (j + 1) % n, t = i * n + (j + 1) % n;
      F.row(2 * (i * n + j)) << p, q, r;
      F.row(2 * (i * n + j) + 1) << p, r, t;
    }
  EXPECT_NE(refusal(torus, F.topRows(2 * n * n - 1)).find("handle"), std::string::npos);
  Vertices nan = s.V;
  nan(3, 1) = std::nan("");
  EXPECT_NE(refusal(nan, s.F).find("NaN"), std::string::npos);
}

}  // namespace
}  // namespace facewright
