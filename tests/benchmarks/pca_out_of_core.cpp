// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// PCA of more scans than fit into memory: plants faces of known modes and noise on disk, finds the modes again, and
// says how near, how long and in how much memory. FOLDER must have 4 bytes * 3 * vertices * scans; it is not removed.
#include "libmodel/building/pca_out_of_core.h"

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "libmodel/building/prune.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

struct Size {
  int scans = 2000, vertices = 29587, modes = 60, outliers = 5, folds = 0;
  double noise = 0.02;  // mm, per coordinate
};

struct Planted {
  Eigen::MatrixXd basis, amounts;  // orthonormal modes; what each scan has of them, mm
};

class Stage {
 public:
  explicit Stage(const char* name) : name_(name), wall_(now()), cpu_(cpu()) {}
  ~Stage() {
    rusage use{};
    getrusage(RUSAGE_SELF, &use);
    std::printf("%-34s wall %7.1f s   CPU %7.1f s   peak %5ld MB\n", name_, now() - wall_, cpu() - cpu_,
                use.ru_maxrss / 1024);
    std::fflush(stdout);
  }

 private:
  static double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  static double cpu() {
    rusage use{};
    getrusage(RUSAGE_SELF, &use);
    return static_cast<double>(use.ru_utime.tv_sec + use.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(use.ru_utime.tv_usec + use.ru_stime.tv_usec);
  }
  const char* name_;
  double wall_, cpu_;
};

Eigen::MatrixXd random_basis(Eigen::Index rows, Eigen::Index cols) {
  Random random(1);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(
      Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return random.normal(); }));
  return qr.householderQ() * Eigen::MatrixXd::Identity(rows, cols);
}

Planted plant(const Size& size, SampleStore* store) {
  Planted planted{random_basis(3 * size.vertices, size.modes), Eigen::MatrixXd(size.scans, size.modes)};
  Random random(2);
  for (int i = 0; i < size.scans; ++i)
    for (int k = 0; k < size.modes; ++k)
      planted.amounts(i, k) = (i < size.outliers ? 4 : 1) * 700 * std::pow(0.93, k) * random.normal();
  for (int first = 0; first < size.scans; first += 200) {
    const int count = std::min(200, size.scans - first);
    SampleMatrix faces(count, 3 * size.vertices);
    std::vector<std::string> ids;
    for (int i = 0; i < count; ++i) ids.push_back(std::to_string(first + i));
    parallel_for(count, 0, [&](int i) {
      Random noise = Random::stream(3, static_cast<std::uint64_t>(first + i));
      faces.row(i) = store->origin() + planted.amounts.row(first + i) * planted.basis.transpose();
      const double reach = size.noise * std::sqrt(3.0);
      for (double& value : faces.row(i)) value += noise.uniform(-reach, reach);
    });
    store->append(ids, faces);
  }
  return planted;
}

// Against the modes and variances of what was planted, before noise.
void compare(const PcaResult& fit, const Planted& planted) {
  const Eigen::MatrixXd centred = planted.amounts.rowwise() - planted.amounts.colwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> truth(centred.transpose() * centred /
                                                             static_cast<double>(centred.rows() - 1));
  const Eigen::Index k = fit.model.mode_count();
  const Eigen::VectorXd variances = truth.eigenvalues().reverse().head(k);
  const Eigen::MatrixXd modes = planted.basis * truth.eigenvectors().rowwise().reverse().leftCols(k);
  const Eigen::MatrixXd outside = fit.model.basis - modes * (modes.transpose() * fit.model.basis);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> angles(outside.transpose() * outside);
  const Eigen::MatrixXd gram = fit.model.basis.transpose() * fit.model.basis;
  std::printf(
      "  %d modes, solver %s, %.6f of the variance; largest angle to the planted subspace %.2e rad; variances off by "
      "%.1e at most (relative); max |B'B - I| %.1e\n",
      fit.summary.mode_count, fit.summary.solver == PcaSolver::lanczos ? "lanczos" : "other",
      fit.summary.kept_variance / fit.summary.total_variance,
      std::asin(std::min(1.0, std::sqrt(std::max(0.0, angles.eigenvalues().maxCoeff())))),
      (fit.model.variances.array() / variances.array() - 1).abs().maxCoeff(),
      (gram - Eigen::MatrixXd::Identity(k, k)).cwiseAbs().maxCoeff());
}

void run(const std::filesystem::path& folder, const Size& size) {
  Random random(4);
  const Stage whole("whole");
  SampleStore store = SampleStore::create(
      folder, Eigen::RowVectorXd::NullaryExpr(3 * size.vertices, [&] { return 60 * random.normal(); }));
  Planted planted;
  {
    const Stage stage("planting (not part of the task)");
    planted = plant(size, &store);
  }
  {
    const Stage stage("inner products, from nothing");
    store.gram();
  }
  {
    const Stage stage("PCA, 99 %");
    compare(fit_pca(store), planted);
  }
  PcaResult all;
  {
    const Stage stage("PCA, the planted number of modes");
    PcaOptions options;
    options.variance_share = 1;
    options.max_modes = size.modes;
    all = fit_pca(store, options);
    compare(all, planted);
  }
  {
    const Stage stage("pruning");
    const PruneResult pruned = find_outliers(all.scores, {.quantile = 0.9999});
    int found = 0;
    std::vector<std::string> ids;
    for (const PrunedSample& sample : pruned.removed) {
      found += sample.sample < size.outliers;
      ids.push_back(store.ids()[static_cast<size_t>(sample.sample)]);
    }
    std::printf("  %d of %d planted outliers, %zu others; chi-squared of %d modes above %.1f\n", found, size.outliers,
                pruned.removed.size() - static_cast<size_t>(found), pruned.modes, pruned.threshold);
    store.remove(ids);
  }
  {
    const Stage stage("PCA, 99 %, outliers removed");
    fit_pca(store);
  }
  if (size.folds > 0) {
    const Stage stage("held-out errors");
    const Eigen::MatrixXd errors =
        held_out_squared_errors(store.gram(), {.folds = size.folds, .max_modes = size.modes});
    for (const Eigen::Index m : {Eigen::Index{0}, errors.cols() / 2, errors.cols() - 1})
      std::printf("  %d modes: %.4f mm rms of a vertex\n", static_cast<int>(m),
                  std::sqrt(errors.col(m).mean() / size.vertices));
  }
}

}  // namespace
}  // namespace facewright

int main(int argc, char** argv) {
  CLI::App app("PCA of planted faces on disk");
  facewright::Size size;
  std::string folder;
  app.add_option("folder", folder, "Where the samples go; must not hold any")->required();
  app.add_option("--scans", size.scans);
  app.add_option("--vertices", size.vertices);
  app.add_option("--modes", size.modes);
  app.add_option("--outliers", size.outliers);
  app.add_option("--noise", size.noise, "mm, per coordinate");
  app.add_option("--folds", size.folds, "Of held-out errors; 0 = none");
  CLI11_PARSE(app, argc, argv);
  try {
    facewright::run(folder, size);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
