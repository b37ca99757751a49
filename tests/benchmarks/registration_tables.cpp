// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Our registration beside optimal-step non-rigid ICP, on the same scans, at the 3448 vertices of level 1. Writes
// OUT/METHOD/registered/ID.ply for a scorer and prints what it can measure itself.
// usage: registration_tables SCANS OUT [PEOPLE]
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/folds.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/intake/scan.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/nicp.h"
#include "libregister/registration/register_scan.h"

namespace facewright {
namespace {

constexpr int kVertices = 3448;

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Row {
  std::vector<double> surface;  // mm to the denoised scan, of vertices whose nearest place is not at its border
  std::vector<double> folds, seconds;
};

class Comparison {
 public:
  explicit Comparison(std::filesystem::path out)
      : reference_(build_template(default_reference_face(), {kVertices})), out_(std::move(out)) {
    F_ = reference_.levels.back().F;
    edges_ = edges(F_);
  }

  void add(const ScanFiles& files) {
    const Scan scan = load_scan(files);
    double start = cpu_seconds();
    DenoiseResult clean = denoise(scan.mesh);
    const MatchTarget target(std::move(clean.mesh), std::move(clean.reliability));
    const double preparation = cpu_seconds() - start;
    start = cpu_seconds();
    RegisterOptions options;
    options.keep_stages = true;
    const RegistrationResult ours = register_scan(scan.mesh, scan.landmarks, reference_, options);
    keep("ours", scan.id, ours.V, target, cpu_seconds() - start);

    const Landmarks marks = locate(reference_.landmarks, reference_.V, F_);
    const AlignResult aligned = align_landmarks(marks, ours.landmarks);
    std::vector<LandmarkTarget> pulls;
    for (const std::string& name : aligned.used)
      if (reference_.landmarks.at(name).vertex >= 0)
        pulls.push_back({reference_.landmarks.at(name).vertex, ours.landmarks.at(name).position, 1});
    run("nicp from similarity", scan.id, aligned.scan_from_reference.apply(reference_.V), target, pulls, preparation);
    const Vertices& spline = ours.stages.front().mesh.V;  // the base level after the global mapping
    run("nicp from our spline", scan.id, refine_positions(reference_, spline, kVertices), target, pulls, preparation);
    NicpOptions held;  // noisy landmarks that never let go correspond better here than the published schedule
    held.landmark_weights.assign(held.stiffness.size(), 5);
    run("nicp from our spline landmarks held", scan.id, refine_positions(reference_, spline, kVertices), target, pulls,
        preparation, held);
  }

  void print() const {
    std::printf("| method | surface mean / p95, mm | folds mean / worst, %% | CPU per scan, s |\n|---|---|---|---|\n");
    for (const auto& [method, row] : rows_) {
      std::vector<double> d = row.surface;
      std::sort(d.begin(), d.end());
      std::printf("| %s | %.3f / %.3f | %.4f / %.4f | %.2f |\n", method.c_str(), mean(d), d[d.size() * 95 / 100],
                  mean(row.folds), *std::max_element(row.folds.begin(), row.folds.end()), mean(row.seconds));
    }
  }

 private:
  static double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v;
    return sum / static_cast<double>(values.size());
  }

  void run(const std::string& method, const std::string& id, const Vertices& start, const MatchTarget& target,
           const std::vector<LandmarkTarget>& pulls, double preparation, const NicpOptions& options = {}) {
    const double before = cpu_seconds();
    const NicpResult r = nicp(start, F_, target, pulls, options);
    keep(method, id, r.V, target, cpu_seconds() - before + preparation);
    std::fprintf(stderr, "%s %s: %zu solves, matched %d\n", method.c_str(), id.c_str(), r.summary.steps.size(),
                 r.summary.steps.back().matched);
  }

  void keep(const std::string& method, const std::string& id, const Vertices& V, const MatchTarget& target,
            double seconds) {
    Row& row = rows_[method];
    for (Eigen::Index i = 0; i < V.rows(); ++i) {
      const NearestPoint p = target.index().nearest(V.row(i).transpose().eval());
      bool border = false;
      for (int k = 0; k < 3; ++k)
        border = border || target.boundary()[static_cast<size_t>(target.mesh().F(p.where.triangle, k))];
      if (!border) row.surface.push_back(p.distance);
    }
    row.folds.push_back(100.0 * static_cast<double>(folded_edges(V, F_, edges_).size()) /
                        static_cast<double>(edges_.size()));
    row.seconds.push_back(seconds);
    std::string folder = method;
    std::replace(folder.begin(), folder.end(), ' ', '-');
    std::filesystem::create_directories(out_ / folder / "registered");
    write_ply(out_ / folder / "registered" / (id + ".ply"), Mesh{V, F_, {}, {}, {}});
    std::ofstream map(out_ / folder / "registered" / "landmark_vertices.json");
    const char* separator = "{";
    for (const auto& [name, mark] : reference_.landmarks)
      if (mark.vertex >= 0) map << separator << "\"" << name << "\": " << mark.vertex, separator = ", ";
    map << "}\n";
  }

  MultiresTemplate reference_;
  Faces F_;
  std::vector<Edge> edges_;
  std::filesystem::path out_;
  std::map<std::string, Row> rows_;
};

}  // namespace
}  // namespace facewright

int main(int argc, char** argv) {
  using namespace facewright;
  if (argc < 3) {
    std::fprintf(stderr, "usage: registration_tables SCANS OUT [PEOPLE]\n");
    return 2;
  }
  try {
    std::vector<ScanFiles> files = find_scans(argv[1]);
    if (argc > 3) files.resize(std::min(files.size(), static_cast<size_t>(std::stoi(argv[3]))));
    Comparison comparison(argv[2]);
    for (const ScanFiles& f : files) comparison.add(f);
    comparison.print();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "registration_tables: %s\n", e.what());
    return 1;
  }
}
