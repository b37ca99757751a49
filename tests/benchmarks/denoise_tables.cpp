// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// What each denoising method does to surfaces whose truth is known.
//   denoise_tables                         analytic bumps
//   denoise_tables SCAN CLEAN [SCAN CLEAN ...]   scans and their twins without noise: the same vertices and triangles
//   denoise_tables --write METHOD SCAN OUT       the denoised scan, for looking at
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include "libmodel/core/random.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/surface/nearest.h"
#include "libregister/registration/denoise.h"
#include "tests/libregister/registration/denoise_planted.h"

namespace facewright {
namespace {

const std::vector<std::pair<const char*, DenoiseMethod>> kMethods = {{"none", DenoiseMethod::none},
                                                                     {"median", DenoiseMethod::median},
                                                                     {"gauss", DenoiseMethod::gaussian},
                                                                     {"bilateral", DenoiseMethod::bilateral},
                                                                     {"auto", DenoiseMethod::automatic}};

DenoiseResult denoised(const Mesh& scan, DenoiseMethod method, double* seconds) {
  DenoiseOptions options;
  options.method = method;
  const std::clock_t start = std::clock();
  DenoiseResult r = denoise(scan, options);
  *seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return r;
}

struct Scores {
  double rms = 0, mean = 0, p95 = 0;  // mm from the truth, of inner vertices that are no spikes
  double rms_spikes = 0;              // mm from the truth, of the planted spikes
  int planted = 0, found = 0, right = 0;

