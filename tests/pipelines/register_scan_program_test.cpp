// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "pipelines/reference_file.h"
#include "tests/pipelines/scan_folder.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class RegisterScanProgram : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryDirectory;
    write_people(folder_->path(), 4, 1, 2.5);
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string path(const std::string& name) { return (*folder_ / name).string(); }
  static CommandResult run(const std::string& arguments) {
    return run_command(std::string(FACEWRIGHT_BIN_DIR) + "/register-scan " + arguments);
  }
  static std::string scan() { return path("p0.ply") + " --landmarks " + path("p0.json"); }

  static TemporaryDirectory* folder_;
};
TemporaryDirectory* RegisterScanProgram::folder_ = nullptr;

TEST_F(RegisterScanProgram, LeavesTheMeshItsOriginsTheReportThePictureAndTheStages) {
  const CommandResult r = run(scan() + " -o " + path("all") + " --save-stages");
  ASSERT_EQ(r.exit_code, 0) << r.output;
  EXPECT_THAT(r.output, AllOf(HasSubstr("matched"), HasSubstr("surface"), HasSubstr("folds"), HasSubstr("seconds")));
  const Mesh mesh = read_mesh(path("all/p0.ply"));
  EXPECT_EQ(mesh.V.rows(), 29587);
  EXPECT_TRUE(mesh.has_colours());
  EXPECT_EQ(read_file(path("all/p0.origins")).size(), 29587u);
  EXPECT_THAT(read_file(path("all/p0.json")), AllOf(HasSubstr("match_failures"), HasSubstr("stage_seconds")));
  EXPECT_GT(read_image(path("all/p0.error.png")).width, 900);
  EXPECT_EQ(read_mesh(path("all/p0_global.ply")).V.rows(), 845);
  for (const auto& [stage, vertices] :
       {std::pair("level0", 845), {"level1", 3448}, {"level2", 16759}, {"level3", 29587}})
    EXPECT_EQ(read_mesh(path("all/p0_" + std::string(stage) + ".ply")).V.rows(), vertices) << stage;
}

TEST_F(RegisterScanProgram, TheBuiltInFaceAsAReferenceFileGivesTheSameMesh) {
  save_reference_file(path("face.reference"), default_reference_face());
  ASSERT_EQ(run(scan() + " -q -o " + path("own") + " --reference " + path("face.reference")).exit_code, 0);
  ASSERT_EQ(run(scan() + " -q -j 1 -o " + path("built_in")).exit_code, 0);
  EXPECT_EQ(read_file(path("own/p0.ply")), read_file(path("built_in/p0.ply")));
  EXPECT_EQ(read_file(path("own/p0.error.png")), read_file(path("built_in/p0.error.png")));
}

TEST_F(RegisterScanProgram, KeepsTheContractOnBadInput) {
  CommandResult r = run(path("p0.ply") + " -o " + path("bad"));
  EXPECT_EQ(r.exit_code, 2) << r.output;
  r = run(path("p0.ply") + " --landmarks " + path("none.json") + " -o " + path("bad"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("none.json"));
  r = run(scan() + " -o " + path("bad") + " --reference " + path("p0.ply"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("no reference file"));
  write_ball(folder_->path());
  r = run(path("ball.ply") + " --landmarks " + path("ball.json") + " -o " + path("bad"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("landmarks"));
}

}  // namespace
}  // namespace facewright
