// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Landmark formats of other programs, both ways.
#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/landmark_names.h"
#include "tests/libmodel/io/scratch_folder.h"

namespace facewright {
namespace {

class LandmarkFormats : public ScratchFolder {
 protected:
  Landmarks read3(const std::string& name, const std::string& text) { return read_landmarks(file(name, text)); }
  LandmarkNames names(const std::string& name, const std::string& text) {
    return read_landmark_names(file(name, text));
  }

  void expect_round_trip(const std::string& name, const Landmarks& marks, bool keeps_deviations = false) {
    write_landmarks(folder_ / name, marks);
    const Landmarks back = read_landmarks(folder_ / name);
    ASSERT_EQ(back.size(), marks.size()) << name;
    for (const auto& [key, mark] : marks) {
      ASSERT_TRUE(back.count(key)) << name << " lost " << key;
      EXPECT_EQ(back.at(key).position, mark.position) << name << " " << key;
      EXPECT_EQ(back.at(key).stddev, keeps_deviations ? mark.stddev : 0) << name << " " << key;
    }
  }
};

Landmarks random_landmarks(const std::vector<std::string>& names) {
  Random random(4);
  Landmarks marks;
  for (const std::string& name : names)
    marks[name].position = Eigen::Vector3d(random.normal() * 100, random.normal(), 1e-7 * random.normal());
  return marks;
}

TEST_F(LandmarkFormats, NamesAndNumbersReadBackAsWritten) {
  const Landmarks marks = random_landmarks({"31", "8", "gnathion", "left \"ala\", outer", "a < b & c"});
  for (const char* name : {"a.json", "a.pp", "a.mrk.json", "a.fcsv", "a.ljson", "a.csv", "a.lm3"})
    expect_round_trip(name, marks);
  const Landmarks words = random_landmarks({"31", "gnathion", "left.eye.corner_outer"});
  expect_round_trip("a.tlms", words);
}

TEST_F(LandmarkFormats, NumberedLandmarksReadBackWithTheirGaps) {
  const Landmarks marks = random_landmarks({"2", "31", "68"});
  for (const char* name : {"a.ljson", "a.mrk.json", "a.tlms", "a.csv", "a.lm3", "a.fcsv", "a.pp"})
    expect_round_trip(name, marks);
  expect_round_trip("one.ljson", random_landmarks({"1"}));
  expect_round_trip("a.pts", random_landmarks({"1", "2", "3"}));
  expect_round_trip("a.bnd", random_landmarks({"bnd_1", "bnd_2", "bnd_3"}));
}

TEST_F(LandmarkFormats, TablesKeepStandardDeviations) {
  Landmarks marks = random_landmarks({"31", "8"});
  marks["31"].stddev = 0.75;
  expect_round_trip("a.csv", marks, true);
  expect_round_trip("a.json", marks, true);
}

TEST_F(LandmarkFormats, PixelsReadBackInTheFormatsThatHoldThem) {
  ImageLandmarks marks;
  for (int i = 1; i <= 3; ++i) marks[std::to_string(i)].position = Eigen::Vector2d(i * 3.5, i + 0.125);
  for (const char* name : {"a.json", "a.pts", "a.ljson", "a.tlms", "a.csv"}) {
    write_image_landmarks(folder_ / name, marks);
    const auto back = read_image_landmarks(folder_ / name);
    ASSERT_EQ(back.size(), 3u) << name;
    for (const auto& [key, mark] : marks) EXPECT_EQ(back.at(key).position, mark.position) << name;
  }
  for (const char* name : {"a.pp", "a.mrk.json", "a.fcsv", "a.lm3"})
    EXPECT_THROW(write_image_landmarks(folder_ / name, marks), InvalidInput) << name;
}

TEST_F(LandmarkFormats, NamesThatAFormatCannotHoldAreRefused) {
  const Landmarks marks = random_landmarks({"outer corner"});
  for (const char* name : {"a.pts", "a.tlms", "a.bnd"})
    EXPECT_THROW(write_landmarks(folder_ / name, marks), InvalidInput) << name;
  EXPECT_THROW(write_landmarks(folder_ / "a.txt", marks), IoError);
}

TEST_F(LandmarkFormats, TablesComeWithAndWithoutAHeader) {
  EXPECT_EQ(read3("a.csv", "31,1,2,3\nnose,4,5,6\n").at("nose").position, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(read3("b.csv", "z;label;x;y\r\n3;31;1;2\r\n").at("31").position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read3("c.csv", "1,2,3\n4,5,6\n").at("2").position, Eigen::Vector3d(4, 5, 6));
}

TEST_F(LandmarkFormats, ScalismoPointsThatAreNotVisibleAreLeftOut) {
  const auto marks = read3("a.tlms", "nose.tip 1 1 2 3\r\nchin 0 4 5 6\n\n");
  ASSERT_EQ(marks.size(), 1u);
  EXPECT_EQ(marks.at("nose.tip").position, Eigen::Vector3d(1, 2, 3));
}

TEST_F(LandmarkFormats, DataSetsNumbersAreNotTakenForIbugs) {
  const auto marks = read3("a.bnd", "812\t1.5\t2\t3\n77\t4\t5\t6\n");
  ASSERT_EQ(marks.size(), 2u);
  EXPECT_EQ(marks.at("bnd_2").position, Eigen::Vector3d(4, 5, 6));
}

TEST_F(LandmarkFormats, BosphorusLabelsStandAboveTheirCoordinates) {
  const auto marks = read3("a.lm3", "# a comment\n2 landmarks:\nNose tip\n1 2 3\nChin middle \n4 5 6\n");
  ASSERT_EQ(marks.size(), 2u);
  EXPECT_EQ(marks.at("Chin middle").position, Eigen::Vector3d(4, 5, 6));
}

TEST_F(LandmarkFormats, MalformedFilesAreRefusedWithTheirName) {
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"a.csv", ""},
      {"b.csv", "name,x,y,z\n31,1,2\n"},
      {"c.csv", "31,1,2,three\n"},
      {"d.csv", "31,1,2,nan\n"},
      {"e.csv", "31,1,2,3\n31,1,2,3\n"},
      {"f.csv", "name,x,y,z,stddev\n31,1,2,3,-1\n"},
      {"g.csv", "a,b,c,d,e,f,g\n"},
      {"h.csv", ",1,2,3\n"},
      {"i.csv", "\"31,1,2,3\n"},
      {"a.tlms", "nose 2 1 2 3\n"},
      {"b.tlms", "nose 1 1\n"},
      {"c.tlms", "nose 1 1 2 3 4\n"},
      {"d.tlms", "nose 1 1 2 1e999\n"},
      {"e.tlms", "nose\n"},
      {"a.bnd", ""},
      {"b.bnd", "1 2 3\n"},
      {"c.bnd", "1 2 3 4 5\n"},
      {"d.bnd", "1 2 3 x\n"},
      {"a.lm3", ""},
      {"b.lm3", "Nose tip\n1 2 3\n"},
      {"c.lm3", "2 landmarks:\nNose tip\n1 2 3\n"},
      {"d.lm3", "1 landmarks:\nNose tip\n1 2\n"},
      {"e.lm3", "1 landmarks:\nNose tip\n"},
      {"f.lm3", "1e300 landmarks:\n"},
      {"a.ljson", R"({"groups": {"a": {"labels": [{"label": "x", "mask": [9]}, {"label": "y", "mask": [0]}],
                      "landmarks": {"points": [[1, 2, 3], [4, "5", 6]]}}}})"}};
  for (const auto& [name, text] : bad) {
    try {
      read3(name, text);
      ADD_FAILURE() << name << " was accepted";
    } catch (const IoError& e) {
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
    }
  }
}

