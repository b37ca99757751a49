// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;

std::vector<std::string> programs() {
  std::istringstream list(FACEWRIGHT_PROGRAMS);
  std::vector<std::string> names;
  for (std::string name; list >> name;) names.push_back(name);
  return names;
}

class EveryProgram : public ::testing::TestWithParam<std::string> {
 protected:
  CommandResult run(const std::string& arguments) const {
    return run_command(std::string(FACEWRIGHT_BIN_DIR) + "/" + GetParam() + " " + arguments);
  }
};

TEST_P(EveryProgram, HelpsWithAnExample) {
  const CommandResult result = run("--help");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.output, HasSubstr("Example:\n  " + GetParam() + " "));
}

TEST_P(EveryProgram, TellsItsVersion) {
  const CommandResult result = run("--version");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.output, HasSubstr(GetParam() + " (Facewright "));
}

TEST_P(EveryProgram, RefusesUnknownOptionsAsWrongUsage) { EXPECT_EQ(run("--no-such-option").exit_code, 2); }

// -1 is the finest level; a slip of the finger is no other way to say so.
TEST(LevelOption, BelowMinusOneIsNoLevel) {
  const std::string bin = FACEWRIGHT_BIN_DIR;
  for (const std::string& call :
       {"export-model " + bin + "/export-model", "sample-model " + bin + "/sample-model", "evaluate-model " + bin}) {
    const CommandResult result = run_command(bin + "/" + call + " -o unwritten --level -5");
    EXPECT_EQ(result.exit_code, 2) << call;
    EXPECT_THAT(result.output, HasSubstr("--level")) << call;
  }
}

std::string test_name(const ::testing::TestParamInfo<std::string>& program) {
  std::string name = program.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Programs, EveryProgram, ::testing::ValuesIn(programs()), test_name);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(EveryProgram);

}  // namespace
}  // namespace facewright
