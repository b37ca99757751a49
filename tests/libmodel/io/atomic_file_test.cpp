// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "libmodel/core/errors.h"
#include "libmodel/io/sha256.h"
#include "tests/libmodel/io/scratch_folder.h"

namespace facewright {
namespace {

using AtomicFile = ScratchFolder;

TEST_F(AtomicFile, ReadsBackEveryByteItWrote) {
  std::string bytes;
  for (int i = 0; i < 70000; ++i) bytes += static_cast<char>(i * 31);
  write_file(folder_ / "a.bin", bytes);
  EXPECT_EQ(read_file(folder_ / "a.bin"), bytes);
  write_file(folder_ / "a.bin", "");
  EXPECT_EQ(read_file(folder_ / "a.bin"), "");
}

TEST_F(AtomicFile, CreatesFoldersAndLeavesNoTemporaryBehind) {
  write_file(folder_ / "deep/er/a.txt", "x");
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) files += entry.is_regular_file();
  EXPECT_EQ(files, 1);
}

TEST_F(AtomicFile, FailedWriteKeepsTheFolderClean) {
  std::filesystem::create_directories(folder_ / "taken/inside");
  EXPECT_THROW(write_file(folder_ / "taken", "x"), IoError);  // a folder cannot be replaced
  int entries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) entries += !entry.path().empty();
  EXPECT_EQ(entries, 1);
}

TEST_F(AtomicFile, MissingFileAndFolderAreNamedInTheError) {
  try {
    read_file(folder_ / "none.txt");
    FAIL();
  } catch (const IoError& e) {
    EXPECT_NE(std::string(e.what()).find("none.txt"), std::string::npos);
  }
  EXPECT_THROW(read_file(folder_), IoError);
}

TEST(Sha256, AgreesWithThePublishedExamples) {  // FIPS 180-4 examples; lengths around the padding boundary
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_F(AtomicFile, SameBytesAreNotWrittenAgain) {
  EXPECT_TRUE(write_file_if_changed(folder_ / "a.txt", "one"));
  const auto time = std::filesystem::last_write_time(folder_ / "a.txt");
  EXPECT_FALSE(write_file_if_changed(folder_ / "a.txt", "one"));
  EXPECT_EQ(std::filesystem::last_write_time(folder_ / "a.txt"), time);
  EXPECT_TRUE(write_file_if_changed(folder_ / "a.txt", "two"));
  EXPECT_EQ(read_file(folder_ / "a.txt"), "two");
}

TEST_F(AtomicFile, TemporariesOfTheDeadGoAndNothingElse) {
  const std::string ours = std::to_string(::getpid());
  const pid_t child = ::fork();
  if (child == 0) ::_exit(0);
  ::waitpid(child, nullptr, 0);  // a number that no process has now
  const std::string dead = std::to_string(child);
  for (const std::string& name : {".a.ply." + dead + ".0.tmp", "deep/.b.json." + dead + ".17.tmp"})
    write_file(folder_ / name, "half");
  const std::vector<std::string> others = {
      ".a.ply." + ours + ".0.tmp", "a.ply." + dead + ".0.tmp", ".a.tmp",
      ".a." + dead + ".tmp",       ".a.ply.-5.0.tmp",          ".a." + dead + ".0.txt"};
  for (const std::string& name : others) write_file(folder_ / name, "whole");
  EXPECT_EQ(remove_abandoned_temporaries(folder_), 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ / ("deep/.b.json." + dead + ".17.tmp")));
  for (const std::string& name : others) EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
  EXPECT_EQ(remove_abandoned_temporaries(folder_ / "nowhere"), 0);
}

}  // namespace
}  // namespace facewright
