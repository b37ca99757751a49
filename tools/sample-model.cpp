// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <cstdio>

#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

std::string file_name(int index) {
  char name[32];
  std::snprintf(name, sizeof name, "%04d.ply", index);
  return name;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Draws random faces from a model, one PLY each.", "sample-model");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::seed, "sample-model model.h5 -n 10 -o faces");
  std::string input;
  int count = 10, level = -1;
  double sigma = 1;
  app.add_option("model", input, "Model (.h5)")->required()->check(CLI::ExistingFile);
  app.add_option("-n,--count", count, "Number of faces")->check(CLI::Range(1, 1000000));
  app.add_option("--level", level, "Vertex count of the level, or its index from 0, the coarsest; -1 = finest")
      ->check(CLI::Range(-1, 1 << 30).description(""));
  app.add_option("--sigma", sigma, "Standard deviation of the coefficients; 1 = as in the population, 0 = the mean")
      ->check(CLI::Range(0.0, 10.0));
  return run_program(argc, argv, app, common, [&] {
    try_model_file(input);
    const MorphableModel model = load_model(input);
    const int l = level < model.level_count() ? level : model.level_with(level);
    ProgressBar bar(common);
    for (int i = 0; i < count; ++i) {
      Random random = Random::stream(common.seed, static_cast<std::uint64_t>(i));
      write_ply(common.output / file_name(i), model.sample(random, l, sigma));
      bar.update({"sampling", i + 1, count, file_name(i)});
    }
    report(common, "sample-model: wrote " + std::to_string(count) + " faces to " + common.output.string());
    return ExitCode::ok;
  });
}
