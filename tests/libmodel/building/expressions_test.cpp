// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/expressions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "tests/libmodel/building/planted.h"

namespace facewright {
namespace {

using ::testing::ElementsAre;
using testing::random_motion;

constexpr int kSide = 21;

// People with two planted expressions of the lower face, each scan lying somewhere else.
struct PlantedExpressions {
  MultiresTemplate reference = testing::grid_template(kSide);
  std::vector<Vertices> planted;  // displacements of "open" and "smile"
  RegisteredSet set;
  std::vector<ExpressionLabel> labels;

  explicit PlantedExpressions(int people, double noise = 0) {
    for (int v = 0; v < kSide * kSide; ++v) {
      const char* region = reference.V(v, 1) > 40 ? "forehead" : reference.V(v, 1) > 0 ? "nose" : "mouth";
      reference.regions[region].push_back(v);
    }
    for (const double y : {-60.0, -30.0}) {
      Vertices d = Vertices::Zero(reference.V.rows(), 3);
      for (Eigen::Index v = 0; v < d.rows(); ++v) {
        const double r = std::hypot(reference.V(v, 0), reference.V(v, 1) - y);
        if (r < 35) d.row(v) << 2, -8 * (1 - r / 35), 3;
      }
      planted.push_back(d);
    }
    Random random(5);
    std::vector<Vertices> faces;
    for (int p = 0; p < people; ++p) {
      Vertices face = reference.V;
      const double wide = 1 + 0.05 * random.normal(), deep = 1 + 0.05 * random.normal();
      face.col(0) *= wide;
      face.col(2) *= deep;
      for (const char* expression : {"", "open", "smile"}) {
        Vertices scan = face;
        if (*expression) scan += planted[*expression == 's'];
        for (double& x : scan.reshaped()) x += noise * random.normal();
        faces.push_back(random_motion(random).apply(scan));
        labels.push_back({"person " + std::to_string(p), expression});
      }
    }
    set.shapes.resize(static_cast<Eigen::Index>(faces.size()), 3 * reference.V.rows());
    for (size_t s = 0; s < faces.size(); ++s)
      set.shapes.row(static_cast<Eigen::Index>(s)) =
          Eigen::Map<const Eigen::RowVectorXd>(faces[s].data(), faces[s].size());
  }
};

double largest_error(const Blendshape& found, const Vertices& planted) {
  return (as_vertices(found.displacement) - planted).rowwise().norm().maxCoeff();
}

TEST(Expressions, PlantedOnesComeBackAsBlendshapes) {
  const PlantedExpressions p(6);
  const ExpressionResult r = build_expressions(p.set, p.labels, p.reference, p.reference.V);
  ASSERT_EQ(r.blendshapes.size(), 2u);
  EXPECT_EQ(r.blendshapes[0].name, "open");
  // A face is laid on the mean as a whole: its own shape turns its frame by some hundredths.
  for (size_t k = 0; k < 2; ++k) EXPECT_LT(largest_error(r.blendshapes[k], p.planted[k]), 0.05) << k;
  EXPECT_EQ(r.summary.scans, 12);
  EXPECT_EQ(r.summary.subjects, 6);
  EXPECT_EQ(r.summary.scans_of.at("smile"), 6);
}

TEST(Expressions, TheModelHoldsThePlantedDisplacements) {
  const PlantedExpressions p(5, 0.05);
  const ExpressionResult r = build_expressions(p.set, p.labels, p.reference, p.reference.V);
  ASSERT_TRUE(r.expression.has_value());
  for (const Vertices& d : p.planted) {
    const Eigen::VectorXd x = as_vector(d), nearest = r.expression->project(x);
    EXPECT_LT((x - nearest).norm(), 0.05 * x.norm());
  }
}

TEST(Expressions, AlignmentLooksAtWhatStays) {
  const PlantedExpressions p(1);
  Random random(3);
  const Vertices &rest = p.reference.V, moved = rest + p.planted[0];
  const Similarity motion = random_motion(random);
  const Similarity found = align_still_parts(motion.apply(moved), rest, Eigen::VectorXd::Ones(rest.rows()), 0.5, 30);
  EXPECT_LT((found.apply(motion.apply(moved)) - moved).rowwise().norm().maxCoeff(), 0.02);
}

TEST(Expressions, SubjectsWithoutNeutralAreReportedAndChangeNothing) {
  PlantedExpressions p(4);
  const ExpressionResult all = build_expressions(p.set, p.labels, p.reference, p.reference.V);
  RegisteredSet more = p.set;
  more.shapes.conservativeResize(more.shapes.rows() + 1, Eigen::NoChange);
  more.shapes.bottomRows(1) = p.set.shapes.row(1) * 2;
  std::vector<ExpressionLabel> labels = p.labels;
  labels.push_back({"stranger", "open"});
  const ExpressionResult r = build_expressions(more, labels, p.reference, p.reference.V);
  EXPECT_THAT(r.summary.without_neutral, ElementsAre("stranger"));
  EXPECT_EQ(r.blendshapes[0].displacement, all.blendshapes[0].displacement);
  EXPECT_EQ(r.expression->basis, all.expression->basis);
}

TEST(Expressions, NeutralFacesAloneGiveNone) {
  const PlantedExpressions p(1);
  RegisteredSet set;
  set.shapes = p.set.shapes.topRows(1);
  const ExpressionResult r = build_expressions(set, {{"a", ""}}, p.reference, p.reference.V);
  EXPECT_FALSE(r.expression.has_value());
  EXPECT_TRUE(r.blendshapes.empty());
  set.shapes = p.set.shapes.topRows(2);  // one expression: a mean displacement without modes
  const ExpressionResult one = build_expressions(set, {{"a", ""}, {"a", "open"}}, p.reference, p.reference.V);
  EXPECT_EQ(one.expression->mode_count(), 0);
  EXPECT_TRUE(one.blendshapes.at(0).displacement.allFinite());
  EXPECT_THROW(build_expressions(set, {{"a", ""}}, p.reference, p.reference.V), InvalidInput);
}

}  // namespace
}  // namespace facewright
