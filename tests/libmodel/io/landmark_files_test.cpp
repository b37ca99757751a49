// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/landmark_files.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "tests/libmodel/io/scratch_folder.h"

namespace facewright {
namespace {

class LandmarkFiles : public ScratchFolder {
 protected:
  Landmarks read3(const std::string& name, const std::string& text) { return read_landmarks(file(name, text)); }
  ImageLandmarks read2(const std::string& name, const std::string& text) {
    return read_image_landmarks(file(name, text));
  }
};

TEST_F(LandmarkFiles, JsonRoundTripIsExactWithNamesAndDeviations) {
  Random random(3);
  Landmarks marks;
  for (const char* name : {"31", "2", "gnathion", "odd \"name\""})
    marks[name] = {{random.normal() * 100, random.normal(), 1e-7 * random.normal()}, 0};
  marks["31"].stddev = 0.4;
  write_landmarks(folder_ / "a.json", marks);
  const Landmarks back = read_landmarks(folder_ / "a.json");
  ASSERT_EQ(back.size(), marks.size());
  for (const auto& [name, mark] : marks) {
    EXPECT_EQ(back.at(name).position, mark.position);
    EXPECT_EQ(back.at(name).stddev, mark.stddev);
  }
}

TEST_F(LandmarkFiles, PtsCountsPixelsFromOneInTwoDimensionsOnly) {
  const std::string header = "version: 1\nn_points: 2\n{\n";
  const auto image = read2("a.pts", header + "1 1\n100.5 7.25\n}\n");
  EXPECT_EQ(image.at("1").position, Eigen::Vector2d(0, 0));
  EXPECT_EQ(image.at("2").position, Eigen::Vector2d(99.5, 6.25));
  const auto solid = read3("b.pts", header + "1 2 3\n4 5 6\n}\n");
  EXPECT_EQ(solid.at("2").position, Eigen::Vector3d(4, 5, 6));
}

TEST_F(LandmarkFiles, PtsRoundTripAndForgivingLayout) {
  ImageLandmarks marks;
  for (int i = 1; i <= 12; ++i) marks[std::to_string(i)].position = Eigen::Vector2d(i * 3.5, i + 0.125);
  write_image_landmarks(folder_ / "a.pts", marks);
  const auto back = read_image_landmarks(folder_ / "a.pts");
  ASSERT_EQ(back.size(), 12u);
  EXPECT_EQ(back.at("11").position, marks.at("11").position);
  const auto windows = read2("b.pts", "version:1\r\nn_points:1\r\n\r\n{\r\n\r\n 5 6 \r\n}\r\n");
  EXPECT_EQ(windows.at("1").position, Eigen::Vector2d(4, 5));
}

TEST_F(LandmarkFiles, PtsRefusesNamesItCannotHold) {
  ImageLandmarks marks;
  marks["1"] = marks["3"] = {};
  EXPECT_THROW(write_image_landmarks(folder_ / "a.pts", marks), InvalidInput);
}

TEST_F(LandmarkFiles, PickedPointsKeepNamesAndSkipInactiveOnes) {
  const auto marks = read3("a.pp",
                           "<!DOCTYPE PickedPoints>\n<PickedPoints>\n <DocumentData/>\n"
                           " <point x=\"1.5\" y=\"-2\" z=\"3e1\" active=\"1\" name=\"31\"/>\n"
                           " <point name='left &amp; right' z=\"3\" y=\"2\" x=\"1\"/>\n"
                           " <point x=\"1\" y=\"2\" z=\"3\" active=\"0\" name=\"37\"/>\n</PickedPoints>\n");
  ASSERT_EQ(marks.size(), 2u);
  EXPECT_EQ(marks.at("31").position, Eigen::Vector3d(1.5, -2, 30));
  EXPECT_EQ(marks.at("left & right").position, Eigen::Vector3d(1, 2, 3));
}

TEST_F(LandmarkFiles, SlicerFilesMeetInLps) {
  const auto markups = [&](const std::string& system) {
    return read3("a.mrk.json",
                 "{\"markups\": [{\"type\": \"Fiducial\", \"coordinateSystem\": \"" + system +
                     "\", \"controlPoints\": [{\"label\": \"31\", \"position\": [1, 2, 3]}, "
                     "{\"label\": \"8\", \"positionStatus\": \"undefined\", \"position\": [0, 0, 0]}]}]}");
  };
  const auto fcsv = [&](const std::string& header) {
    return read3("a.fcsv", header +
                               "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
                               "vtkMRMLMarkupsFiducialNode_0,1,2,3,0,0,0,1,1,1,0,31,,\n");
  };
  EXPECT_EQ(markups("LPS").size(), 1u);
  EXPECT_EQ(markups("LPS").at("31").position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(markups("RAS").at("31").position, Eigen::Vector3d(-1, -2, 3));
  EXPECT_EQ(fcsv("# CoordinateSystem = LPS\n").at("31").position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(fcsv("# CoordinateSystem = 0\n").at("31").position, Eigen::Vector3d(-1, -2, 3));
  EXPECT_EQ(fcsv("").at("31").position, Eigen::Vector3d(-1, -2, 3));
}

TEST_F(LandmarkFiles, MenpoVersionsKeepNumbersOfMissingPointsAndSwapImageAxes) {
  const auto v2 =
      read2("a.ljson", R"({"version": 2, "labels": [], "landmarks": {"points": [[1, 2], [null, null], [5, 6]]}})");
  ASSERT_EQ(v2.size(), 2u);
  EXPECT_EQ(v2.at("1").position, Eigen::Vector2d(2, 1));
  EXPECT_EQ(v2.at("3").position, Eigen::Vector2d(6, 5));
  const auto v3 =
      read3("b.ljson", R"({"version": 3, "groups": {"LJSON": {"labels": [], "landmarks": {"points": [[1, 2, 3]]}}}})");
  EXPECT_EQ(v3.at("1").position, Eigen::Vector3d(1, 2, 3));
  const auto v1 = read3("c.ljson", R"({"version": 1, "groups": [{"label": "a", "landmarks": [{"point": [1, 2, 3]}]},
                                       {"label": "b", "landmarks": [{"point": [4, 5, 6]}]}]})");
  EXPECT_EQ(v1.at("2").position, Eigen::Vector3d(4, 5, 6));
}

TEST_F(LandmarkFiles, MalformedFilesAreRefusedWithTheirName) {
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"a.json", "{\"31\": [1, 2, 3]"},
      {"b.json", "[1, 2, 3]"},
      {"c.json", "{\"31\": [1, 2, \"x\"]}"},
      {"d.json", "{\"31\": [1, 2, 3, 4]}"},
      {"e.json", "{\"31\": {\"position\": [1, 2, 3], \"stddev\": -1}}"},
      {"f.json", "{\"31\": 7}"},
      {"g.json", "{\"31\": [1, 2, 1e999]}"},
      {"h.json", "{\"markups\": 3}"},
      {"i.json", "{\"markups\": [{\"controlPoints\": [{\"label\": \"31\", \"position\": [1]}]}]}"},
      {"a.pts", "version: 1\nn_points: 3\n{\n1 2 3\n}\n"},
      {"b.pts", "version: 1\n{\n1 2 3\n"},
      {"c.pts", "version: 1\n{\n1 2 x\n}\n"},
      {"d.pts", "version: 1\n{\n1 2 3\n1 2\n}\n"},
      {"e.pts", "1 2 3\n"},
      {"f.pts", ""},
      {"a.pp", "<PickedPoints><point x=\"1\" y=\"2\" name=\"31\"/></PickedPoints>"},
      {"b.pp", "<PickedPoints><point x=\"1\" y=\"2\" z=\"q\" name=\"31\"/></PickedPoints>"},
      {"c.pp", "<PickedPoints><point x=\"1\" y=\"2\" z=\"2\"/></PickedPoints>"},
      {"d.pp", "nothing"},
      {"e.pp",
       "<PickedPoints><point x=\"1\" y=\"2\" z=\"2\" name=\"31\"/><point x=\"1\" y=\"2\" z=\"2\" name=\"31\"/>"},
      {"a.fcsv", "a,b,c\n"},
      {"b.fcsv", "id,1,2,z,0,0,0,1,1,1,0,31,,\n"},
      {"a.ljson", "{}"},
      {"b.ljson", "{\"landmarks\": {\"points\": 4}}"},
      {"a.txt", "31,1,2,3"}};
  for (const auto& [name, text] : bad) {
    try {
      read3(name, text);
      ADD_FAILURE() << name << " was accepted";
    } catch (const IoError& e) {
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW(read2("z.json", "{\"31\": [1, 2, 3]}"), IoError);
  EXPECT_THROW(read3("z.json", "{\"31\": [1, 2]}"), IoError);
}

TEST_F(LandmarkFiles, ErrorsCarryTheLine) {
  try {
    read3("a.pts", "version: 1\nn_points: 2\n{\n1 2 3\n1 2 oops\n}\n");
    FAIL();
  } catch (const IoError& e) {
    EXPECT_EQ(e.line(), 5);
  }
}

}  // namespace
}  // namespace facewright
