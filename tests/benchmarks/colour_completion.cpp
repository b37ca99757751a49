// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// How near filled colours come to the truth: of the registered scans of a build, a share of the seen vertices is
// hidden, completed, and compared with what was hidden. Usage: colour_completion BUILD [SHARE] [SEED] [PICTURES]
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/building/fill_unseen.h"
#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

struct ColouredFaces {
  Mesh surface;
  SampleMatrix colours, visibility;
};

ColouredFaces read_build(const fs::path& build) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(build / "registered"))
    if (entry.path().extension() == ".ply") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  ColouredFaces set;
  for (size_t i = 0; i < files.size(); ++i) {
    const Mesh mesh = read_mesh(files[i]);
    const auto s = static_cast<Eigen::Index>(i);
    if (i == 0) {
      set.surface = mesh;
      set.colours.resize(static_cast<Eigen::Index>(files.size()), 3 * mesh.V.rows());
      set.visibility = SampleMatrix::Zero(set.colours.rows(), mesh.V.rows());
    }
    set.colours.row(s) = Eigen::Map<const Eigen::RowVectorXd>(mesh.colours.data(), mesh.colours.size());
    const std::string digits = read_file(build / "scans" / (files[i].stem().string() + ".colour"));
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v)
      set.visibility(s, v) = digits[static_cast<size_t>(v)] >= '5' ? 1 : 0;
  }
  return set;
}

// 1 where a seen vertex is hidden: patches of 8 to 22 mm about random vertices, or scattered vertices.
SampleMatrix hide(const ColouredFaces& set, double share, bool patches, std::uint64_t seed) {
  SampleMatrix hidden = SampleMatrix::Zero(set.visibility.rows(), set.visibility.cols());
  const Vertices& V = set.surface.V;
  for (Eigen::Index s = 0; s < hidden.rows(); ++s) {
    Random random = Random::stream(seed, static_cast<std::uint64_t>(s));
    while (hidden.row(s).sum() < share * set.visibility.row(s).sum()) {
      const int centre = random.index(static_cast<int>(V.rows()));
      const double radius = patches ? random.uniform(8, 22) : 0;
      for (int v = patches ? 0 : centre; v < (patches ? V.rows() : centre + 1); ++v)
        if (set.visibility(s, v) > 0 && (V.row(v) - V.row(centre)).norm() <= radius) hidden(s, v) = 1;
    }
  }
  return hidden;
}

double rms(const SampleMatrix& a, const SampleMatrix& b, const SampleMatrix& where) {
  double sum = 0;
  for (Eigen::Index s = 0; s < a.rows(); ++s)
    for (Eigen::Index v = 0; v < where.cols(); ++v)
      if (where(s, v) > 0) sum += (a.row(s) - b.row(s)).segment<3>(3 * v).squaredNorm();
  return std::sqrt(sum / (3 * where.sum()));
}

SampleMatrix mean_fill(const ColouredFaces& set, const SampleMatrix& weights) {
  SampleMatrix filled = set.colours;
  for (Eigen::Index v = 0; v < weights.cols(); ++v) {
    const double sum = weights.col(v).sum();
    const Eigen::RowVector3d mean = weights.col(v).transpose() * set.colours.middleCols<3>(3 * v) / std::max(sum, 1.0);
    for (Eigen::Index s = 0; s < weights.rows(); ++s)
      if (weights(s, v) <= 0) filled.row(s).segment<3>(3 * v) = mean;
  }
  return filled;
}

void write_pictures(const fs::path& folder, const ColouredFaces& set, const SampleMatrix& colours,
                    const std::string& name) {
  Mesh mesh = set.surface;
  for (const Eigen::Index s : {Eigen::Index(0), set.colours.rows() / 2}) {
    mesh.colours = Eigen::Map<const Vertices>(colours.row(s).data(), mesh.V.rows(), 3);
    mesh.colours = mesh.colours.cwiseMax(0).cwiseMin(1);
    write_ply(folder / (name + std::to_string(s) + ".ply"), mesh);
  }
}

void measure(const ColouredFaces& set, double share, bool patches, std::uint64_t seed, const fs::path& pictures) {
  const SampleMatrix hidden = hide(set, share, patches, seed), weights = set.visibility - hidden;
  SampleMatrix blotted = set.colours;  // what is hidden must not be used
  for (Eigen::Index s = 0; s < hidden.rows(); ++s)
    for (Eigen::Index v = 0; v < hidden.cols(); ++v)
      if (hidden(s, v) > 0) blotted.row(s).segment<3>(3 * v).setConstant(1);
  const double mean = rms(mean_fill(set, weights), set.colours, hidden);
  std::printf("%s hidden, %.1f %% of the seen\n  mean fill                rms %.4f\n",
              patches ? "patches" : "scattered vertices", 100 * hidden.sum() / set.visibility.sum(), mean);
  for (const double length : {0.0, 16.0}) {
    FillUnseenOptions options;
    options.correlation_length = length;
    const auto started = std::chrono::steady_clock::now();
    const FillUnseenResult filled = fill_unseen(blotted, weights, set.surface.V, set.surface.F, options);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    const FillUnseenSummary& s = filled.summary;
    const double error = rms(filled.values, set.colours, hidden);
    std::printf(
        "  %-24s rms %.4f, %.2f times nearer; %d modes, noise %.4f, edge correlation %.2f, uncertain %.4f,\n"
        "                           own estimate %.4f against %.4f of the mean, %d iterations%s, %.1f s\n",
        length > 0 ? "modes and neighbours" : "modes", error, mean / error, s.modes, s.noise, s.edge_correlation,
        s.uncertain_share, s.held_out.filled, s.held_out.mean, s.iterations, s.converged ? "" : " (not converged)",
        seconds);
    if (!pictures.empty() && length > 0) write_pictures(pictures, set, filled.values, patches ? "patches" : "points");
  }
  if (!pictures.empty()) write_pictures(pictures, set, blotted, patches ? "patches_hidden" : "points_hidden");
}

}  // namespace
}  // namespace facewright

int main(int argc, char** argv) {
  using namespace facewright;
  if (argc < 2) {
    std::fprintf(stderr, "usage: colour_completion BUILD [SHARE] [SEED] [PICTURES]\n");
    return 2;
  }
  const ColouredFaces set = read_build(argv[1]);
  const double share = argc > 2 ? std::stod(argv[2]) : 0.1;
  const std::uint64_t seed = argc > 3 ? std::stoull(argv[3]) : 1;
  const std::filesystem::path pictures = argc > 4 ? argv[4] : "";
  std::printf("%ld scans, %ld vertices, seen %.1f %%\n", static_cast<long>(set.colours.rows()),
              static_cast<long>(set.visibility.cols()), 100 * set.visibility.mean());
  if (!pictures.empty()) write_pictures(pictures, set, set.colours, "truth");
  for (const bool patches : {true, false}) measure(set, share, patches, seed, pictures);
  return 0;
}
