// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "tools/cli.h"

#if __has_include(<malloc.h>)
#include <malloc.h>  // glibc
#endif
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <sstream>

#include "libmodel/core/errors.h"

namespace facewright {

namespace fs = std::filesystem;

void add_common_options(CLI::App& app, CommonOptions& common, CommonFlags flags, const std::string& example) {
  app.option_defaults()->always_capture_default();
  app.get_formatter()->column_width(34);
  app.footer("Example:\n  " + example);
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.set_version_flag("--version", app.get_name() + " (Facewright " FACEWRIGHT_VERSION ")", "Print the version");
  app.set_config("--config", "", "Read options from a TOML file; its keys are the option names")->type_name("FILE");
  if (has(flags, CommonFlags::output))
    app.add_option("-o,--output", common.output, "Where the result goes")->required()->default_str("");
  if (has(flags, CommonFlags::jobs))
    app.add_option("-j,--jobs", common.jobs, "Threads, 0 = all cores")->check(CLI::Range(0, 4096));
  if (has(flags, CommonFlags::seed)) app.add_option("--seed", common.seed, "Seed of everything random");
  if (has(flags, CommonFlags::units))
    app.add_option("--units", common.units, "Length unit of the input files")
        ->check(has(flags, CommonFlags::axes) ? CLI::IsMember({"auto", "mm", "cm", "m", "inch"})
                                              : CLI::IsMember({"auto", "mm", "cm", "m"}));
  if (has(flags, CommonFlags::axes)) {
    const CLI::IsMember axis({"auto", "x", "+x", "-x", "y", "+y", "-y", "z", "+z", "-z"});
    app.add_option("--up", common.up,
                   "Axis of the scans that points to the crown, as in --up=-y; where no landmarks are given")
        ->check(axis);
    app.add_option("--front", common.front,
                   "Axis of the scans that the nose points along; where no landmarks are given")
        ->check(axis);
    app.add_option("--handedness", common.handedness,
                   "Whether the scans' axes are right- or left-handed (mirrored); where no landmarks are given")
        ->check(CLI::IsMember({"auto", "right", "left"}));
  }
  if (has(flags, CommonFlags::resume))
    app.add_flag("--resume", common.resume, "Keep the finished work of an earlier run")->configurable(false);
  common.resumable = has(flags, CommonFlags::resume);
  auto* quiet = app.add_flag("-q,--quiet", common.quiet, "Print errors only")->configurable(false);
  app.add_flag("-v,--verbose", common.verbose, "Print details")->configurable(false)->excludes(quiet);
}

namespace {

// "key=value" of one option, given or default; empty for what was not set and has no default (flags keep their own).
std::string config_line(const CLI::Option& option) {
  constexpr char kSeparator = ',', kOpen = '[', kClose = ']', kQuote = '"', kCharacter = '\'';
  const std::string preset = option.get_default_str();
  std::string value;
  if (option.count() > 0)
    value = CLI::detail::ini_join(option.reduced_results(), kSeparator, kOpen, kClose, kQuote, kCharacter);
  else if (!preset.empty() && preset != "[]")  // an empty list is no value that could be read back
    value = preset.front() == kOpen ? preset : CLI::detail::convert_arg_for_ini(preset, kQuote, kCharacter);
  return value.empty() ? "" : option.get_single_name() + "=" + value + "\n";
}

// The effective options of a run, so that `program --config FILE` repeats it.
void save_effective_options(const CLI::App& app, const CommonOptions& common) {
  if (common.output.empty()) return;
  const fs::path path = fs::is_directory(common.output) ? common.output / (app.get_name() + ".toml")
                                                        : fs::path(common.output.string() + ".toml");
  std::ostringstream text;
  text << "# " << app.get_name() << " " << FACEWRIGHT_VERSION << ": repeat with " << app.get_name() << " --config "
       << path.filename().string() << "\n";
  for (const CLI::Option* option : app.get_options())
    if (option->get_configurable()) text << config_line(*option);
  std::ostringstream earlier;
  if (std::ifstream file(path); file) earlier << file.rdbuf();
  if (earlier.str() == text.str()) return;
  const fs::path temporary = path.string() + ".tmp";
  if (std::ofstream file(temporary); !(file << text.str()).flush())
    throw IoError(temporary.string(), "cannot write the effective options here");
  fs::rename(temporary, path);
}

// The signal that asked the program to stop, or 0.
volatile std::sig_atomic_t stop_signal = 0;

void remember_signal(int signal) { stop_signal = signal; }

// The first SIGINT or SIGTERM is remembered, a second one ends the program at once.
void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = remember_signal;
  action.sa_flags = SA_RESETHAND;
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

/// Thrown from a progress report once a signal has come.
struct Stopped {
  int signal;
};

int fail(const CLI::App& app, const std::string& message) {
  std::cout.flush();
  std::cerr << app.get_name() << ": error: " << message << std::endl;
  return ExitCode::failed;
}

int usage_exit(const CLI::App& app, const CLI::ParseError& e) {
  const int code = app.exit(e);  // prints help, version or the message
  return code == 0 ? ExitCode::ok : ExitCode::wrong_usage;
}

}  // namespace

namespace {

// glibc gives large arrays back to the system at once, and the system clears them again for the next: a fifth of the
// time spent on a scan of two million triangles. The peak stays the same.
void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the most it takes
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
#endif
}

}  // namespace

