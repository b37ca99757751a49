// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <cstdio>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/interop/exported_levels.h"
#include "libmodel/model/check_model.h"
#include "libmodel/model/level_topology.h"
#include "libmodel/model/model_file.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

void print_levels(const MorphableModel& model) {
  std::printf("%-7s %9s %10s %9s %6s %9s %9s %s\n", "level", "vertices", "triangles", "boundary", "Euler", "manifold",
              "oriented", "mirror");
  const std::vector<LevelTopology> all = level_topologies(model);
  const int first = static_cast<int>(all.size()) - model.level_count();  // the base, where it is no level
  for (int i = 0; i < static_cast<int>(all.size()); ++i) {
    const LevelTopology& t = all[static_cast<size_t>(i)];
    std::printf("%-7s %9d %10d %9d %6d %9s %9s %s\n", i < first ? "base" : std::to_string(i - first).c_str(),
                t.vertices, t.triangles, t.boundary_edges, t.euler, t.manifold ? "yes" : "NO",
                t.oriented ? "yes" : "NO",
                !t.has_mirror          ? "none"
                : t.mirror_errors == 0 ? "exact"
                                       : (std::to_string(t.mirror_errors) + " errors").c_str());
  }
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

void print_companions(const MorphableModel& model) {
  const int n = static_cast<int>(model.landmarks().size());
  const int off = static_cast<int>(model.levels().front().landmark_points.size());
  std::printf("landmarks: %d, %d of them at vertices\n", n, n - off);
  std::printf("texture coordinates: %s, parents: %d\n", model.uv().rows() > 0 ? "yes" : "no",
              static_cast<int>(model.parents().size()));
  if (!model.regions().empty()) std::printf("%-16s", "region");
  for (int l = 0; l < model.level_count() && !model.regions().empty(); ++l)
    std::printf(" %8d%s", model.vertex_count(l), l + 1 == model.level_count() ? "\n" : "");
  for (const auto& [name, finest] : model.regions()) {
    std::printf("%-16s", name.c_str());
    for (int l = 0; l < model.level_count(); ++l) {
      const int count = model.vertex_count(l);
      std::printf(" %8d",
                  static_cast<int>(std::count_if(finest.begin(), finest.end(), [count](int v) { return v < count; })));
    }
    std::printf("\n");
  }
}

void print_provenance(const MorphableModel& model) {
  for (const auto& [key, value] : model.provenance())
    std::printf("provenance %s: %.200s%s\n", key.c_str(), value.c_str(), value.size() > 200 ? " ..." : "");
}

void print_checks(const std::vector<ModelCheck>& checks) {
  for (const ModelCheck& check : checks) {
    std::printf("%-6s %s (%s)\n", check.holds ? "ok" : "FAILED", check.property.c_str(), check.detail.c_str());
  }
}

// One line per file and pair of levels, or one per quantity.
void add_export_checks(const ExportNesting& e, bool each, std::vector<ModelCheck>& checks) {
  for (size_t i = 0; i < e.rows.size();) {
    std::vector<NestingRow> pair, exact;
    for (const int coarse = e.rows[i].coarse; i < e.rows.size() && e.rows[i].coarse == coarse; ++i) {
      pair.push_back(e.rows[i]);
      if (pair.back().tolerance == 0) exact.push_back(pair.back());
    }
    const std::string which = e.file + " " + std::to_string(pair[0].coarse) + " in " + std::to_string(pair[0].fine);
    if (each || !all_hold(pair)) {
      for (const NestingRow& row : pair) {
        checks.push_back(nesting_check(row));
        checks.back().property = e.file + " " + checks.back().property;
      }
      continue;
    }
    std::ostringstream detail;
    detail << "maximum deviation " << largest_deviation(pair) << " over ";
    for (size_t k = 0; k < exact.size(); ++k) detail << (k ? ", " : "") << exact[k].quantity;
    for (const NestingRow& row : pair)
      if (row.tolerance > 0) detail << "; " << row.quantity << " " << row.deviation << " " << row.unit;
    checks.push_back({which, true, detail.str()});
  }
}

// Vertices of the levels; read without the whole, which is refused where levels do not nest.
std::vector<int> counts_in(const std::string& file) {
  const std::vector<int> counts = stored_levels(file);
  return counts.empty() ? level_counts(load_model(file)) : counts;
}

void print_blendshapes(const MorphableModel& model) {
  if (model.blendshapes().empty()) return;
  std::cout << "blendshapes:";
  for (const Blendshape& b : model.blendshapes())
    std::cout << (&b == &model.blendshapes().front() ? " " : ", ") << b.name;
  std::cout << "\n";
}

void print_tables(const MorphableModel& model) {
  print_levels(model);
  print_modes("shape", model.shape());
  print_modes("colour", model.colour());
  if (model.expression()) print_modes("expression", *model.expression());
  print_blendshapes(model);
  print_companions(model);
  print_provenance(model);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Shows what is in a model file, and proves its properties.", "model-info");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::none, "model-info model.h5 --check");
  std::string input, exports;
  bool check = false;
  app.add_option("model", input, "Model (.h5)")->required()->check(CLI::ExistingFile);
  app.add_flag("--check", check, "Prove nesting of the levels, orthonormality, order; exit code 1 if anything fails");
  app.add_option("--exports", exports,
                 "With --check: also read the files of a build's levels/ and export/ back and prove their nesting")
      ->check(CLI::ExistingDirectory);
  return run_program(argc, argv, app, common, [&] {
    if (!exports.empty() && !check) throw InvalidInput("--exports needs --check");
    try_model_file(input);
    std::vector<ModelCheck> checks;
    if (check) checks = check_model_file(input);
    if (!exports.empty())
      for (const ExportNesting& e : exported_nesting(exports, counts_in(input)))
        add_export_checks(e, common.verbose, checks);
    const bool all = std::all_of(checks.begin(), checks.end(), [](const ModelCheck& c) { return c.holds; });
    if (!all) print_checks(checks);  // before the tables, which a file that cannot be loaded has none of
    print_tables(load_model(input));
    if (all) print_checks(checks);
    return all ? ExitCode::ok : ExitCode::failed;
  });
}
