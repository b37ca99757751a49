// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/export_model.h"
#include "libmodel/model/model_file.h"
#include "tools/cli.h"
using namespace facewright;

int main(int argc, char** argv) {
  CLI::App app(
      "Writes one level of a model for other programs: the mean as OBJ or PLY, the model as eos, statismo or "
      "NumPy, also in the manner of FLAME, mean and named morph targets as glTF.",
      "export-model");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output, "export-model model.h5 --format eos --level 3448 -o face.bin");
  std::string input, format = "obj", basis = "orthonormal";
  int level = -1;
  ExportOptions options;
  app.add_option("model", input, "Model (.h5)")->required()->check(CLI::ExistingFile);
  app.add_option("--format", format, "What to write")->check(CLI::IsMember(export_format_names()));
  app.add_option("--level", level, "Vertex count of the level, or its index from 0, the coarsest; -1 = finest")
      ->check(CLI::Range(-1, 1 << 30).description(""));
  app.add_option("--basis", basis, "Basis of a coarse level: orthonormal, or shared coefficients with the other levels")
      ->check(CLI::IsMember({"orthonormal", "shared"}));
  app.add_option("--eos-version", options.eos_version, "Class version of the eos file")->check(CLI::IsMember({1, 4}));
  app.add_option("--morph-targets", options.morph_targets, "Leading modes of shape and expression in a glTF file")
      ->check(CLI::Range(0, 1000));
  app.add_option("--texture-size", options.texture_size,
                 "glTF, OBJ: pixels of the texture; 0 = colours at the vertices")
      ->check(CLI::Range(0, 8192));
  return run_program(argc, argv, app, common, [&] {
    options.basis = basis == "shared" ? ExportBasis::shared : ExportBasis::orthonormal;
    try_model_file(input);
    const MorphableModel model = load_model(input);
    const int l = level < model.level_count() ? level : model.level_with(level);
    export_model(common.output, model, l, export_format(format), options);
    report(common, "export-model: wrote " + common.output.string() + " (" + format + ", " +
                       std::to_string(model.vertex_count(l)) + " vertices)");
    return ExitCode::ok;
  });
}
