// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>

#include "libmodel/core/progress.h"

// What all programs share: flags, exit codes, messages, progress. A whole program looks like this:
//
//   #include "libmodel/io/landmark_files.h"
//   #include "libmodel/io/mesh_files.h"
//   #include "tools/cli.h"
//   using namespace facewright;
//
//   int main(int argc, char** argv) {
//     CLI::App app("Thins a mesh out to a number of vertices.", "thin-mesh");
//     CommonOptions common;
//     add_common_options(app, common, CommonFlags::output | CommonFlags::jobs,
//                        "thin-mesh scan.ply --vertices 5000 -o thin.ply");  // FIRST
//     std::string input;
//     ThinOptions options;
//     app.add_option("mesh", input, "Mesh to thin (.ply, .obj)")->required()->check(CLI::ExistingFile);
//     app.add_option("--vertices", options.vertex_count, "Vertices to keep")->check(CLI::Range(4, 1000000));
//     return run_program(argc, argv, app, common, [&] {
//       ProgressBar bar(common);
//       options.threads = common.jobs;
//       const ThinResult result = thin(read_mesh(input), options, bar.progress());  // ONE library call
//       write_ply(common.output, result.mesh);
//       report(common, "thin-mesh: wrote " + common.output.string());
//       return ExitCode::ok;  // or ExitCode::some_failed
//     });
//   }
//
// and in tools/CMakeLists.txt: facewright_tool(thin-mesh LINK facewright::io facewright::surface)
//
// - Parsing mistakes end with exit code 2, exceptions with 1 and their message on stderr: write no try/catch.
// - Default values are captured from the variables when an option is added, so library defaults show in --help.
// - Option names are the keys of --config files. The effective options are saved after success beside the output: as
//   OUT/<program>.toml when -o names a folder, as FILE.toml when it names a file.
// - Results that scripts read go to stdout (std::cout); report() is silent under -q; progress and errors go to stderr.
namespace facewright {

/// Exit codes of all programs; wrong usage exits with 2 by itself.
struct ExitCode {
  static constexpr int ok = 0, failed = 1, wrong_usage = 2;
  static constexpr int some_failed = 3;  ///< finished, but some inputs failed; each is listed with its reason
  // Programs with --resume that a signal stops between two items: 128 + its number, as shells count.
};

/// Which of the shared options a program has; --config, -q, -v, --help and --version are in every program.
enum class CommonFlags : unsigned { none = 0, output = 1, jobs = 2, seed = 4, units = 8, resume = 16, axes = 32 };
constexpr CommonFlags operator|(CommonFlags a, CommonFlags b) {
  return static_cast<CommonFlags>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
constexpr bool has(CommonFlags set, CommonFlags flag) {
  return (static_cast<unsigned>(set) & static_cast<unsigned>(flag)) != 0;
}

/// Values of the shared options.
struct CommonOptions {
  std::filesystem::path output;     ///< -o: required where the program has it
  int jobs = 0;                     ///< -j: threads, 0 = all cores
  std::uint64_t seed = 1;           ///< --seed
  std::string units = "auto";       ///< --units: auto, mm, cm, m or inch
  std::string up = "auto";          ///< --up: axis of the input files towards the crown: auto, x, -x, ...
  std::string front = "auto";       ///< --front: axis towards the nose
  std::string handedness = "auto";  ///< --handedness: auto, right or left
  bool resume = false;              ///< --resume: keep finished work of an earlier run
  bool resumable = false;  ///< the program has --resume: SIGINT and SIGTERM end it between two items, nothing is lost
  bool quiet = false;      ///< -q: errors only
  bool verbose = false;    ///< -v: one line per step, details
};

/// Adds the shared options; `example` is a whole command line shown by --help. Call it before adding options of your
/// own. `common` must outlive `app`.
void add_common_options(CLI::App& app, CommonOptions& common, CommonFlags flags, const std::string& example);

/// Parses the command line and runs `body`, whose return value is the exit code. Catches everything, once.
int run_program(int argc, const char* const* argv, CLI::App& app, CommonOptions& common,
                const std::function<int()>& body);

/// A line for people on stdout, unless -q.
void report(const CommonOptions& common, const std::string& line);
/// A line for people on stdout, only with -v.
void detail(const CommonOptions& common, const std::string& line);

/// "48 s", "3 min 20 s", "1 h 05 min".
std::string format_duration(double seconds);

/// Draws progress on stderr: on a terminal one line that moves, with n/N and the time left; elsewhere plain lines, at
/// most one a second per stage besides the last. Threads may report at once.
class ProgressBar {
 public:
  enum class Style { silent, lines, terminal };
  /// Silent under -q, else a bar on a terminal, else lines.
  explicit ProgressBar(const CommonOptions& common);
  /// For tests: an explicit style and a sink instead of stderr.
  ProgressBar(Style style, std::function<void(const std::string&)> sink);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// What libraries take; valid as long as the bar lives.
  Progress progress();
  /// Prints a whole line without tearing the bar (a warning in the middle of a run).
  void note(const std::string& line);
  void update(const ProgressEvent& event);

 private:
  using Clock = std::chrono::steady_clock;
  std::string line_text(const ProgressEvent& event, Clock::time_point now) const;
  std::string bar_text(const ProgressEvent& event, Clock::time_point now) const;
  std::string remaining_text(const ProgressEvent& event, Clock::time_point now) const;

  Style style_;
  std::function<void(const std::string&)> sink_;
  std::mutex mutex_;
  std::string stage_;
  int done_ = -1;
  int first_done_ = 0;  // items already done when the stage's clock started
  Clock::time_point stage_start_, last_event_, last_line_;
  bool bar_shown_ = false;
};

}  // namespace facewright
