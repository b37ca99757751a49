// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <cstdio>
#include <iostream>

#include "libmodel/core/topology.h"
#include "libmodel/model/check_model.h"
#include "libmodel/model/model_file.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

void print_levels(const MorphableModel& model) {
  std::printf("%-7s %9s %10s %9s %6s\n", "level", "vertices", "triangles", "boundary", "Euler");
  for (int l = 0; l < model.level_count(); ++l)
    std::printf("%-7d %9d %10d %9d %6d\n", l, model.vertex_count(l), static_cast<int>(model.faces(l).rows()),
                boundary_edge_count(model.faces(l)), euler_characteristic(model.faces(l)));
}

// Cumulative shares of the variance that was kept.
void print_modes(const char* name, const PcaModel& pca) {
  std::printf("%s: %d modes", name, static_cast<int>(pca.mode_count()));
  double sum = 0;
  for (Eigen::Index k = 0; k < pca.mode_count(); ++k) {
    sum += pca.variances[k];
    for (int shown : {1, 2, 3, 5, 10, 20, 40, 80, 160})
      if (k + 1 == shown)
        std::printf("%s %d: %.3f", shown == 1 ? "; share of the kept variance after" : ",", shown,
                    sum / pca.variances.sum());
  }
  std::printf("\n");
}

void print_rest(const MorphableModel& model) {
  std::printf("landmarks: %d\n", static_cast<int>(model.landmarks().size()));
  std::printf("texture coordinates: %s\n", model.uv().rows() > 0 ? "yes" : "no");
  std::printf("symmetry: %s, parents: %d, regions: %d\n", model.mirror().empty() ? "no" : "yes",
              static_cast<int>(model.parents().size()), static_cast<int>(model.regions().size()));
  for (const auto& [key, value] : model.provenance())
    std::printf("provenance %s: %.200s%s\n", key.c_str(), value.c_str(), value.size() > 200 ? " ..." : "");
}

bool print_checks(const std::vector<ModelCheck>& checks) {
  bool all = true;
  for (const ModelCheck& check : checks) {
    std::printf("%-6s %s (%s)\n", check.holds ? "ok" : "FAILED", check.property.c_str(), check.detail.c_str());
    all = all && check.holds;
  }
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Shows what is in a model file, and proves its properties.", "model-info");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::none, "model-info model.h5 --check");
  std::string input;
  bool check = false;
  app.add_option("model", input, "Model (.h5)")->required()->check(CLI::ExistingFile);
  app.add_flag("--check", check, "Prove nesting of the levels, orthonormality, order; exit code 1 if anything fails");
  return run_program(argc, argv, app, common, [&] {
    const MorphableModel model = load_model(input);
    print_levels(model);
    print_modes("shape", model.shape());
    print_modes("colour", model.colour());
    if (model.expression()) print_modes("expression", *model.expression());
    print_rest(model);
    return !check || print_checks(check_model_file(input)) ? ExitCode::ok : ExitCode::failed;
  });
}
