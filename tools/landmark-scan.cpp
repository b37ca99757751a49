// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Finds the landmarks of face scans.
#include <csignal>
#include <iostream>

#include "libmodel/core/errors.h"
#include "pipelines/landmark_scans.h"
#include "pipelines/pages/landmark_server.h"
#include "tools/scan_flags.h"

using namespace facewright;

namespace {

LandmarkServer* serving = nullptr;

// Until Ctrl+C.
int edit(const LandmarkScansOptions& options, int port, const CommonOptions& common) {
  if (!options.output.extension().empty())
    throw InvalidInput("landmark-scan: --edit writes ID.json into a folder; " + options.output.string() +
                       " is the name of a file. Give -o its folder");
  LandmarkServer server(list_scans(options.inputs),
                        {.output = options.output, .port = port, .saved = [&](const std::string& line) {
                           report(common, "landmark-scan: " + line);
                         }});
  serving = &server;
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { serving->stop(); });
  std::cout << "landmark-scan: open " << server.address() << "\n"
            << "landmark-scan: landmarks go to " << options.output.string() << "; Ctrl+C ends this" << std::endl;
  server.run();
  return ExitCode::ok;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Finds the ibug-68 landmarks of face scans in any orientation: dlib's predictor on rendered views where it is "
      "installed, the shape alone otherwise. Writes ID.json and a picture ID.png for every scan, landmarks.csv with a "
      "line for each, and problematic/ID.txt where no face was found.",
      "landmark-scan");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs | CommonFlags::units | CommonFlags::axes,
                     "landmark-scan scans -o landmarks");
  LandmarkScansOptions options;
  std::string method = "auto";
  bool no_colour = false, no_refine = false, by_hand = false;
  int port = 0;
  app.add_option("scans", options.inputs, "Scans (OBJ, PLY, STL, OFF, glTF) and folders of scans")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_flag("--edit", by_hand,
               "Look for nothing: serve a page on which the landmarks in the output folder, or those beside the scans, "
               "are placed and corrected by hand in a browser of this machine");
  app.add_option("--port", port, "Port of that page on 127.0.0.1; 0: any that is free")->check(CLI::Range(0, 65535));
  app.add_option("--format", options.format, "Extension of the landmark files in the output folder");
  app.add_option("--method", method, "auto: dlib where it is there, else geometry")
      ->check(CLI::IsMember({"auto", "dlib", "geometry"}));
  app.add_flag("--no-colour", no_colour, "Look at the shape alone, whatever colours the scan has");
  app.add_flag("--no-refine", no_refine, "Write what was detected, without the landmarks of the registered template");
  app.add_flag("--stddev", options.deviations, "JSON files state each landmark's standard deviation");
  app.add_option("--picture-size", options.find.picture_size, "Width of the views looked at, pixels")
      ->check(CLI::Range(320, 2048));
  app.add_option("--predictor", options.predictor, "dlib's 68-point predictor, if not where Debian puts it")
      ->check(CLI::ExistingFile);
  app.add_option("--reference", options.reference, "A file of make-reference instead of the built-in face")
      ->check(CLI::ExistingFile);
  return run_program(argc, argv, app, common, [&] {
    options.output = common.output;
    options.jobs = common.jobs;
    options.scan = scan_options(common);
    options.method = landmark_method_from_name(method);
    options.find.use_colour = !no_colour;
    options.find.refine = !no_refine;
    if (by_hand) return edit(options, port, common);
    ProgressBar bar(common);
    const LandmarkScansSummary summary = landmark_scans(options, bar.progress());
    for (const LandmarkedScan& o : summary.scans) {
      if (!o.found) std::cerr << "landmark-scan: " << o.file.string() << ": " << o.reason << "\n";
      std::string stages;
      for (const auto& [stage, seconds] : o.summary.seconds)
        stages += " " + stage + " " + std::to_string(static_cast<int>(1000 * seconds)) + " ms";
      detail(common, "  " + o.id + ":" + stages);
    }
    if (summary.by_hand > 0)
      report(common, "landmark-scan: " + std::to_string(summary.by_hand) +
                         " files were written by hand and are kept; remove them to have those landmarks found");
    report(common, "landmark-scan: " + std::to_string(summary.found) + " of " + std::to_string(summary.scans.size()) +
                       " scans, by " + (summary.used_pictures ? "dlib on rendered views" : "geometry"));
    if (summary.found + summary.by_hand == 0) return ExitCode::failed;
    return summary.failed > 0 ? ExitCode::some_failed : ExitCode::ok;
  });
}
