// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/morphable_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/model/landmark_mapper.h"
#include "model_fixtures.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(MorphableModel, EveryLevelIsALeadingPartOfTheFinest) {
  const MorphableModel model(testing::random_parts(1));
  Random random(2);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random), d = model.colour().draw_coefficients(random);
  const Mesh finest = model.instance(c, d);
  for (int l = 0; l < model.level_count(); ++l) {
    const int n = model.vertex_count(l);
    const Mesh mesh = model.instance(c, d, l), alone = model.level(l).instance(c, d);
    EXPECT_EQ(mesh.V, finest.V.topRows(n));
    EXPECT_EQ(mesh.colours, finest.colours.topRows(n));
    EXPECT_EQ(mesh.uv, finest.uv.topRows(n));
    EXPECT_EQ(alone.V, mesh.V);
    EXPECT_EQ(alone.F, model.faces(l));
    EXPECT_NO_THROW(validate(mesh));
  }
}

TEST(MorphableModel, CoefficientsAreTheSameAtEveryLevel) {
  const MorphableModel model(testing::random_parts(3));
  Random random(4);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  for (int l = 0; l < model.level_count(); ++l) {
    const Vertices V = model.instance(c, {}, l).V;
    EXPECT_LT((model.coefficients(V) - c).norm(), 1e-9);
    EXPECT_LT((model.level(l).coefficients(V) - c).norm(), 1e-9);
    EXPECT_LT((model.project(V) - V).norm(), 1e-9);
  }
}

TEST(MorphableModel, LevelsKeepLandmarkPositions) {
  const MorphableModel model(testing::random_parts(5));
  const Vertices V = model.mean().V;
  for (int l = 0; l < model.level_count(); ++l) {
    const MorphableModel part = model.level(l);
    for (const auto& [name, mark] : part.landmarks()) {
      ASSERT_EQ(mark.vertex, model.landmarks().at(name).vertex);
      const Eigen::Vector3d at_triangle = position(mark.point, part.mean().V, part.faces());
      EXPECT_EQ(at_triangle, Eigen::Vector3d(V.row(mark.vertex)));
    }
  }
}

TEST(MorphableModel, SamplesDependOnTheSeedOnly) {
  const MorphableModel model(testing::random_parts(6));
  Random a(7), b(7), c(8);
  const Mesh first = model.sample(a);
  EXPECT_EQ(first.V, model.sample(b).V);
  EXPECT_NE(first.V, model.sample(c).V);
  EXPECT_EQ(model.sample(a, 0, 0.0).V, model.mean(0).V);
}

TEST(MorphableModel, TruncationKeepsTheFirstModes) {
  const MorphableModel model(testing::random_parts(9)), small = model.truncated(2, 1);
  EXPECT_EQ(small.shape().mode_count(), 2);
  EXPECT_EQ(small.colour().mode_count(), 1);
  const Eigen::Vector2d c(1, -2);
  EXPECT_EQ(small.instance(c).V, model.instance(c).V);
}

TEST(MorphableModel, ExpressionsAddToTheFace) {
  const MorphableModel model(testing::random_parts(10));
  const Eigen::Vector2d e(0.5, 1);
  const Vertices moved = model.instance({}, {}, -1, e).V - model.mean().V;
  EXPECT_LT((moved - as_vertices(model.expression()->instance(e))).norm(), 1e-9);
}

TEST(MorphableModel, BlendshapesHaveNamesOfTheirOwnAndFollowTheLevels) {
  MorphableModelParts p = testing::random_parts(14);
  p.blendshapes = {{"smile", Eigen::VectorXd::LinSpaced(120, 0, 1)}, {"frown", Eigen::VectorXd::Ones(120)}};
  const MorphableModel model(p);
  ASSERT_EQ(model.level(1).blendshapes().size(), 2u);
  EXPECT_EQ(model.level(1).blendshapes()[0].displacement, p.blendshapes[0].displacement.head(60));
  p.blendshapes[1].name = "smile";
  EXPECT_THROW(MorphableModel{p}, InvalidInput);
  p.blendshapes[1] = {"frown", Eigen::VectorXd::Ones(119)};
  EXPECT_THROW(MorphableModel{p}, InvalidInput);
}

TEST(MorphableModel, RefusesPartsThatDoNotFit) {
  const auto message = [](auto spoil) {
    return [spoil] {
      MorphableModelParts p = testing::random_parts(11);
      spoil(p);
      MorphableModel model(std::move(p));
    };
  };
  EXPECT_THAT(message([](auto& p) { p.levels.pop_back(); }), ThrowsMessage<InvalidInput>(HasSubstr("finest level")));
  EXPECT_THAT(message([](auto& p) { p.levels[0].F(0, 0) = 12; }), ThrowsMessage<InvalidInput>(HasSubstr("triangle")));
  EXPECT_THAT(message([](auto& p) { p.mirror[3] = 4; }), ThrowsMessage<InvalidInput>(HasSubstr("involution")));
  EXPECT_THAT(message([](auto& p) { p.uv = p.uv.topRows(3).eval(); }),
              ThrowsMessage<InvalidInput>(HasSubstr("texture")));
  EXPECT_THAT(message([](auto& p) { p.landmarks["31"].vertex = 30; }), ThrowsMessage<InvalidInput>(HasSubstr("'31'")));
  EXPECT_THAT([] { MorphableModel(testing::random_parts(1)).level_with(13); },
              ThrowsMessage<InvalidInput>(HasSubstr("12, 20, 40")));
}

TEST(LandmarkMapper, TheIdentityFindsTheModelsOwnNames) {
  const MorphableModel model(testing::random_parts(12));
  EXPECT_EQ(LandmarkMapper().vertex("31", model.landmarks()), 0);
  EXPECT_EQ(LandmarkMapper().vertex("77", model.landmarks()), std::nullopt);
}

TEST(LandmarkMapper, ATableLeadsToNamesOrVertices) {
  const MorphableModel model(testing::random_parts(13));
  const LandmarkMapper mapper({{"nose", std::string("31")}, {"x", 17}});
  EXPECT_EQ(mapper.vertex("nose", model.landmarks()), 0);
  EXPECT_EQ(mapper.vertex("x", model.landmarks()), 17);
  EXPECT_EQ(mapper.vertex("31", model.landmarks()), std::nullopt);
}

}  // namespace
}  // namespace facewright
