// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The gathering of many registered scans to a model: plants scans of known modes as registration leaves them in FOLDER
// (some 1.3 MB each, removed afterwards), makes the model within a limit of memory, and says how near its modes are,
// how long it took and how much memory.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <Eigen/QR>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/reference/reference_face.h"
#include "pipelines/scan_stage.h"
#include "pipelines/stored_model.h"

namespace facewright {
namespace {

Eigen::MatrixXd random_basis(Random& random, Eigen::Index rows, Eigen::Index cols) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(
      Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return random.normal(); }));
  return qr.householderQ() * Eigen::MatrixXd::Identity(rows, cols);
}

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void tell(const char* what, double since) {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  std::printf("%-28s %8.1f s   peak %6ld MB\n", what, now() - since, use.ru_maxrss / 1024);
  std::fflush(stdout);
}

// Faces of `modes` smooth enough to be told from noise, each with a patch that nobody saw.
std::vector<std::string> plant(int scans, const MultiresTemplate& reference, const Eigen::MatrixXd& shape_modes,
                               const Eigen::MatrixXd& colour_modes, const OutputTree& tree) {
  std::vector<std::string> ids(static_cast<size_t>(scans));
  const Eigen::Index N = reference.V.rows();
  parallel_for(scans, 0, [&](int i) {
    Random random = Random::stream(3, static_cast<std::uint64_t>(i));
    char id[16];
    std::snprintf(id, sizeof id, "p%06d", i);
    ids[static_cast<size_t>(i)] = id;
    Mesh mesh{reference.V, reference.levels.back().F, {}, {}, {}};
    Eigen::VectorXd shape(shape_modes.cols()), colour(colour_modes.cols());
    for (Eigen::Index k = 0; k < shape.size(); ++k) shape[k] = 700 * std::pow(0.9, k) * random.normal();
    for (Eigen::Index k = 0; k < colour.size(); ++k) colour[k] = 15 * std::pow(0.9, k) * random.normal();
    const Eigen::VectorXd moved = shape_modes * shape, painted = colour_modes * colour;
    mesh.V += Eigen::Map<const Vertices>(moved.data(), N, 3);
    mesh.colours = (Eigen::Map<const Vertices>(painted.data(), N, 3).array() + 0.5).cwiseMax(0).cwiseMin(1);
    std::string origins(static_cast<size_t>(N), 'm'), weights(static_cast<size_t>(N), '9');
    const int first = random.index(static_cast<int>(N) - 1500);
    for (int v = first; v < first + 1500; ++v)
      origins[static_cast<size_t>(v)] = 'i', weights[static_cast<size_t>(v)] = '0';
    write_ply(tree.registered(id), mesh);
    write_file(tree.scan_origins(id), origins);
    write_file(tree.colour_weights(id), weights);
  });
  return ids;
}

int run(int scans, double gigabytes, const std::filesystem::path& folder) {
  const MultiresTemplate reference = default_reference();
  Random random(1);
  const Eigen::MatrixXd shapes = random_basis(random, reference.V.size(), 20),
                        colours = random_basis(random, reference.V.size(), 8);
  const OutputTree tree{folder / "planted"};
  double since = now();
  const std::vector<std::string> ids = plant(scans, reference, shapes, colours, tree);
  tell("planting", since);
  const GatherPlan plan = plan_gathering(scans, reference.V.rows(), gigabytes);
  std::printf("%s, %d scans at hand\n", plan.on_disk ? "through the disk" : "in memory", plan.at_hand);
  since = now();
  BuildModelOptions options;
  const BuildModelResult result = plan.on_disk
                                      ? build_stored_model(ids, reference, options, plan, tree)
                                      : build_model(read_registered_set(ids, reference, tree), reference, options);
  tell("gathering", since);
  const PcaModel& shape = result.model.shape();
  const Eigen::Index leading = std::min<Eigen::Index>(5, shape.mode_count());
  const double nearness = (shapes.transpose() * shape.basis.leftCols(leading)).colwise().norm().minCoeff();
  std::printf(
      "%lld shape and %lld colour modes; of the first %lld shape modes at least %.4f lies in the planted ones\n",
      static_cast<long long>(shape.mode_count()), static_cast<long long>(result.model.colour().mode_count()),
      static_cast<long long>(leading), nearness);
  std::filesystem::remove_all(tree.root);
  return 0;
}

}  // namespace
}  // namespace facewright

int main(int argc, char** argv) {
  CLI::App app("Times the gathering of planted registered scans to a model", "gathering");
  int scans = 500;
  double gigabytes = 0;
  std::filesystem::path folder;
  app.add_option("FOLDER", folder, "Where the planted scans are written")->required();
  app.add_option("--scans", scans)->capture_default_str();
  app.add_option("--memory", gigabytes, "Limit in 10^9 bytes, 0 = none")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return facewright::run(scans, gigabytes, folder);
}
