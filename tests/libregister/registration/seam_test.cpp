// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/seam.h"

#include <gtest/gtest.h>

#include "libmodel/core/topology.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/conform.h"

namespace facewright {
namespace {

double gap(const Stitch& s, const Vertices& V) {
  return (V.row(s.vertex) - (1 - s.t) * V.row(s.a) - s.t * V.row(s.b)).norm();
}

double widest(const std::vector<Stitch>& stitches, const Vertices& V) {
  double most = 0;
  for (const Stitch& s : stitches) most = std::max(most, gap(s, V));
  return most;
}

TEST(SeamStitches, PairEveryLipVertexAcrossTheSlitOnEveryLevel) {
  const MultiresTemplate reference = default_reference();
  for (int level = 0; level < static_cast<int>(reference.levels.size()); ++level) {
    const auto stitches = seam_stitches(reference, level);
    const auto loops = boundary_loops(reference.levels[static_cast<size_t>(level)].F);
    ASSERT_EQ(loops.size(), 2u);
    EXPECT_EQ(stitches.size(), loops[1].size() - 2);  // both corners are left out
    for (const Stitch& s : stitches) {
      EXPECT_GE(s.t, 0);
      EXPECT_LE(s.t, 1);
      EXPECT_NE(s.vertex, s.a);
      EXPECT_NE(s.vertex, s.b);
    }
    EXPECT_LT(widest(stitches, reference.V), 3);  // the reference's lips nearly touch
  }
}

TEST(SeamStitches, CloseAMouthThatWasPulledOpen) {
  const MultiresTemplate reference = default_reference();
  const Mesh base = reference.level_mesh(0);
  const auto stitches = seam_stitches(reference, 0);
  Vertices open = base.V;
  for (const Stitch& s : stitches)
    if (base.V(s.vertex, 1) < base.V(s.a, 1)) open(s.vertex, 1) -= 6;  // lower lip drops
  Correspondence nothing;
  nothing.targets = open;
  nothing.weights = Eigen::VectorXd::Zero(open.rows());
  ConformOptions options;
  options.smoothing_length = 0.5;  // soft: here only the seam is to speak
  const Vertices closed = conform(open, base.F, nothing, {}, options, stitches).V;
  EXPECT_GT(widest(stitches, open), 5);
  EXPECT_LT(widest(stitches, closed), options.seam_gap + 0.5);
}

TEST(SeamStitches, NoSlitNoStitches) {
  MultiresTemplate reference = default_reference();
  reference.regions.erase("mouth_slit");
  EXPECT_TRUE(seam_stitches(reference, 0).empty());
}

}  // namespace
}  // namespace facewright
