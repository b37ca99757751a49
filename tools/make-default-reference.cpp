// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.

// Designs the built-in reference face on the synthetic mean head and writes the data file that the library embeds:
//   make-default-reference -o libregister/reference/data/face845.txt
#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/synthetic/mean_head.h"
#include "libregister/reference/reference_face.h"
#include "tools/cli.h"
#include "tools/default_reference/half_face_mesher.h"
#include "tools/default_reference/half_face_relaxation.h"

namespace {

using namespace facewright;
using namespace facewright::face_design;

constexpr int wanted_vertices = 845;

// Both halves; a midline vertex once, any other and its mirror image next to each other.
struct WholeFace {
  Vertices V;
  Faces F;
  std::vector<int> left, right;  // of every point of the half
};

double rounded(double x) { return std::round(x * 1e4) / 1e4; }

WholeFace mirror_half(const HalfFaceMesh& half) {
  WholeFace w;
  std::vector<Vector3d> all;
  for (size_t i = 0; i < half.points.size(); ++i) {
    const Vector3d p = half.points[i].unaryExpr(&rounded);
    w.left.push_back(static_cast<int>(all.size()));
    all.push_back(p);
    if (half.midline[i]) {
      w.right.push_back(w.left.back());
      continue;
    }
    w.right.push_back(static_cast<int>(all.size()));
    all.emplace_back(-p.x(), p.y(), p.z());
  }
  w.V.resize(static_cast<Eigen::Index>(all.size()), 3);
  for (size_t i = 0; i < all.size(); ++i) w.V.row(static_cast<Eigen::Index>(i)) = all[i];
  w.F.resize(static_cast<Eigen::Index>(2 * half.triangles.size()), 3);
  for (size_t t = 0; t < half.triangles.size(); ++t) {
    const auto [a, b, c] = half.triangles[t];
    const auto row = static_cast<Eigen::Index>(2 * t);
    w.F.row(row) << w.left[a], w.left[b], w.left[c];
    w.F.row(row + 1) << w.right[a], w.right[c], w.right[b];
  }
  return w;
}

using Regions = std::map<std::string, std::set<int>>;

void add_polygon_region(Regions& regions, const std::string& name, const HalfFaceMesh& half, const WholeFace& w,
                        const std::vector<int>& polygon) {
  std::vector<Vector2d> q;
  for (const int v : polygon) q.push_back(chart(half.points[v]));
  std::set<int> members(polygon.begin(), polygon.end());
  for (size_t i = 0; i < half.points.size(); ++i)
    if (inside(chart(half.points[i]), q)) members.insert(static_cast<int>(i));
  for (const int i : members) {
    regions[name].insert(w.left[i]);
    regions[mirrored_landmark(name)].insert(w.right[i]);
  }
}

bool on_nose(const Vector3d& p, const Landmarks& marks) {
  const Vector3d top = marks.at("28").position, base = marks.at("34").position,
                 wing = marks.at("left_alar_curvature").position;
  if (p.y() > top.y() || p.y() < base.y() - 0.5 || p.z() < wing.z() - 2) return false;
  const double t = std::clamp((top.y() - p.y()) / (top.y() - wing.y()), 0.0, 1.0);
  return p.x() <= 8 + t * t * (wing.x() - 8) + 0.1;
}

Regions find_regions(const HalfFaceDesign& design, const HalfFaceMesh& half, const WholeFace& w,
                     const Landmarks& marks) {
  Regions regions;
  for (const auto& [name, polygon] : design.polygons) add_polygon_region(regions, name, half, w, polygon);
  for (size_t i = 0; i < half.points.size(); ++i) {
    const auto add = [&](const std::string& name) { regions[name].insert({w.left[i], w.right[i]}); };
    if (on_nostril_sheet(half.points[i])) add("nostrils");
    if (on_nose(half.points[i], marks)) add("nose");
  }
  for (const int i : design.brow) {
    regions["left_brow"].insert(w.left[i]);
    regions["right_brow"].insert(w.right[i]);
  }
  const auto loops = boundary_loops(w.F);
  regions["rim"].insert(loops.at(0).begin(), loops.at(0).end());
  regions["mouth_slit"].insert(loops.at(1).begin(), loops.at(1).end());
  return regions;
}

ReferenceFace to_reference(const WholeFace& w, const HalfFaceDesign& design, const Regions& regions) {
  ReferenceFace face;
  face.mesh.V = w.V;
  face.mesh.F = w.F;
  for (const auto& [name, v] : design.landmarks) {
    face.landmarks[name] = mark_vertex(w.F, w.left[v]);
    if (!design.midline[v]) face.landmarks[mirrored_landmark(name)] = mark_vertex(w.F, w.right[v]);
  }
  for (const auto& [name, vertices] : regions) face.regions[name].assign(vertices.begin(), vertices.end());
  return face;
}

// Two uniform 4-8 steps give 3448 vertices if 148 triangles stay single: the nearer the greedy pairing comes to that,
// the fewer triangles must be paired against their shape. Thin triangles count as well; less is better.
double cost(const WholeFace& face, const std::vector<int>& mirror) {
  constexpr double thin = 0.7;
  double sum = std::abs(pair_triangles(face.V, face.F, mirror).singles - 148);
  for (int f = 0; f < face.F.rows(); ++f) {
    const double q = triangle_quality(face.V.row(face.F(f, 0)), face.V.row(face.F(f, 1)), face.V.row(face.F(f, 2)));
    if (q < thin) sum += 4 * (thin - q) / thin;
  }
  return sum;
}

int run(const std::string& output, int tries) {
  const Landmarks marks = mean_head_landmarks();
  const HalfFaceDesign design = design_half_face(marks);
  const auto midline = static_cast<int>(std::count(design.midline.begin(), design.midline.end(), true));
  const int half_points = (wanted_vertices - midline) / 2 + midline;
  ReferenceFace best;
  double least = 1e9;
  for (int seed = 1; seed <= tries; ++seed) {
    const auto wanted = [&](const Vector3d& p) { return wanted_length(p, marks); };
    const HalfFaceMesh half = mesh_half_face(design, half_points, wanted, static_cast<std::uint64_t>(seed));
    const WholeFace face = mirror_half(half);
    ReferenceFace reference = to_reference(face, design, find_regions(design, half, face, marks));
    reference.mirror = find_mirror(reference.mesh);
    if (reference.mirror.empty()) throw InvalidInput("the reference face is not symmetric");
    const double c = cost(face, reference.mirror);
    std::cout << "seed " << seed << ": cost " << c << '\n';
    if (c < least) least = c, best = std::move(reference);
  }
  write_file(output, "# The built-in reference face, written by make-default-reference.\n" + format_reference(best));
  std::cout << best.mesh.V.rows() << " vertices (" << midline << " on the midline, " << design.points.size() << " of "
            << half_points << " given per half), " << best.mesh.F.rows() << " triangles, "
            << boundary_edge_count(best.mesh.F) << " boundary edges\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Designs the built-in reference face on the synthetic mean head.", "make-default-reference");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output,
                     "make-default-reference -o libregister/reference/data/face845.txt");
  int tries = 12;
  app.add_option("--tries", tries, "Seeds to choose the best mesh from")->check(CLI::Range(1, 1000));
  return run_program(argc, argv, app, common, [&] { return run(common.output.string(), tries); });
}
