// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/manifest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/csv.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Csv, QuotesLineEndsAndSeparatorsAreRead) {
  const auto rows = parse_csv(
      "\xef\xbb\xbf"
      "a,b\r\n\"x, \"\"y\"\"\",\"two\nlines\"\r\n\n,last",
      "t.csv");
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_THAT(rows[0].fields, ElementsAre("a", "b"));
  EXPECT_THAT(rows[1].fields, ElementsAre("x, \"y\"", "two\nlines"));
  EXPECT_THAT(rows[2].fields, ElementsAre("", "last"));
  EXPECT_EQ(rows[2].line, 5);
  EXPECT_THAT(parse_csv("a;b\n1,5;2", "t.csv")[1].fields, ElementsAre("1,5", "2"));
  EXPECT_THAT(parse_csv("a\tb\n1\t", "t.csv")[1].fields, ElementsAre("1", ""));
}

TEST(Csv, WhatIsWrittenIsReadBack) {
  const std::vector<std::string> fields = {"plain", "with, comma", "a \"quote\"", "two\r\nlines", "", " spaces "};
  EXPECT_EQ(parse_csv(csv_line(fields), "t.csv").at(0).fields, fields);
}

TEST(Csv, OpenQuotesAreNamedByTheirLine) {
  EXPECT_THAT([] { parse_csv("a,b\n1,\"2\n3\n", "t.csv"); },
              ThrowsMessage<IoError>(AllOf(HasSubstr("t.csv:2"), HasSubstr("never closed"))));
  EXPECT_THROW(parse_csv("\"a\"b,c\n", "t.csv"), IoError);
}

class ManifestTest : public ::testing::Test {
 protected:
  ManifestTest() {
    for (const char* name : {"a.ply", "b.ply", "sub/c d.obj", "a_marks.json"}) write_file(folder_ / name, "x");
  }
  Manifest read(const std::string& text) {
    write_file(folder_ / "people.csv", text);
    return read_manifest(folder_ / "people.csv");
  }
  TemporaryDirectory folder_;
};

TEST_F(ManifestTest, ColumnsComeInAnyOrderAndMayBeMissing) {
  const Manifest m = read(
      "Age,file,landmarks,subject,Expression,group,units,camera\n"
      "31,a.ply,a_marks.json,anna,Neutral,north,mm,left\n,sub/c d.obj,,anna,smile,,,\n");
  ASSERT_EQ(m.entries.size(), 2u);
  const ManifestEntry &a = m.entries[0], &c = m.entries[1];
  EXPECT_EQ(a.id, "a");
  EXPECT_EQ(a.age, 31);
  EXPECT_EQ(a.landmarks, folder_ / "a_marks.json");
  EXPECT_TRUE(a.neutral());
  EXPECT_EQ(a.other.at("camera"), "left");
  EXPECT_EQ(c.id, "c d");
  EXPECT_EQ(c.subject, "anna");
  EXPECT_EQ(c.expression, "smile");
  EXPECT_FALSE(c.age.has_value());
  const Manifest least = read("file\nb.ply\n");
  EXPECT_EQ(least.entries.at(0).subject, "b");
  EXPECT_TRUE(least.entries.at(0).neutral());
}

TEST_F(ManifestTest, EveryMistakeIsNamedWithItsLine) {
  const auto message = [&](const std::string& text) { return [this, text] { read(text); }; };
  const auto says = [](const std::string& a, const std::string& b) {
    return ThrowsMessage<IoError>(AllOf(HasSubstr("people.csv" + a), HasSubstr(b)));
  };
  EXPECT_THAT(message(""), says("", "empty"));
  EXPECT_THAT(message("id,age\na,3\n"), says(":1", "no column 'file'"));
  EXPECT_THAT(message("file,file\na.ply,a.ply\n"), says(":1", "twice"));
  EXPECT_THAT(message("file\n"), says("", "names no scan"));
  EXPECT_THAT(message("file,age\na.ply\n"), says(":2", "1 fields"));
  EXPECT_THAT(message("file,age\na.ply,old\n"), says(":2", "'old'"));
  EXPECT_THAT(message("file,age\na.ply,nan\n"), says(":2", "'nan'"));
  EXPECT_THAT(message("file,units\na.ply,feet\n"), says(":2", "'feet'"));
  EXPECT_THAT(message("file\nb.ply\nnone.ply\n"), says(":3", "'none.ply'"));
  EXPECT_THAT(message("file,id\na.ply,x\nb.ply,x\n"), says(":3", "line 2"));
  EXPECT_THAT(message("file,id\na.ply,../x\n"), says(":2", "file name"));
}

TEST_F(ManifestTest, PathsStayInTheFolderUnlessAllowed) {
  write_file(folder_ / "in/people.csv", "file\n../a.ply\n");
  EXPECT_THAT([&] { read_manifest(folder_ / "in/people.csv"); }, ThrowsMessage<IoError>(HasSubstr("outside")));
  EXPECT_EQ(read_manifest(folder_ / "in/people.csv", true).entries.at(0).id, "a");
  write_file(folder_ / "in/people.csv", "file\n" + (folder_ / "a.ply").string() + "\n");
  EXPECT_THROW(read_manifest(folder_ / "in/people.csv"), IoError);
}

}  // namespace
}  // namespace facewright
