// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tools/cli.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "libmodel/core/errors.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// A small program with every kind of option.
struct Program {
  CLI::App app{"Does nothing, thoroughly.", "do-nothing"};
  CommonOptions common;
  std::string input, optional_file;
  double share = 0.99;
  std::vector<int> budgets = {3448, 16759};
  bool symmetric = true;

  Program() {
    add_common_options(app, common, CommonFlags::output | CommonFlags::jobs | CommonFlags::seed | CommonFlags::units,
                       "do-nothing scans -o out");
    app.add_option("input", input, "Input")->required();
    app.add_option("--optional-file", optional_file, "A file");
    app.add_option("--share", share, "Share");
    app.add_option("--budgets", budgets, "Budgets");
    app.add_flag("--symmetric,!--no-symmetric", symmetric, "Symmetric");
  }
  int run(
      std::vector<const char*> arguments, const std::function<int()>& body = [] { return ExitCode::ok; }) {
    arguments.insert(arguments.begin(), "do-nothing");
    return run_program(static_cast<int>(arguments.size()), arguments.data(), app, common, body);
  }
};

std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

TEST(RunProgram, ExitCodesTellUsageFromFailure) {
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(Program().run({}), ExitCode::wrong_usage);
  EXPECT_EQ(Program().run({"in", "-o", "out", "--no-such-option"}), ExitCode::wrong_usage);
  EXPECT_EQ(Program().run({"in", "-o", "out", "--units", "inch"}), ExitCode::wrong_usage);
  EXPECT_EQ(Program().run({"in", "-o", "out", "-q", "-v"}), ExitCode::wrong_usage);
  EXPECT_EQ(Program().run({"in", "-o", "out"}, []() -> int { throw IoError("a.ply", 3, "truncated"); }),
            ExitCode::failed);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("do-nothing: error: a.ply:3: truncated"));
}

TEST(RunProgram, HelpAndVersionAreNoFailures) {
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(Program().run({"--help"}), ExitCode::ok);
  EXPECT_EQ(Program().run({"--version"}), ExitCode::ok);
  const std::string output = ::testing::internal::GetCapturedStdout();
  EXPECT_THAT(output, HasSubstr("do-nothing scans -o out"));  // the example
  EXPECT_THAT(output, HasSubstr("[3448,16759]"));             // defaults are shown
  EXPECT_THAT(output, HasSubstr("(Facewright "));
}

TEST(RunProgram, SavedOptionsRepeatTheRun) {
  const TemporaryDirectory directory;
  const std::string out = directory.path().string(), config = (directory / "do-nothing.toml").string();
  ASSERT_EQ(Program().run({"a file.ply", "-o", out.c_str(), "--share", "0.5", "--budgets", "1", "2", "3",
                           "--no-symmetric", "--seed", "7"}),
            ExitCode::ok);
  Program again;
  ASSERT_EQ(again.run({"--config", config.c_str()}), ExitCode::ok);
  EXPECT_EQ(again.input, "a file.ply");
  EXPECT_EQ(again.share, 0.5);
  EXPECT_THAT(again.budgets, ElementsAre(1, 2, 3));
  EXPECT_FALSE(again.symmetric);
  EXPECT_EQ(again.common.seed, 7u);
  EXPECT_EQ(again.common.output, out);
}

TEST(RunProgram, SavedDefaultsKeepFlagsAndListsAsTheyWere) {
  const TemporaryDirectory directory;
  const std::string out = directory.path().string(), config = (directory / "do-nothing.toml").string();
  ASSERT_EQ(Program().run({"in", "-o", out.c_str()}), ExitCode::ok);
  Program again;
  ASSERT_EQ(again.run({"--config", config.c_str()}), ExitCode::ok);
  EXPECT_TRUE(again.symmetric);
  EXPECT_THAT(again.budgets, ElementsAre(3448, 16759));
  EXPECT_EQ(again.optional_file, "");
}

TEST(RunProgram, CommandLineWinsOverConfigAndUnknownKeysAreRefused) {
  const TemporaryDirectory directory;
  const std::string config = (directory / "c.toml").string(), out = (directory / "x").string();
  std::ofstream(config) << "share=0.25\nseed=3\n";
  Program program;
  ASSERT_EQ(program.run({"in", "-o", out.c_str(), "--config", config.c_str(), "--seed", "9"}), ExitCode::ok);
  EXPECT_EQ(program.share, 0.25);
  EXPECT_EQ(program.common.seed, 9u);
  std::ofstream(config) << "shear=0.25\n";
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(Program().run({"in", "-o", out.c_str(), "--config", config.c_str()}), ExitCode::wrong_usage);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("shear"));
}

TEST(RunProgram, AFailedRunSavesNothing) {
  const TemporaryDirectory directory;
  const std::string out = directory.path().string();
  ::testing::internal::CaptureStderr();
  Program().run({"in", "-o", out.c_str()}, []() -> int { throw InvalidInput("no"); });
  ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(text_of(directory / "do-nothing.toml"), "");
}

TEST(ProgressBar, LinesShowCountsAndTheLastIsAlwaysThere) {
  std::string text;
  {
    ProgressBar bar(ProgressBar::Style::lines, [&](const std::string& s) { text += s; });
    const Progress progress = bar.progress();
    for (int i = 1; i <= 1000; ++i) progress({"register", i, 1000, "scan" + std::to_string(i)});
  }
  EXPECT_THAT(text, HasSubstr("[register] 1/1000 scan1"));
  EXPECT_THAT(text, HasSubstr("[register] 1000/1000 scan1000, done in"));
  EXPECT_THAT(text, Not(HasSubstr("\r")));
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 100);
}

TEST(ProgressBar, TerminalBarEndsWithANewLineAndNotesDoNotTearIt) {
  std::string text;
  {
    ProgressBar bar(ProgressBar::Style::terminal, [&](const std::string& s) { text += s; });
    bar.update({"fit", 0, 2, ""});
    bar.note("warning: dark image");
    bar.update({"fit", 2, 2, ""});
  }
  EXPECT_THAT(text, HasSubstr("\r\033[Kwarning: dark image\n"));
  EXPECT_THAT(text, HasSubstr("[########################] 2/2"));
  EXPECT_EQ(text.back(), '\n');
}

TEST(ProgressBar, CountsNeverRunBackwardsWhenThreadsOvertake) {
  std::string text;
  ProgressBar bar(ProgressBar::Style::lines, [&](const std::string& s) { text += s; });
  bar.update({"register", 3, 3, "c"});
  bar.update({"register", 2, 3, "b"});
  EXPECT_THAT(text, Not(HasSubstr("2/3")));
}

TEST(ProgressBar, QuietIsSilent) {
  CommonOptions common;
  common.quiet = true;
  ::testing::internal::CaptureStderr();
  {
    ProgressBar bar(common);
    bar.update({"fit", 1, 2, ""});
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(FormatDuration, IsWrittenForPeople) {
  EXPECT_EQ(format_duration(0.4), "0 s");
  EXPECT_EQ(format_duration(200), "3 min 20 s");
  EXPECT_EQ(format_duration(3900), "1 h 05 min");
}

}  // namespace
}  // namespace facewright
