// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/register_scan.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "tests/libregister/registration/bumpy_face.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

struct Planted {
  MultiresTemplate reference;
  Mesh scan;
  Landmarks landmarks;
  Vertices truth;  // where each reference vertex belongs
};

// A dense scan of the warped surface with its own triangulation, in its own pose.
Planted planted(double noise = 0, std::uint64_t seed = 1) {
  Planted p;
  p.reference = bumpy_template(31, 41);
  p.scan = bumpy_face(125, 159);
  Random random(seed);
  Similarity pose = random_similarity(random);
  pose.s = 1;
  p.scan.V = pose.apply(warped(p.scan.V));
  if (noise > 0) p.scan.V = noisy(p.scan, noise, seed);
  p.truth = pose.apply(warped(p.reference.V));
  p.landmarks = locate(p.reference.landmarks, p.truth, p.reference.levels[0].F);
  return p;
}

double inner_error(const Planted& p, const Vertices& V) {
  double sum = 0;
  int n = 0;
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    if (std::abs(p.reference.V(i, 0)) > 50 || std::abs(p.reference.V(i, 1)) > 70) continue;  // inside the landmarks
    sum += (V.row(i) - p.truth.row(i)).norm();
    ++n;
  }
  return sum / n;
}

TEST(RegisterScan, RecoversAPlantedWarp) {
  Planted p = planted();
  for (auto& [name, point] : p.landmarks) point.stddev = 0.1;  // mm; these are exact, and should say so
  RegisterOptions o;
  o.levels = {{6, 20, 1, 8, 2, 20, 60, 0.3, false}};  // one level has to do what usually four do
  const RegistrationResult r = register_scan(p.scan, p.landmarks, p.reference, o);
  EXPECT_LT(inner_error(p, r.V), 0.5);  // mm; the warp moves vertices by 4 to 6 mm
  EXPECT_LT(r.summary.surface_mean, 0.05);
  EXPECT_EQ(r.summary.folds, 0);
  EXPECT_TRUE(r.summary.acceptable) << r.summary.concern;
}

TEST(RegisterScan, NoiseCostsLittle) {
  const Planted clean = planted(), noise = planted(0.3);
  const double a = inner_error(clean, register_scan(clean.scan, clean.landmarks, clean.reference).V);
  const double b = inner_error(noise, register_scan(noise.scan, noise.landmarks, noise.reference).V);
  EXPECT_LT(b, a + 0.3);
}

TEST(RegisterScan, CommutesWithTheScansPose) {
  const Planted a = planted(0, 1), b = planted(0, 2);
  const Vertices Va = register_scan(a.scan, a.landmarks, a.reference).V,
                 Vb = register_scan(b.scan, b.landmarks, b.reference).V;
  const Similarity b_from_a = fit_similarity(a.truth, b.truth, Scaling::fixed);
  EXPECT_THAT(Vb, VerticesNear(b_from_a.apply(Va), 1e-3));  // nearest points at ties may round differently
}

TEST(RegisterScan, GivesTheSameBytesTwice) {
  const Planted p = planted(0.2);
  EXPECT_THAT(register_scan(p.scan, p.landmarks, p.reference).V,
              SameBytes(register_scan(p.scan, p.landmarks, p.reference).V));
}

TEST(RegisterScan, KeepsItsStagesWhenAsked) {
  const Planted p = planted();
  RegisterOptions o;
  o.keep_stages = true;
  EXPECT_EQ(register_scan(p.scan, p.landmarks, p.reference, o).stages.size(), 2u);  // global mapping and one level
}

TEST(RegisterScan, ExplainsMissingLandmarksAndEmptyScans) {
  const Planted p = planted();
  EXPECT_THROW(register_scan(p.scan, {}, p.reference), InvalidInput);
  EXPECT_THROW(register_scan(Mesh{}, p.landmarks, p.reference), InvalidInput);
}

}  // namespace
}  // namespace facewright
