// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_scan.h"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

const Similarity place{1, rotation({0.3, -0.2, 0.1}), {30, -40, 90}};

struct Subject {
  Eigen::VectorXd coefficients;
  Mesh scan;  ///< its vertices are not the model's: middles of the triangles
  Vertices V;
  Landmarks marks;
};

/// The face seen by other points than the model's: the centres of its triangles, joined over neighbouring cells.
Subject subject(const MorphableModel& model, std::uint64_t seed, double noise = 0, const Similarity& pose = place) {
  Random random(seed);
  Subject s;
  s.coefficients = model.shape().draw_coefficients(random).cwiseMax(-2).cwiseMin(2);
  s.V = pose.apply(model.instance(s.coefficients).V);
  const Faces& F = model.faces();
  s.scan.V = s.V;
  s.scan.V.conservativeResize(s.V.rows() + F.rows(), 3);
  s.scan.F.resize(3 * F.rows(), 3);
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const int a = F(f, 0), b = F(f, 1), c = F(f, 2), m = static_cast<int>(s.V.rows() + f);
    s.scan.V.row(m) = (s.V.row(a) + s.V.row(b) + s.V.row(c)) / 3;
    s.scan.F.middleRows<3>(3 * f) << a, b, m, b, c, m, c, a, m;
  }
  for (Eigen::Index i = 0; i < s.scan.V.size(); ++i) s.scan.V.data()[i] += noise * random.normal();
  for (const char* name : {"9", "28", "31", "37", "46", "49", "55"})
    s.marks[name].position = s.V.row(model.landmarks().at(name).vertex).transpose();
  return s;
}

/// Trusts a scan that has no noise.
FitScanOptions clean() {
  FitScanOptions options;
  options.sigma_mm = 0.1;
  options.slide = 0;
  options.tolerance = 1e-4;
  options.iterations = 100;
  return options;
}

double mean_error(const Vertices& A, const Vertices& B) { return (A - B).rowwise().norm().mean(); }

TEST(FitScan, PlantedFacesComeBack) {
  const MorphableModel model = toy_model();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Subject s = subject(model, seed);
    const FitScanResult fit = fit_scan(model, s.scan, s.marks, clean());
    EXPECT_LT(mean_error(fit.fitted, s.V), 0.1);  // the prior is left
    EXPECT_LT(mean_error(fit.fitted, s.V), 0.02 * mean_error(place.apply(model.mean().V), s.V));
  }
}

TEST(FitScan, PointsAloneAreEnough) {
  const MorphableModel model = toy_model();
  Subject s = subject(model, 2);
  s.scan.F.resize(0, 3);
  EXPECT_LT(mean_error(fit_scan(model, s.scan, s.marks).fitted, s.V), 0.3);
}

TEST(FitScan, APoseIsEnoughToStartFrom) {
  const MorphableModel model = toy_model();
  const Subject s = subject(model, 3);
  const Similarity near = place * Similarity{1, rotation({0.05, 0.05, 0}), {2, -2, 3}};
  EXPECT_LT(mean_error(fit_scan(model, s.scan, near, clean()).fitted, s.V), 0.3);
}

TEST(FitScan, MovesWithTheScan) {
  const MorphableModel model = toy_model();
  const Subject a = subject(model, 4, 0.2, {}), b = subject(model, 4, 0);
  Subject moved = a;
  moved.scan.V = place.apply(a.scan.V);
  for (auto& [name, mark] : moved.marks) mark.position = place * mark.position;
  const FitScanResult one = fit_scan(model, a.scan, a.marks), other = fit_scan(model, moved.scan, moved.marks);
  EXPECT_THAT(other.fitted, VerticesNear(place.apply(one.fitted), 1e-6));
}

TEST(FitScan, HalfAScanGivesTheWholeFace) {
  const MorphableModel model = toy_model();
  Subject s = subject(model, 5);
  const Vertices at_home = place.inverse().apply(s.scan.V);
  std::vector<int> kept;
  for (int f = 0; f < s.scan.F.rows(); ++f)
    if (at_home(s.scan.F(f, 0), 0) > -20 && at_home(s.scan.F(f, 1), 0) > -20) kept.push_back(f);
  s.scan.F = Faces(s.scan.F(kept, Eigen::all));
  const FitScanResult fit = fit_scan(model, s.scan, s.marks);
  EXPECT_GT(fit.summary.beyond + fit.summary.at_rim, 200);  // of 775: the missing side
  EXPECT_LT(mean_error(fit.fitted, s.V), 0.15 * mean_error(place.apply(model.mean().V), s.V));
}

TEST(FitScan, OutliersDoNotPull) {
  const MorphableModel model = toy_model();
  const Subject clean = subject(model, 6, 0.2);
  Subject spiked = clean;
  Random random(11);
  for (int i = 0; i < spiked.scan.V.rows(); i += 25) spiked.scan.V.row(i) += 15 * Eigen::RowVector3d(0, 0, 1);
  const double before = mean_error(fit_scan(model, clean.scan, clean.marks).fitted, clean.V);
  EXPECT_LT(mean_error(fit_scan(model, spiked.scan, spiked.marks).fitted, clean.V), before + 0.2);
}

TEST(FitScan, SameBytesForAnyNumberOfThreads) {
  const MorphableModel model = toy_model();
  const Subject s = subject(model, 7, 0.3);
  FitScanOptions one, four;
  one.threads = 1;
  four.threads = 4;
  EXPECT_THAT(fit_scan(model, s.scan, s.marks, four).fitted, SameBytes(fit_scan(model, s.scan, s.marks, one).fitted));
}

TEST(FitScan, RefusesWhatCannotBeUsed) {
  const MorphableModel model = toy_model();
  const Subject s = subject(model, 8);
  EXPECT_THROW(fit_scan(model, Mesh(), s.marks), InvalidInput);
  Mesh broken = s.scan;
  broken.V(3, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fit_scan(model, broken, s.marks), InvalidInput);
  EXPECT_THROW(fit_scan(model, s.scan, Landmarks()), InvalidInput);
  Mesh far = s.scan;
  far.V.array() += 1000;
  EXPECT_THROW(fit_scan(model, far, s.marks), SolverError);
  FitScanOptions bad;
  bad.sigma_mm = -1;
  EXPECT_THROW(fit_scan(model, s.scan, s.marks, bad), InvalidInput);
}

}  // namespace
}  // namespace facewright
