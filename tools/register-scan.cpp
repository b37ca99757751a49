// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Registers one scan to a reference face.
#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/intake/scan.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/register_scan.h"
#include "pipelines/error_picture.h"
#include "pipelines/reference_file.h"
#include "pipelines/registration_report.h"
#include "tools/scan_flags.h"

using namespace facewright;

int main(int argc, char** argv) {
  CLI::App app(
      "Registers one scan to the reference face. Writes ID.ply (in correspondence, with colours), ID.origins (one "
      "letter "
      "per vertex: m matched, r mirrored, i interpolated, f free), ID.json (how it went) and ID.error.png (signed "
      "distance from the denoised scan; hatched where the scan shows nothing).",
      "register-scan");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs | CommonFlags::units,
                     "register-scan face.ply --landmarks face.json -o registered");
  std::filesystem::path mesh, landmarks, reference_file;
  RegisterOptions options;
  ErrorPictureOptions picture;
  app.add_option("scan", mesh, "Scan to register (OBJ, PLY, STL, OFF, glTF)")->required();
  app.add_option("--landmarks", landmarks, "Its landmarks (.json, .pts, .pp, .mrk.json, .fcsv, .ljson)")->required();
  app.add_option("--reference", reference_file, "A file of make-reference instead of the built-in face")
      ->check(CLI::ExistingFile);
  app.add_option(
         "--slide", options.global.slide,
         "Landmarks of jaw, brows, lids and lips are this many times less certain along their curve; 1: as certain")
      ->check(CLI::Range(1.0, 100.0));
  app.add_option("--landmark-stddev", options.landmark_stddev, "Precision of landmarks that state none, mm")
      ->check(CLI::Range(0.01, 20.0));
  app.add_option("--error-range", picture.range, "Distance at which the error picture's colours end, mm")
      ->check(CLI::Range(0.001, 100.0));
  app.add_flag("--save-stages", options.keep_stages, "Also write the mesh after every stage: ID_global.ply, ...");
  return run_program(argc, argv, app, common, [&] {
    const Scan scan = load_scan({mesh.stem().string(), mesh, landmarks}, scan_options(common));
    const MultiresTemplate reference =
        reference_file.empty() ? default_reference() : build_template(load_reference_file(reference_file));
    const RegistrationResult result = register_scan(scan.mesh, scan.landmarks, reference, options);
    const auto file = [&](const std::string& suffix) { return common.output / (scan.id + suffix); };
    write_ply(file(".ply"), coloured_registration(scan, result, reference.levels.back().F));
    write_file(file(".origins"), origin_letters(result.origins));
    write_file(file(".json"), describe_registration(scan, result.summary) + "\n");
    write_png(file(".error.png"), error_picture(result, reference, picture));
    for (const RegistrationStage& stage : result.stages) write_ply(file("_" + stage.name + ".ply"), stage.mesh);
    report(common, summarise_registration(result.summary));
    report(common, "register-scan: wrote " + file(".ply").string() + " and " + file(".error.png").string());
    if (!result.summary.acceptable) throw InvalidInput(mesh.string() + ": registration: " + result.summary.concern);
    return ExitCode::ok;
  });
}
