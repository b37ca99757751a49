// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Registers one scan to the built-in reference face.
#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/intake/scan.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/register_scan.h"
#include "pipelines/registration_report.h"
#include "tools/cli.h"

using namespace facewright;

int main(int argc, char** argv) {
  CLI::App app("Registers one scan to the reference face: mesh in correspondence, origins of its vertices, summary.",
               "register-scan");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::units,
                     "register-scan face.ply --landmarks face.json -o registered");
  std::filesystem::path mesh, landmarks;
  RegisterOptions options;
  app.add_option("scan", mesh, "Scan to register (OBJ, PLY, STL, OFF, glTF)")->required();
  app.add_option("--landmarks", landmarks, "Its landmarks (.json, .pts, .pp, .mrk.json, .fcsv, .ljson)")->required();
  app.add_flag("--save-stages", options.keep_stages, "Also write the mesh after every stage");
  return run_program(argc, argv, app, common, [&] {
    const Scan scan = load_scan({mesh.stem().string(), mesh, landmarks}, {units_from_name(common.units), {}});
    const MultiresTemplate reference = default_reference();
    const RegistrationResult result = register_scan(scan.mesh, scan.landmarks, reference, options);
    const auto file = [&](const std::string& suffix) { return common.output / (scan.id + suffix); };
    write_ply(file(".ply"), coloured_registration(scan, result, reference.levels.back().F));
    write_file(file(".origins"), origin_letters(result.origins));
    write_file(file(".json"), describe_registration(scan, result.summary) + "\n");
    for (const RegistrationStage& stage : result.stages) write_ply(file("_" + stage.name + ".ply"), stage.mesh);
    report(common, "register-scan: wrote " + file(".ply").string() + "; surface " +
                       std::to_string(result.summary.surface_mean) + " mm, " + std::to_string(result.summary.folds) +
                       " folded edges");
    if (!result.summary.acceptable) throw InvalidInput(mesh.string() + ": registration: " + result.summary.concern);
    return ExitCode::ok;
  });
}