int run_program(int argc, const char* const* argv, CLI::App& app, CommonOptions& common,
                const std::function<int()>& body) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return usage_exit(app, e);
  }
  keep_freed_memory();
  if (common.resumable) catch_stop_signals();
  try {
    const int code = body();
    if (code == ExitCode::ok || code == ExitCode::some_failed) save_effective_options(app, common);
    return code;
  } catch (const CLI::ParseError& e) {  // a body may refuse a combination of options: throw CLI::ValidationError
    return usage_exit(app, e);
  } catch (const Stopped& stopped) {
    std::cout.flush();
    std::cerr << app.get_name() << ": stopped by " << (stopped.signal == SIGINT ? "SIGINT" : "SIGTERM")
              << "; what is finished is kept, go on with the same command and --resume" << std::endl;
    return 128 + stopped.signal;
  } catch (const std::bad_alloc&) {
    return fail(app, "out of memory; try fewer threads (-j) or a smaller input");
  } catch (const std::exception& e) {  // InvalidInput, IoError, SolverError: the message says it all
    return fail(app, e.what());
  }
}

void report(const CommonOptions& common, const std::string& line) {
  if (!common.quiet) std::cout << line << std::endl;
}

void detail(const CommonOptions& common, const std::string& line) {
  if (common.verbose) std::cout << line << std::endl;
}

std::string format_duration(double seconds) {
  const long total = std::lround(std::max(0.0, seconds));
  char text[64];
  if (total < 60)
    std::snprintf(text, sizeof text, "%ld s", total);
  else if (total < 3600)
    std::snprintf(text, sizeof text, "%ld min %02ld s", total / 60, total % 60);
  else
    std::snprintf(text, sizeof text, "%ld h %02ld min", total / 3600, total % 3600 / 60);
  return text;
}

namespace {

ProgressBar::Style default_style(const CommonOptions& common) {
  if (common.quiet) return ProgressBar::Style::silent;
  return isatty(STDERR_FILENO) != 0 ? ProgressBar::Style::terminal : ProgressBar::Style::lines;
}

void write_to_stderr(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

constexpr const char* kClearLine = "\r\033[K";

}  // namespace

ProgressBar::ProgressBar(const CommonOptions& common) : ProgressBar(default_style(common), write_to_stderr) {}

ProgressBar::ProgressBar(Style style, std::function<void(const std::string&)> sink)
    : style_(style), sink_(std::move(sink)), stage_start_(Clock::now()), last_event_(stage_start_) {}

ProgressBar::~ProgressBar() {
  if (bar_shown_) sink_(kClearLine);
}

Progress ProgressBar::progress() {
  return [this](const ProgressEvent& event) { update(event); };
}

void ProgressBar::note(const std::string& line) {
  const std::scoped_lock lock(mutex_);
  if (style_ == Style::silent) return;
  sink_((bar_shown_ ? kClearLine : "") + line + "\n");
  bar_shown_ = false;
}

void ProgressBar::update(const ProgressEvent& event) {
  if (stop_signal != 0) throw Stopped{stop_signal};
  const std::scoped_lock lock(mutex_);
  if (style_ == Style::silent) return;
  const auto now = Clock::now();
  const bool new_stage = event.stage != stage_;
  if (new_stage) {
    stage_ = event.stage;
    done_ = -1;
    // A stage that opens with its first finished item began when the one before ended.
    first_done_ = event.done <= 1 ? 0 : event.done;
    stage_start_ = event.done == 1 ? last_event_ : now;
  }
  last_event_ = now;
  if (event.done < done_) return;  // threads may overtake each other
  done_ = event.done;
  const bool finished = event.total > 0 && event.done >= event.total;
  if (style_ == Style::lines) {
    if (!new_stage && !finished && now - last_line_ < std::chrono::seconds(1)) return;
    last_line_ = now;
    sink_(line_text(event, now) + "\n");
    return;
  }
  if (!new_stage && !finished && bar_shown_ && now - last_line_ < std::chrono::milliseconds(50)) return;
  last_line_ = now;
  sink_(kClearLine + bar_text(event, now) + (finished ? "\n" : ""));
  bar_shown_ = !finished;
}

std::string ProgressBar::remaining_text(const ProgressEvent& event, Clock::time_point now) const {
  const double elapsed = std::chrono::duration<double>(now - stage_start_).count();
  if (event.total > 0 && event.done >= event.total) return "done in " + format_duration(elapsed);
  const int fresh = event.done - first_done_;
  if (event.total <= 0 || fresh <= 0) return "";
  return format_duration(elapsed / fresh * (event.total - event.done)) + " left";
}

namespace {

std::string counter(const ProgressEvent& event) {
  std::string text = std::to_string(event.done);
  if (event.total > 0) text += "/" + std::to_string(event.total);
  return text;
}

}  // namespace

std::string ProgressBar::line_text(const ProgressEvent& event, Clock::time_point now) const {
  std::string text = "[" + event.stage + "] " + counter(event);
  if (!event.item.empty()) text += " " + event.item;
  const std::string remaining = remaining_text(event, now);
  return remaining.empty() ? text : text + ", " + remaining;
}

std::string ProgressBar::bar_text(const ProgressEvent& event, Clock::time_point now) const {
  constexpr int kWidth = 24;
  const int filled = event.total > 0 ? std::clamp(kWidth * event.done / event.total, 0, kWidth) : 0;
  std::string text = event.stage + " [" + std::string(static_cast<size_t>(filled), '#') +
                     std::string(static_cast<size_t>(kWidth - filled), '.') + "] " + counter(event);
  const std::string remaining = remaining_text(event, now);
  if (!remaining.empty()) text += "  " + remaining;
  if (!event.item.empty()) text += "  " + event.item;
  return text;
}

}  // namespace facewright
