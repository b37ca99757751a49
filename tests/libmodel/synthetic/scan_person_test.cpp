// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/scan_person.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "tests/libmodel/synthetic/shared_face.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

SyntheticPerson someone() { return draw_person(shared_face(), 21, 3); }

/// Distances of the scan's vertices (mm) from their stated places on the true surface.
Eigen::VectorXd offsets(const SyntheticScan& scan, double unit = 1) {
  Eigen::VectorXd d(scan.mesh.V.rows());
  for (Eigen::Index v = 0; v < d.size(); ++v)
    d[v] =
        (row(scan.mesh.V, v) / unit - position(scan.source[static_cast<size_t>(v)], scan.truth.V, scan.truth.F)).norm();
  return d;
}

TEST(ScanPerson, PerfectScanLiesOnTheTruthAtTheStatedPlaces) {
  const SyntheticScan scan = scan_person(shared_face(), someone(), 1, 0, perfect_scanner());
  ASSERT_EQ(scan.source.size(), static_cast<size_t>(scan.mesh.V.rows()));
  EXPECT_LT(offsets(scan).maxCoeff(), 1e-9);
  for (const auto& [name, mark] : scan.landmarks)
    EXPECT_LT((mark.position - scan.true_landmarks.at(name).position).norm(), 1e-12) << name;
}

TEST(ScanPerson, TruthHoldsInEveryPoseAndUnit) {
  ScannerOptions o = perfect_scanner();
  o.pose_deg = 30;
  o.unit = 0.1;
  const SyntheticScan scan = scan_person(shared_face(), someone(), 1, 0, o);
  EXPECT_LT(offsets(scan, o.unit).maxCoeff(), 1e-9);
  EXPECT_LT((scan.scanner_from_head.R * scan.scanner_from_head.R.transpose() - Eigen::Matrix3d::Identity()).norm(),
            1e-12);
  const Vertices expected = scan.scanner_from_head.apply(shared_face().mesh(someone()).V);
  EXPECT_LT((scan.truth.V - expected).rowwise().norm().maxCoeff(), 1e-9);
}

TEST(ScanPerson, IsOneManifoldPieceOfOutwardTriangles) {
  const SyntheticScan scan = scan_person(shared_face(), someone(), 1, 0, perfect_scanner());
  EXPECT_NO_THROW(edges(scan.mesh.F));
  EXPECT_EQ(connected_components(scan.mesh.V.rows(), scan.mesh.F).count, 1);
  EXPECT_GT(scan.mesh.V.rows(), 25000);
  int inward = 0;
  for (Eigen::Index f = 0; f < scan.mesh.F.rows(); ++f) {
    Vector3d out = row(scan.mesh.V, scan.mesh.F(f, 0)) + Vector3d{0, 0, 25};
    out.y() = 0;
    inward += facet_normal(scan.mesh.V, scan.mesh.F, f).dot(out) <= 0;
  }
  EXPECT_EQ(inward, 0);
}

TEST(ScanPerson, CoversTheFace) {
  const SyntheticScan scan = scan_person(shared_face(), someone(), 1, 0, perfect_scanner());
  for (const char* name : {"9", "28", "31", "37", "46", "49", "55", "58", "left_cheek", "right_forehead"}) {
    const Vector3d p = scan.true_landmarks.at(name).position;
    EXPECT_LT((scan.mesh.V.rowwise() - p.transpose()).rowwise().norm().minCoeff(), 2.0) << name;
  }
}

TEST(ScanPerson, TriangulationIsItsOwn) {
  const SyntheticScan a = scan_person(shared_face(), someone(), 1, 0, perfect_scanner());
  const SyntheticScan b = scan_person(shared_face(), someone(), 1, 1, perfect_scanner());
  EXPECT_NE(a.mesh.V.rows(), b.mesh.V.rows());
  int at_vertices = 0;
  for (const SurfacePoint& p : a.source) at_vertices += p.barycentric.maxCoeff() > 1 - 1e-6;
  EXPECT_LT(at_vertices, 10);
}