TEST_F(LandmarkFormats, ReadersSurviveCutAndDamagedFiles) {
  const Landmarks marks = random_landmarks({"1", "2", "3"});
  Random random(9);
  for (const char* name : {"a.json", "a.pts", "a.pp", "a.mrk.json", "a.fcsv", "a.ljson", "a.tlms", "a.csv", "a.lm3"}) {
    write_landmarks(folder_ / name, marks);
    const std::string whole = read_file(folder_ / name);
    for (int trial = 0; trial < 30; ++trial) {
      std::string text = whole;
      if (trial % 2 == 0) text.resize(static_cast<size_t>(random.index(static_cast<int>(text.size()))));
      for (int k = 0; k < trial % 5 && !text.empty(); ++k)
        text[static_cast<size_t>(random.index(static_cast<int>(text.size())))] = static_cast<char>(random.index(256));
      try {
        for (const auto& [key, mark] : read3(name, text)) EXPECT_TRUE(mark.position.allFinite()) << name;
      } catch (const IoError&) {
      }
    }
  }
}

TEST_F(LandmarkFormats, AMappingRenamesAndLeavesOutWhatItDoesNotKnow) {
  const auto toml = names("a.toml", "# ours\n[landmark_mappings]\n\"Nose tip\" = \"31\"  # tip\nbnd_1 = 37\n");
  const auto json = names("a.json", R"({"Nose tip": "31", "bnd_1": "37"})");
  const auto csv = names("a.csv", "theirs,ours\nNose tip,31\nbnd_1,37\n");
  EXPECT_EQ(toml, json);
  EXPECT_EQ(toml, csv);
  const Landmarks marks = random_landmarks({"Nose tip", "31", "other"});
  const Landmarks renamed = rename_landmarks(marks, toml);
  ASSERT_EQ(renamed.size(), 1u);
  EXPECT_EQ(renamed.at("31").position, marks.at("Nose tip").position);
  EXPECT_THROW(rename_landmarks(random_landmarks({"other"}), toml), InvalidInput);
}

TEST_F(LandmarkFormats, MalformedMappingsAreRefused) {
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{{"a.toml", "nose 31\n"},
                                                                                   {"b.toml", ""},
                                                                                   {"c.toml", "a = \n"},
                                                                                   {"d.toml", "a = 1\na = 2\n"},
                                                                                   {"e.toml", "a = 1\nb = 1\n"},
                                                                                   {"a.csv", "a,b,c\n"},
                                                                                   {"a.json", "{\"a\": 31}"},
                                                                                   {"b.json", "{\"a\": "}})
    EXPECT_THROW(names(name, text), IoError) << name;
}

}  // namespace
}  // namespace facewright