  double precision() const { return found ? static_cast<double>(right) / found : 1; }
  double recall() const { return planted ? static_cast<double>(right) / planted : 1; }
};

// `distance` (N) from the truth; `spike` and `found` (N) flags.
Scores score(const std::vector<double>& distance, const std::vector<char>& spike, const std::vector<int>& found,
             const std::vector<char>& inner) {
  Scores s;
  std::vector<double> skin;
  double square = 0, square_spikes = 0;
  for (size_t i = 0; i < distance.size(); ++i) {
    s.planted += spike[i];
    if (!inner[i]) continue;
    if (spike[i]) {
      square_spikes += distance[i] * distance[i];
      continue;
    }
    skin.push_back(std::abs(distance[i]));
    s.mean += skin.back(), square += skin.back() * skin.back();
  }
  for (const int i : found) ++s.found, s.right += spike[static_cast<size_t>(i)];
  s.mean /= static_cast<double>(skin.size());
  s.rms = std::sqrt(square / static_cast<double>(skin.size()));
  s.rms_spikes = std::sqrt(square_spikes / std::max(1, s.planted));
  const auto at = skin.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(skin.size()));
  std::nth_element(skin.begin(), at, skin.end());
  s.p95 = *at;
  return s;
}

std::vector<char> inner_vertices(const Mesh& m) {
  const auto border = boundary_vertices(m.V.rows(), m.F);
  std::vector<char> inner(border.size());
  for (size_t i = 0; i < inner.size(); ++i) inner[i] = !border[i];
  return inner;
}

void table_of_bumps() {
  constexpr double kSpacing = 1.3;
  const Mesh clean = planted_surface(kSpacing, 1);
  const std::vector<char> inner = inner_vertices(clean), no_spikes(inner.size(), 0);
  std::printf("Analytic bumps, %d vertices: RMS out / in, and share of a bump's height lost\n",
              static_cast<int>(clean.V.rows()));
  std::printf("| noise mm | method | estimate mm | RMS mm | out / in | 3 mm bump | 6 mm | 12 mm | CPU s |\n");
  for (const double sigma : {0.0, 0.1, 0.3, 0.6}) {
    Mesh scan = clean;
    plant_noise(scan, sigma, 2);
    double before = 0;
    for (const auto& [name, method] : kMethods) {
      double seconds = 0;
      const DenoiseResult r = denoised(scan, method, &seconds);
      std::vector<double> distance(inner.size());
      for (size_t i = 0; i < inner.size(); ++i)
        distance[i] = planted_distance(r.mesh.V.row(static_cast<Eigen::Index>(i)));
      const double rms = score(distance, no_spikes, r.spikes, inner).rms;
      if (method == DenoiseMethod::none) before = rms;
      std::printf("| %.1f | %s | %.3f | %.3f | %.2f | %.1f %% | %.1f %% | %.1f %% | %.3f |\n", sigma, name,
                  r.summary.noise, rms, before > 1e-9 ? rms / before : 1, 100 * mean_bump_loss(r.mesh.V, 3),
                  100 * mean_bump_loss(r.mesh.V, 6), 100 * mean_bump_loss(r.mesh.V, 12), seconds);
    }
  }
}

void table_of_spikes() {
  std::printf("\nSpikes of 4 to 20 mm on the bumps, noise 0.15 and 0.3 mm\n");
  std::printf("| noise mm | single | clusters | planted | precision | recall | mended to mm RMS |\n");
  const Mesh clean = planted_surface(1.3, 1);
  const std::vector<char> inner = inner_vertices(clean);
  for (const double sigma : {0.15, 0.3})
    for (const auto& [share, clusters] : {std::pair(0.001, 0), {0.005, 0}, {0.02, 0}, {0.0, 30}, {0.005, 60}}) {
      Mesh scan = clean;
      plant_noise(scan, sigma, 2);
      const std::vector<char> spike = plant_spikes(scan, share, clusters, 3);
      double seconds = 0;
      const DenoiseResult r = denoised(scan, DenoiseMethod::automatic, &seconds);
      std::vector<double> distance(inner.size());
      for (size_t i = 0; i < inner.size(); ++i)
        distance[i] = planted_distance(r.mesh.V.row(static_cast<Eigen::Index>(i)));
      const Scores s = score(distance, spike, r.spikes, inner);
      std::printf("| %.2f | %.3f | %d | %d | %.3f | %.3f | %.2f |\n", sigma, share, clusters, s.planted, s.precision(),
                  s.recall(), s.rms_spikes);
    }
}

void table_of_scans(int count, char** files) {
  std::printf(
      "| method | noise mm | mean mm | RMS mm | p95 mm | spikes | precision | recall | mended to mm RMS | CPU s |\n");
  for (const auto& [name, method] : kMethods) {
    Scores sum;
    double noise = 0, total = 0;
    for (int k = 0; k + 1 < count; k += 2) {
      const Mesh scan = read_mesh(files[k]), clean = read_mesh(files[k + 1]);
      if (scan.V.rows() != clean.V.rows()) {
        std::fprintf(stderr, "denoise_tables: %s and %s differ in vertices\n", files[k], files[k + 1]);
        std::exit(1);
      }
      std::vector<char> spike(static_cast<size_t>(scan.V.rows()));
      for (Eigen::Index i = 0; i < scan.V.rows(); ++i)
        spike[static_cast<size_t>(i)] = (scan.V.row(i) - clean.V.row(i)).norm() > 3;
      double seconds = 0;
      const DenoiseResult r = denoised(scan, method, &seconds);
      const std::vector<NearestPoint> nearest = SurfaceIndex(clean.V, clean.F).nearest(r.mesh.V);
      std::vector<double> distance(nearest.size());
      for (size_t i = 0; i < nearest.size(); ++i) distance[i] = nearest[i].distance;
      const Scores s = score(distance, spike, r.spikes, inner_vertices(scan));
      noise += r.summary.noise, total += seconds;
      sum.mean += s.mean, sum.rms += s.rms, sum.p95 += s.p95, sum.rms_spikes += s.rms_spikes;
      sum.planted += s.planted, sum.found += s.found, sum.right += s.right;
    }
    const double n = count / 2;
    std::printf("| %s | %.3f | %.4f | %.4f | %.4f | %d | %.3f | %.3f | %.2f | %.3f |\n", name, noise / n, sum.mean / n,
                sum.rms / n, sum.p95 / n, sum.planted, sum.precision(), sum.recall(), sum.rms_spikes / n, total / n);
  }
}

int write_denoised(const char* method, const char* scan, const char* out) {
  for (const auto& [name, m] : kMethods)
    if (std::strcmp(name, method) == 0) {
      double seconds = 0;
      write_ply(out, denoised(read_mesh(scan), m, &seconds).mesh);
      return 0;
    }
  std::fprintf(stderr, "denoise_tables: no method is called %s\n", method);
  return 1;
}

}  // namespace
}  // namespace facewright

int main(int argc, char** argv) {
  using namespace facewright;
  if (argc == 5 && std::strcmp(argv[1], "--write") == 0) return write_denoised(argv[2], argv[3], argv[4]);
  if (argc > 2) {
    table_of_scans(argc - 1, argv + 1);
  } else {
    table_of_bumps();
    table_of_spikes();
  }
  return 0;
}
