// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/isomap.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/uv/exact_geodesics.h"
#include "libmodel/uv/isomap_texture.h"
#include "surfaces.h"

namespace facewright {
namespace {

using testing::Sheet;
using testing::sheet;

// About 120 x 80 mm, flat, with a bulging border and no three vertices in line: where a straight line meets vertices,
// rounding decides which of the equal paths is followed, and that costs up to 0.2 %.
Sheet plane() {
  return sheet(15, 11, [](double s, double t) {
    const double a = std::abs(s), sign = s < 0 ? -1 : 1;
    const double dx = s == 0 || a == 1 ? 0 : 1.3 * std::sin(37 * a + 91 * t),
                 dy = std::abs(t) == 1 ? 0 : std::sin(53 * a + 71 * t);
    return Eigen::Vector3d(sign * (60 * a * (1.1 - 0.1 * t * t) + dx), 40 * t * (1.1 - 0.1 * s * s) + dy, 0);
  });
}
// The same sheet rolled around a vertical axis of 50 mm: an isometry.
Sheet cylinder(int m = 41) {
  return sheet(m, 15, [](double s, double t) {
    const double a = 60 * s / 50;
    return Eigen::Vector3d(50 * std::sin(a), 40 * t, 50 * std::cos(a));
  });
}
// A sector of a cone: developable, not a rectangle.
Sheet cone(int m = 41) {
  return sheet(m, 15, [](double s, double t) {
    const double along = 80 + 40 * t, a = 1.2 * s;  // half angle 30 degrees
    return Eigen::Vector3d(along * 0.5 * std::sin(a), -along * std::sqrt(0.75), along * 0.5 * std::cos(a));
  });
}
// A spherical patch of half width `angle`.
Sheet dome(double angle) {
  return sheet(17, 17, [angle](double s, double t) {
    const Eigen::Vector3d p(std::tan(angle * s), std::tan(angle * t), 1);
    return Eigen::Vector3d(80 * p.normalized());
  });
}

// Largest difference between uv and the planar positions P after the best uniform scaling, as a share of the size.
double error_against(const TexCoords& uv, const Eigen::MatrixX2d& P) {
  const Eigen::MatrixX2d a = uv.rowwise() - uv.colwise().mean(), b = P.rowwise() - P.colwise().mean();
  const double scale = a.cwiseProduct(b).sum() / b.squaredNorm();
  return (a - scale * b).rowwise().norm().maxCoeff();
}

IsomapOptions spread(int sources) {
  IsomapOptions options;
  options.landmark_count = sources;
  return options;
}

constexpr double kExact = 1e-6;  // squared distances and their eigenvectors lose half the digits

TEST(IsomapUv, LeavesAPlaneAsItIs) {
  const Sheet s = plane();
  const IsomapResult result = isomap_uv(s.V, s.F, s.mirror);
  EXPECT_LT(error_against(result.uv, s.V.leftCols<2>()), kExact);
  EXPECT_LT(result.summary.stress, kExact);
  EXPECT_NEAR(result.summary.distortion.l2, 1, kExact);
  EXPECT_NEAR(result.summary.distortion.linf, 1, kExact);
}

TEST(IsomapUv, UnrollsACylinder) {
  const Sheet s = cylinder();
  const Eigen::MatrixX2d flat = s.plane * Eigen::Vector2d(60, 40).asDiagonal();
  const IsomapResult result = isomap_uv(s.V, s.F, s.mirror, spread(100));
  EXPECT_LT(error_against(result.uv, flat), 1e-3);
  EXPECT_LT(result.summary.stress, 1e-3);
  EXPECT_LT(result.summary.distortion.l2, 1.001);
}

TEST(IsomapUv, UnrollsACone) {
  const Sheet s = cone();
  const IsomapResult result = isomap_uv(s.V, s.F, s.mirror, spread(100));
  EXPECT_LT(result.summary.stress, 1e-3);
  EXPECT_LT(result.summary.distortion.l2, 1.001);
  EXPECT_EQ(result.summary.distortion.flips, 0);
}

TEST(IsomapUv, CylinderErrorShrinksWithResolution) {
  const auto error = [](int m) {
    const Sheet s = cylinder(m);
    const Eigen::MatrixX2d flat = s.plane * Eigen::Vector2d(60, 40).asDiagonal();
    const TexCoords uv = isomap_uv(s.V, s.F, s.mirror).uv;
    const double width = uv.col(0).maxCoeff() - uv.col(0).minCoeff();
    const double height = uv.col(1).maxCoeff() - uv.col(1).minCoeff();
    return std::abs(width / height - 120.0 / 80);
  };
  EXPECT_LT(error(21), 0.5 * error(11));
}

TEST(IsomapUv, ADomeStretchesLikeTheAzimuthalEquidistantMap) {
  const double angle = 0.6;
  const Sheet s = dome(angle);
  TexCoords equidistant(s.V.rows(), 2);
  for (Eigen::Index v = 0; v < s.V.rows(); ++v) {
    const Eigen::Vector2d xy(s.V(v, 0), s.V(v, 1));
    const double a = std::atan2(xy.norm(), s.V(v, 2));
    equidistant.row(v) = xy.norm() > 0 ? (80 * a * xy.normalized()).eval() : Eigen::Vector2d::Zero().eval();
  }
  IsomapOptions options;
  options.iterations = 0;
  const IsomapResult result = isomap_uv(s.V, s.F, s.mirror, options);
  EXPECT_EQ(result.summary.distortion.flips, 0);
  EXPECT_LT(error_against(result.uv, equidistant), 0.02);
  EXPECT_LT(result.summary.distortion.l2, measure_distortion(s.V, s.F, equidistant).l2 * 1.01);
}

TEST(IsomapUv, LowersStressAndStretchAtOnceAndKeepsSymmetry) {
  const Sheet s = sheet(
      15, 15, [](double a, double b) { return Eigen::Vector3d(50 * a, 50 * b, 60 * std::exp(-6 * (a * a + b * b))); });
  IsomapOptions plain;
  plain.iterations = 0;
  const IsomapResult a = isomap_uv(s.V, s.F, s.mirror, plain), b = isomap_uv(s.V, s.F, s.mirror);
  EXPECT_EQ(b.summary.stop, "converged");
  EXPECT_LT(b.summary.distortion.symmetric_dirichlet, a.summary.distortion.symmetric_dirichlet);
  EXPECT_LT(b.summary.distortion.linf, a.summary.distortion.linf);
  EXPECT_LT(b.summary.final_stress, a.summary.final_stress);
  EXPECT_EQ(b.summary.distortion.flips, 0);
  EXPECT_EQ(b.summary.overlap, 0);
  for (size_t v = 0; v < s.mirror.size(); ++v)
    EXPECT_NEAR(b.uv(static_cast<int>(v), 0) + b.uv(s.mirror[v], 0), 1, 1e-9);
}

TEST(IsomapUv, MoreStretchWeightTradesStressForStretch) {
  const Sheet s = dome(1.0);
  double stress = 0, stretch = 1e9;
  for (const double weight : {1e-4, 1e-2, 1.0}) {
    IsomapOptions options;
    options.stretch_weight = weight;
    const IsomapSummary summary = isomap_uv(s.V, s.F, s.mirror, options).summary;
    EXPECT_GT(summary.final_stress, stress);
    EXPECT_LT(summary.distortion.symmetric_dirichlet, stretch);
    stress = summary.final_stress, stretch = summary.distortion.symmetric_dirichlet;
  }
}

TEST(IsomapUv, ClosesASlit) {
  const Sheet s = plane();
  // Two missing quads beside the midline, as a mouth.
  const int first = 2 * (3 * 14 + 6);
  const Faces F = testing::without(s.F, [&](int f) { return f >= first && f < first + 4; });
  const IsomapResult result = isomap_uv(s.V, F, s.mirror);
  EXPECT_LT(error_against(result.uv, s.V.leftCols<2>()), 1e-6);
  EXPECT_EQ(result.summary.distortion.flips, 0);
  EXPECT_EQ(result.summary.overlap, 0);
}

TEST(IsomapUv, FillsTheUnitSquareUprightAndSymmetric) {
  const Sheet s = dome(0.8);
  const TexCoords uv = isomap_uv(s.V, s.F, s.mirror).uv;
  EXPECT_NEAR(std::min(uv.col(0).minCoeff(), uv.col(1).minCoeff()), 0.01, 1e-12);
  EXPECT_NEAR(std::max(uv.col(0).maxCoeff(), uv.col(1).maxCoeff()), 0.99, 1e-12);
  for (size_t v = 0; v < s.mirror.size(); ++v) {
    EXPECT_NEAR(uv(static_cast<int>(v), 0) + uv(s.mirror[v], 0), 1, 1e-12);
    EXPECT_NEAR(uv(static_cast<int>(v), 1), uv(s.mirror[v], 1), 1e-12);
  }
  EXPECT_GT(uv(16 * 17 + 16, 0), 0.5);  // +x, +y corner is right and up
  EXPECT_GT(uv(16 * 17 + 16, 1), 0.5);
}

TEST(IsomapUv, DoesNotChangeWithPosition) {
  Sheet s = plane();
  s.V.col(2) = 30 - 0.01 * s.V.leftCols<2>().rowwise().squaredNorm().array();
  IsomapOptions options;
  options.landmark_count = 0;  // equal distances may choose other landmarks
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  const Vertices moved = (s.V * R.transpose()).rowwise() + Eigen::RowVector3d(10, -20, 30);
  const TexCoords a = isomap_uv(s.V, s.F, s.mirror, options).uv, b = isomap_uv(moved, s.F, s.mirror, options).uv;
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(IsomapUv, AMirroredFaceHasAMirroredMap) {
  Sheet s = sheet(13, 9, [](double a, double b) {
    return Eigen::Vector3d(60 * a + 4 * b, 40 * b,
                           20 - 20 * a * a + 5 * a * b - 4 * std::exp(-9 * (a - 0.4) * (a - 0.4)));
  });
  Vertices reflected = s.V;
  reflected.col(0) *= -1;
  Faces F = s.F;
  F.col(1).swap(F.col(2));
  IsomapOptions options;
  options.landmark_count = 0;
  const TexCoords a = isomap_uv(s.V, s.F, {}, options).uv, b = isomap_uv(reflected, F, {}, options).uv;
  EXPECT_LT(((a.col(0) + b.col(0)).array() - 1).abs().maxCoeff(), 1e-6);
  EXPECT_LT((a.col(1) - b.col(1)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(IsomapUv, LandmarksComeNearTheFullIsomap) {
  const Sheet s = dome(0.8);
  IsomapOptions all, some;
  all.landmark_count = 0;
  some.landmark_count = 60;
  const IsomapResult a = isomap_uv(s.V, s.F, s.mirror, all), b = isomap_uv(s.V, s.F, s.mirror, some);
  EXPECT_EQ(a.summary.source_count, 289);
  EXPECT_LE(b.summary.source_count, 61);
  EXPECT_LT((a.uv - b.uv).rowwise().norm().maxCoeff(), 0.02);
  EXPECT_LT(b.summary.distortion.l2, a.summary.distortion.l2 * 1.01);
}

TEST(IsomapUv, BytesDoNotDependOnThreads) {
  const Sheet s = dome(0.5);
  IsomapOptions one, three;
  one.threads = 1;
  three.threads = 3;
  EXPECT_EQ(isomap_uv(s.V, s.F, s.mirror, one).uv, isomap_uv(s.V, s.F, s.mirror, three).uv);
}

TEST(IsomapUv, RepairsFoldedMaps) {
  // A tall hat: the plain scaling folds its steep side over the flat top.
  const Sheet s = sheet(17, 17, [](double a, double b) {
    const double r2 = a * a + b * b;
    return Eigen::Vector3d(50 * a, 50 * b, 90 * std::exp(-9 * r2));
  });
  const IsomapResult result = isomap_uv(s.V, s.F, s.mirror);
  EXPECT_EQ(result.summary.distortion.flips, 0) << result.summary.repair;
  EXPECT_EQ(result.summary.overlap, 0);
}

TEST(IsomapUv, RefusesNegativeCountsByName) {
  const Sheet s = plane();
  for (const auto& [name, member] : {std::pair("landmark_count", &IsomapOptions::landmark_count),
                                     {"repair_sweeps", &IsomapOptions::repair_sweeps},
                                     {"iterations", &IsomapOptions::iterations},
                                     {"threads", &IsomapOptions::threads}}) {
    IsomapOptions options;
    options.*member = -1;
    try {
      isomap_uv(s.V, s.F, s.mirror, options);
      FAIL() << name;
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

TEST(IsomapUv, RefusesWhatHasNoMap) {
  const Sheet s = plane();
  Faces pieces = testing::without(s.F, [](int f) { return f / 28 == 4; });
  EXPECT_THROW(isomap_uv(s.V, pieces, s.mirror), InvalidInput);
  Faces tetrahedron(4, 3);
  tetrahedron << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3;
  Vertices corners(4, 3);
  corners << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  EXPECT_THROW(isomap_uv(corners, tetrahedron, {}), InvalidInput);
  EXPECT_THROW(isomap_uv(s.V, s.F, {1, 0}), InvalidInput);
}

TEST(ExactGeodesics, AreStraightLinesOnAPlaneAndArcsOnACylinder) {
  const Sheet flat = plane(), rolled = cylinder(81);
  const Eigen::MatrixXd D = exact_geodesics(flat.V, flat.F, {0, 40});
  for (Eigen::Index v = 0; v < flat.V.rows(); ++v) EXPECT_NEAR(D(1, v), (flat.V.row(v) - flat.V.row(40)).norm(), 1e-9);
  const double across = exact_geodesics(rolled.V, rolled.F, {0})(0, 80);
  EXPECT_NEAR(across, 120, 0.02);  // the polygon's chord is shorter by 1/24 of the squared angle per facet
}

TEST(Distortion, OfAKnownStretch) {
  const Sheet s = plane();
  const TexCoords wide = s.V.leftCols<2>() * Eigen::Vector2d(2, 0.5).asDiagonal();
  const UvDistortion d = measure_distortion(s.V, s.F, wide);
  EXPECT_NEAR(d.l2, std::sqrt((0.25 + 4) / 2), 1e-12);
  EXPECT_NEAR(d.linf, 2, 1e-12);
  EXPECT_NEAR(d.conformal, (4 + 0.25) / 2, 1e-12);
  EXPECT_NEAR(d.area, 1, 1e-12);
  EXPECT_EQ(d.flips, 0);
  TexCoords over = wide;
  over.col(0) *= -1;
  EXPECT_EQ(measure_distortion(s.V, s.F, over).flips, s.F.rows());
}

TEST(Distortion, OverlapIsFoundWhereTrianglesCrossEachOther) {
  TexCoords uv(4, 2);
  uv << 0.1, 0.1, 0.9, 0.1, 0.9, 0.9, 0.1, 0.9;
  Faces F(2, 3);
  F << 0, 1, 2, 0, 2, 3;
  EXPECT_EQ(overlap_share(uv, F), 0);
  F << 0, 1, 2, 0, 1, 3;
  EXPECT_NEAR(overlap_share(uv, F), 1.0 / 3, 0.01);
}

TEST(IsomapTexture, LevelsShareCoordinates) {
  const Sheet s = dome(0.5);
  MultiresTemplate t;
  t.V = s.V;
  t.mirror = s.mirror;
  t.levels = {{289, s.F}, {290, s.F}};
  t.V.conservativeResize(290, 3);
  t.V.row(289) = 0.5 * (s.V.row(0) + s.V.row(1));
  t.mirror.push_back(289);
  t.parents = {{0, 1, -1}};
  const IsomapTexture texture = isomap_texture(t, t.V);
  EXPECT_EQ(texture.uv.rows(), 290);
  EXPECT_EQ(texture.uv.topRows(289), isomap_uv(s.V, s.F, s.mirror).uv);
  EXPECT_EQ(texture.distortion.size(), 2u);
  EXPECT_EQ(texture.distortion[1].flips, 0);
}

}  // namespace
}  // namespace facewright
