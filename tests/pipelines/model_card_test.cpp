// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/model_card.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/libmodel/model/model_fixtures.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ManifestEntry scan(const std::string& id, const std::string& subject, const std::string& expression,
                   const std::string& group, std::optional<double> age) {
  ManifestEntry e;
  e.id = id;
  e.subject = subject;
  e.expression = expression;
  e.group = group;
  e.age = age;
  return e;
}

ModelCardInput input() {
  ModelCardInput i;
  i.has_manifest = true;
  i.scans = {scan("a1", "anna", "neutral", "north", 19.5), scan("a2", "anna", "smile", "", {}),
             scan("b1", "ben", "neutral", "south|east", 60), scan("c1", "chris", "neutral", "", {})};
  i.left_out = {{"d1", "landmarks: none"}};
  i.shape_variance = 1000;
  return i;
}

TEST(ModelCard, PeopleCountOnceByWhateverScanSaysIt) {
  const auto j = nlohmann::json::parse(model_card_json(MorphableModel(testing::random_parts(1)), input()));
  EXPECT_EQ(j["people"], 3);
  EXPECT_EQ(j["scans"], 4);
  EXPECT_EQ(j["groups"]["north"], 1);
  EXPECT_EQ(j["groups"]["not stated"], 1);
  EXPECT_EQ(j["ages"]["0-19"], 1);
  EXPECT_EQ(j["ages"]["60+"], 1);
  EXPECT_EQ(j["ages"]["not stated"], 1);
  EXPECT_EQ(j["expressions"]["neutral"], 3);
  EXPECT_EQ(j["left_out"]["d1"], "landmarks: none");
}

TEST(ModelCard, TablesSurviveWhatNamesHold) {
  const std::string text = model_card_markdown(MorphableModel(testing::random_parts(1)), input());
  EXPECT_THAT(text, HasSubstr("| south\\|east | 1 |"));
  EXPECT_THAT(text, HasSubstr("- d1: landmarks: none"));
  EXPECT_THAT(text, HasSubstr("**Terms:** not stated"));
}

TEST(ModelCard, WithoutAManifestNothingIsClaimed) {
  ModelCardInput i = input();
  i.has_manifest = false;
  i.terms = "CC BY 4.0, consent on file";
  const std::string text = model_card_markdown(MorphableModel(testing::random_parts(1)), i);
  EXPECT_THAT(text, HasSubstr("without a manifest"));
  EXPECT_THAT(text, HasSubstr("CC BY 4.0"));
  EXPECT_THAT(text, Not(HasSubstr("| age")));
}

}  // namespace
}  // namespace facewright
