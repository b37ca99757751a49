// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <fstream>

#include "libmodel/core/errors.h"
#include "libmodel/model/landmark_mapper.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

class LandmarkMapping : public ::testing::Test {
 protected:
  LandmarkMapper read(const std::string& text) {
    const auto path = folder_.path() / "mapping.txt";
    std::ofstream(path) << text;
    return read_landmark_mapping(path);
  }
  LandmarkSet marks_ = {{"nose", {{}, 7}}};

 private:
  TemporaryDirectory folder_;
};

TEST_F(LandmarkMapping, SectionsOfEosGiveVerticesNamesAndContours) {
  const LandmarkMapper mapper = read(
      "# a comment\n[landmark_mappings]\n31 = 114 # tip\n32 = \"nose\"\n\n[contour_landmarks]\n"
      "right = [ \"1\",\n  \"2\", # second\n  \"3\"\n]\nleft = [10, 11]\n[other]\nx = y\n");
  EXPECT_EQ(mapper.vertex("31", marks_), 114);
  EXPECT_EQ(mapper.vertex("32", marks_), 7);
  EXPECT_EQ(mapper.vertex("x", marks_), std::nullopt);
  EXPECT_EQ(mapper.contour().right, (std::vector<std::string>{"1", "2", "3"}));
  EXPECT_EQ(mapper.contour().left, (std::vector<std::string>{"10", "11"}));
}

TEST_F(LandmarkMapping, PlainLinesAreEnough) {
  const LandmarkMapper mapper = read("tip = nose\nchin = 33\n");
  EXPECT_EQ(mapper.vertex("tip", marks_), 7);
  EXPECT_EQ(mapper.vertex("chin", marks_), 33);
  EXPECT_TRUE(mapper.contour().right.empty());
  EXPECT_FALSE(mapper.is_identity());
}

TEST_F(LandmarkMapping, WhatCannotBeReadIsNamedWithItsLine) {
  const auto message = [&](const std::string& text) {
    try {
      read(text);
      return std::string("nothing thrown");
    } catch (const IoError& e) {
      return std::string(e.what());
    }
  };
  EXPECT_NE(message("a = 1\nb\n").find(":2: expected 'name = vertex'"), std::string::npos);
  EXPECT_NE(message("a = 1\n[contour_landmarks]\nup = [1]\n").find(":3:"), std::string::npos);
  EXPECT_NE(message("a = 1\n[contour_landmarks]\nright = [1,\n2\n").find("not closed"), std::string::npos);
  EXPECT_NE(message("# nothing\n").find("no entries"), std::string::npos);
  EXPECT_THROW(read_landmark_mapping("/no/such/file"), IoError);
}

}  // namespace
}  // namespace facewright
