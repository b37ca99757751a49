// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/journal.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libregister/reference/reference_face.h"
#include "libregister/subdivision/hierarchy.h"
#include "tests/libregister/subdivision/shapes.h"

namespace facewright {
namespace {

std::vector<int> level_counts(const MultiresTemplate& t) {
  std::vector<int> counts;
  for (const TemplateLevel& l : t.levels) counts.push_back(l.vertex_count);
  return counts;
}

void expect_replayed(const MultiresTemplate& t, const std::vector<int>& base_mirror) {
  const MultiresTemplate again = replay(journal_of(t), t.level_mesh(0), base_mirror, t.landmarks, level_counts(t));
  EXPECT_TRUE(again.V == t.V);
  EXPECT_EQ(again.mirror, t.mirror);
  ASSERT_EQ(again.levels.size(), t.levels.size());
  for (size_t l = 0; l < t.levels.size(); ++l) EXPECT_TRUE(again.levels[l].F == t.levels[l].F) << l;
}

TEST(Journal, ReplayEqualsTheReferenceAtEveryLevelToTheBit) {
  const ReferenceFace face = default_reference_face();
  expect_replayed(default_reference(), face.mirror);
}

TEST(Journal, ReplayEqualsAdaptiveMeshesWithAndWithoutSymmetry) {
  const auto s = test::crooked_annulus(6, 8);
  for (const auto& mirror : {std::vector<int>{}, s.mirror})
    expect_replayed(build_hierarchy(s.mesh, mirror, {}, {900, 901, 2500}), mirror);
}

TEST(Journal, ReplayEqualsAClosedSurface) {
  expect_replayed(build_hierarchy(test::octahedron(), {}, {}, {500, 1234}), {});
}

TEST(Journal, WhatIsCarriedUpTruncatesToWhatItWas) {
  const auto s = test::annulus(6, 8, 1.5);
  const auto t = build_hierarchy(s.mesh, s.mirror, {}, {700, 2000});
  const RefinementJournal journal = journal_of(t);
  for (const int known : {journal.base_count, 700}) {
    const Eigen::MatrixXd field = Eigen::MatrixXd::Random(known, 5);
    const Eigen::MatrixXd fine = carry_up(journal, field, 2000);
    EXPECT_TRUE(truncate_to(journal, fine, known) == field);
    EXPECT_TRUE(truncate_to(journal, fine, 1500) == carry_up(journal, field, 1500));
  }
}

TEST(Journal, CarriesConstantAndLinearFieldsExactly) {
  const auto s = test::annulus(6, 8, 1.5);
  const auto t = build_hierarchy(s.mesh, s.mirror, {}, {700, 2000});
  const Eigen::Vector3d slope(1, -2, 0.5);
  const Eigen::MatrixXd fine = carry_up(journal_of(t), s.mesh.V * slope, 2000);
  EXPECT_LT((fine - t.V * slope).cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::MatrixXd ones = Eigen::MatrixXd::Ones(s.mesh.V.rows(), 2);
  EXPECT_TRUE((carry_up(journal_of(t), ones, 2000).array() == 1).all());
}

TEST(Journal, RefusesWhatIsNotOfThisBase) {
  const auto s = test::annulus(4, 6);
  const auto t = build_hierarchy(s.mesh, s.mirror, {}, {400});
  const RefinementJournal journal = journal_of(t);
  const std::vector<int> counts = level_counts(t);
  EXPECT_THROW(replay(journal, test::octahedron(), {}, {}, counts), InvalidInput);
  EXPECT_THROW(replay(journal, s.mesh, s.mirror, {}, {counts.front(), 399}), InvalidInput);
  RefinementJournal bad = journal;
  bad.parents[5].a = 100000;
  EXPECT_THROW(replay(bad, s.mesh, s.mirror, {}, counts), InvalidInput);
  bad = journal;
  bad.parents.back() = {0, static_cast<int>(s.mesh.V.rows()) - 1, -1};  // opposite ends: no edge
  EXPECT_THROW(replay(bad, s.mesh, s.mirror, {}, counts), InvalidInput);
  bad = journal;
  bad.parents.resize(3);
  EXPECT_THROW(replay(bad, s.mesh, s.mirror, {}, {counts.front(), counts.front() + 3}), InvalidInput);
  EXPECT_THROW(truncate_to(journal, Eigen::MatrixXd::Zero(400, 1), 3), InvalidInput);
  EXPECT_THROW(carry_up(journal, Eigen::MatrixXd::Zero(3, 1), 400), InvalidInput);
}

}  // namespace
}  // namespace facewright