TEST(ScanPerson, SpacingSetsTheDensity) {
  ScannerOptions fine = perfect_scanner(), coarse = perfect_scanner();
  coarse.spacing = 2 * fine.spacing;
  const double ratio = static_cast<double>(scan_person(shared_face(), someone(), 1, 0, fine).mesh.V.rows()) /
                       static_cast<double>(scan_person(shared_face(), someone(), 1, 0, coarse).mesh.V.rows());
  EXPECT_NEAR(ratio, 4, 0.5);  // the ragged border takes its share
}

TEST(ScanPerson, NoiseSpikesHolesAndMissingLandmarksComeAsOrdered) {
  ScannerOptions o = perfect_scanner();
  o.noise = 0.3;
  const Eigen::VectorXd d = offsets(scan_person(shared_face(), someone(), 1, 0, o));
  EXPECT_NEAR(std::sqrt(d.squaredNorm() / static_cast<double>(d.size())), 0.3 * std::sqrt(1.25), 0.05);

  o = perfect_scanner();
  o.spikes = 0.01;
  const SyntheticScan spiky = scan_person(shared_face(), someone(), 1, 0, o);
  const double share =
      static_cast<double>((offsets(spiky).array() > 3.9).count()) / static_cast<double>(spiky.mesh.V.rows());
  EXPECT_NEAR(share, 0.01, 0.003);

  o = perfect_scanner();
  const auto boundary = [&] { return boundary_loops(scan_person(shared_face(), someone(), 1, 5, o).mesh.F).size(); };
  const size_t whole = boundary();
  o.holes = 12;
  EXPECT_GT(boundary(), whole);

  o = perfect_scanner();
  o.missing_landmarks = 0.5;
  o.landmark_noise = 2;
  const SyntheticScan marked = scan_person(shared_face(), someone(), 1, 0, o);
  EXPECT_NEAR(static_cast<double>(marked.landmarks.size()) / static_cast<double>(marked.true_landmarks.size()), 0.5,
              0.2);
  double squared = 0;
  for (const auto& [name, mark] : marked.landmarks)
    squared += (mark.position - marked.true_landmarks.at(name).position).squaredNorm();
  EXPECT_NEAR(std::sqrt(squared / static_cast<double>(marked.landmarks.size())), 2, 0.5);
}

TEST(ScanPerson, IsReproducible) {
  const SyntheticScan a = scan_person(shared_face(), someone(), 8, 2), b = scan_person(shared_face(), someone(), 8, 2);
  EXPECT_EQ(a.mesh.V, b.mesh.V);
  EXPECT_EQ(a.mesh.F, b.mesh.F);
  EXPECT_EQ(a.mesh.colours, b.mesh.colours);
  EXPECT_EQ(a.truth.V, b.truth.V);
}

TEST(ScanPerson, TextureShowsTheColoursOfTheVertices) {
  ScannerOptions o = perfect_scanner();
  o.spacing = 3;
  const SyntheticScan scan = scan_person(shared_face(), someone(), 1, 0, o);
  const Image image = paint_texture(shared_face(), someone(), scan, 512);
  EXPECT_GE(scan.mesh.uv.minCoeff(), 0);
  EXPECT_LE(scan.mesh.uv.maxCoeff(), 1);
  double sum = 0;
  for (Eigen::Index v = 0; v < scan.mesh.V.rows(); ++v) {
    const Eigen::Vector2d p{scan.mesh.uv(v, 0) * 512 - 0.5, (1 - scan.mesh.uv(v, 1)) * 512 - 0.5};
    sum += (sample_linear(image, p) - row(scan.mesh.colours, v)).norm();
  }
  EXPECT_LT(sum / static_cast<double>(scan.mesh.V.rows()), 0.02);  // pores and hairs are finer than a pixel
}

TEST(ScanPerson, RefusesOptionsOutOfRange) {
  const auto refuses = [](auto set) {
    ScannerOptions o;
    set(o);
    EXPECT_THROW(scan_person(shared_face(), someone(), 1, 0, o), InvalidInput);
  };
  refuses([](ScannerOptions& o) { o.spacing = 0; });
  refuses([](ScannerOptions& o) { o.noise = -1; });
  refuses([](ScannerOptions& o) { o.spikes = 0.9; });
  refuses([](ScannerOptions& o) { o.holes = -3; });
  refuses([](ScannerOptions& o) { o.unit = 0; });
  refuses([](ScannerOptions& o) { o.landmark_noise = std::nan(""); });
}

}  // namespace
}  // namespace facewright
