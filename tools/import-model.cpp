// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/import_model.h"
#include "libmodel/model/model_file.h"
#include "tools/cli.h"
using namespace facewright;

int main(int argc, char** argv) {
  CLI::App app(
      "Reads a morphable model of another program and saves it as a model of this one. Says what it decided about "
      "units, axes, winding and scaling of the basis.",
      "import-model");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output, "import-model 01_MorphableModel.mat -o bfm.h5");
  std::string input;
  ImportOptions options;
  std::vector<std::string> formats = import_format_names();
  formats.insert(formats.begin(), "auto");
  app.add_option("model", input, "Model of another program: a file, or ICT-FaceKit's folder of meshes")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--format", options.format, "What it is; auto = by its content")->check(CLI::IsMember(formats));
  app.add_option("--units", options.units, "Its lengths; auto = as the format defines, checked by the face's height")
      ->check(CLI::IsMember({"auto", "um", "mm", "cm", "m"}));
  app.add_option("--winding", options.winding, "Its triangles; auto = so that they point outward")
      ->check(CLI::IsMember({"auto", "keep", "turn"}));
  app.add_option("--axes", options.axes, "Its axes that are the subject's left, up, out of the face: \"x z -y\"");
  app.add_option("--values", options.values, "What stands beside its basis; columns = each is one standard deviation")
      ->check(CLI::IsMember({"auto", "variance", "sigma", "columns"}));
  app.add_option("--colours", options.colours, "Its colours: linear light, or sRGB as in pictures")
      ->check(CLI::IsMember({"auto", "linear", "srgb"}));
  app.add_flag("--keep-columns", options.keep_columns, "Leave a basis that is not orthogonal as it is");
  app.add_option("--identity-modes", options.identity_modes,
                 "FLAME: leading columns that are identity; -1 = by itself");
  app.add_option("--leading-vertices", options.leading_vertices, "Only so many leading vertices; 0 = all")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--blendshapes", options.blendshapes, "eos: the file of blendshapes beside the model")
      ->check(CLI::ExistingFile);
  app.add_option("--isomap", options.isomap, "Texture coordinates as text, x y per vertex")->check(CLI::ExistingFile);
  return run_program(argc, argv, app, common, [&] {
    const ImportResult result = import_model(input, options);
    save_model(common.output, result.model);
    report(common, "import-model: " + result.format);
    for (const std::string& decision : result.decisions) report(common, "  " + decision);
    report(common, "import-model: wrote " + common.output.string() + " (" +
                       std::to_string(result.model.vertex_count()) + " vertices, " +
                       std::to_string(result.model.shape().mode_count()) + " shape modes)");
    return ExitCode::ok;
  });
}
