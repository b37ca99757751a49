// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/landmark_scans.h"

#include <gmock/gmock.h>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "pipelines/landmark_record.h"
#include "tests/pipelines/scan_folder.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

LandmarkScansOptions options_of(const fs::path& scans, const fs::path& output) {
  LandmarkScansOptions options;
  options.inputs = {scans};
  options.output = output;
  options.jobs = 2;
  return options;
}

TEST(LandmarkScans, FoundOnesAreFoundAgainAndThoseByHandAreKept) {
  const TemporaryDirectory folder;
  write_people(folder / "scans", 4, 2, 1.6);
  const LandmarkScansOptions options = options_of(folder / "scans", folder / "marks");
  EXPECT_EQ(landmark_scans(options).found, 2);
  const std::string found = read_file(folder / "marks/p1.json");
  const std::string mended = R"({"31": [1, 2, 3]})";
  write_file(folder / "marks/p0.json", mended);
  const LandmarkScansSummary again = landmark_scans(options);
  EXPECT_EQ(again.found, 1);
  EXPECT_EQ(again.by_hand, 1);
  EXPECT_EQ(again.failed, 0);
  EXPECT_EQ(read_file(folder / "marks/p0.json"), mended);
  EXPECT_EQ(read_file(folder / "marks/p1.json"), found);
  EXPECT_THAT(read_file(folder / "marks/landmarks.csv"), HasSubstr("by hand"));
}

TEST(LandmarkScans, ASingleScanComesWithTheLandmarksBesideItAsAFolderDoes) {
  const TemporaryDirectory folder;
  write_people(folder / "scans", 4, 1, 3);
  const std::vector<ScanFiles> one = list_scans({folder / "scans/p0.ply"}), all = list_scans({folder / "scans"});
  ASSERT_EQ(one.size(), 1u);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(one[0].landmarks, folder / "scans/p0.json");
  EXPECT_EQ(one[0].landmarks, all[0].landmarks);
}

TEST(LandmarkScans, TheFolderOfTheScansIsNoPlaceForPictures) {
  const TemporaryDirectory folder;
  write_people(folder / "scans", 4, 1, 3);
  write_file(folder / "scans/p0.png", "a texture");
  EXPECT_THAT([&] { landmark_scans(options_of(folder / "scans", folder / "scans")); },
              ThrowsMessage<InvalidInput>(HasSubstr("choose another")));
  LandmarkScansOptions one = options_of(folder / "scans/p0.ply", folder / "scans/found.json");
  EXPECT_EQ(landmark_scans(one).found, 1);
  EXPECT_TRUE(fs::exists(folder / "scans/found.landmarks.png"));
  EXPECT_EQ(read_file(folder / "scans/p0.png"), "a texture");
}

TEST(LandmarkScans, NumberedFormatsHoldTheNumberedLandmarks) {
  const TemporaryDirectory folder;
  write_people(folder / "scans", 4, 1, 3);
  LandmarkScansOptions options = options_of(folder / "scans", folder / "marks");
  options.format = "pts";
  EXPECT_EQ(landmark_scans(options).found, 1);
  EXPECT_EQ(read_landmarks(folder / "marks/p0.pts").size(), 68u);
}

TEST(LandmarkScans, FormatsThatCannotHoldTheNamesAreRefusedBeforeAnythingIsWritten) {
  const TemporaryDirectory folder;
  write_people(folder / "scans", 4, 1, 3);
  for (const char* format : {"bnd", "txt", ""}) {
    LandmarkScansOptions options = options_of(folder / "scans", folder / "marks");
    options.format = format;
    EXPECT_THROW(landmark_scans(options), InvalidInput) << format;
  }
  EXPECT_FALSE(fs::exists(folder / "marks"));
}

TEST(LandmarkRecord, AFileIsByHandUnlessItIsTheOneThatWasFound) {
  const TemporaryDirectory folder;
  const fs::path file = folder / "a.mrk.json";
  EXPECT_FALSE(is_by_hand(file)) << "there is none";
  write_found_landmarks(file, {{"31", {{1, 2, 3}}}}, "key");
  EXPECT_FALSE(is_by_hand(file));
  EXPECT_EQ(landmark_record(file)->key, "key");
  EXPECT_TRUE(fs::exists(folder / "a.found"));
  write_landmarks(file, {{"31", {{1, 2, 4}}}});
  EXPECT_TRUE(is_by_hand(file));
  write_search_in_vain(file, "no face");
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(landmark_record(file)->reason, "no face");
  write_landmarks(folder / "b.json", {{"31", {{1, 2, 3}}}});
  EXPECT_TRUE(is_by_hand(folder / "b.json")) << "nobody says that it was found";
  write_file(folder / "b.found", "[1, 2");
  EXPECT_TRUE(is_by_hand(folder / "b.json")) << "nor does a damaged record";
}

}  // namespace
}  // namespace facewright
