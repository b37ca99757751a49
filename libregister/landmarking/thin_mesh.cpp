// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/thin_mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"

namespace facewright {
namespace {

struct Cells {
  std::vector<int> of_vertex;
  int count = 0;
};

Cells cells_of(const Vertices& V, double cell) {
  const Eigen::RowVector3d low = V.colwise().minCoeff();
  std::unordered_map<std::uint64_t, int> known;
  known.reserve(static_cast<size_t>(V.rows()) / 4);
  Cells cells;
  cells.of_vertex.reserve(static_cast<size_t>(V.rows()));
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k) {
      const double place = std::floor((V(i, k) - low[k]) / cell);
      key = key << 21 | static_cast<std::uint64_t>(std::min(place, 2097151.0));
    }
    const auto [it, is_new] = known.try_emplace(key, cells.count);
    if (is_new) ++cells.count;
    cells.of_vertex.push_back(it->second);
  }
  return cells;
}

Vertices means(const Vertices& rows, const Cells& cells) {
  Vertices sum = Vertices::Zero(cells.count, 3);
  Eigen::VectorXd n = Eigen::VectorXd::Zero(cells.count);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const int c = cells.of_vertex[static_cast<size_t>(i)];
    sum.row(c) += rows.row(i);
    n[c] += 1;
  }
  return n.cwiseInverse().asDiagonal() * sum;
}

// One of a triangle's rotations begins with its lowest vertex: equal triangles are equal then.
std::array<int, 3> rotated(std::array<int, 3> t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

// Sides of triangles, from one vertex to another, in an open table: four times as fast as nodes on the heap.
class SideSet {
 public:
  explicit SideSet(size_t most) : slots_(std::bit_ceil(2 * most + 2), 0) {}
  static std::uint64_t key(int from, int to) {
    return static_cast<std::uint64_t>(from) << 32 | static_cast<std::uint32_t>(to);
  }
  bool contains(std::uint64_t side) const { return slots_[place(side)] == side; }
  void insert(std::uint64_t side) { slots_[place(side)] = side; }

 private:
  // Where the side is or would be; zero, a vertex's way to itself, marks what is free.
  size_t place(std::uint64_t side) const {
    const size_t mask = slots_.size() - 1;
    size_t at = static_cast<size_t>((side * 0x9E3779B97F4A7C15u) >> 20) & mask;
    while (slots_[at] != 0 && slots_[at] != side) at = (at + 1) & mask;
    return at;
  }
  std::vector<std::uint64_t> slots_;
};

}  // namespace

Mesh thin_mesh(const Mesh& mesh, double cell) {
  if (!(cell > 0)) throw InvalidInput("thin_mesh: the cells' edge must be positive");
  const Cells cells = cells_of(mesh.V, cell);
  Mesh thin;
  thin.V = means(mesh.V, cells);
  if (mesh.has_colours()) thin.colours = means(mesh.colours, cells);
  struct Entry {
    std::array<int, 3> corners;
    int order;
  };
  std::vector<Entry> found;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const auto c = [&](int k) { return cells.of_vertex[static_cast<size_t>(mesh.F(f, k))]; };
    if (c(0) != c(1) && c(1) != c(2) && c(2) != c(0))
      found.push_back({rotated({c(0), c(1), c(2)}), static_cast<int>(found.size())});
  }
  std::sort(found.begin(), found.end(), [](const Entry& a, const Entry& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.order < b.order;
  });
  found.erase(
      std::unique(found.begin(), found.end(), [](const Entry& a, const Entry& b) { return a.corners == b.corners; }),
      found.end());
  std::sort(found.begin(), found.end(), [](const Entry& a, const Entry& b) { return a.order < b.order; });
  // Sheets that were drawn together may share edges: a triangle that runs an edge the way another does goes.
  SideSet taken(3 * found.size());
  std::erase_if(found, [&](const Entry& e) {
    std::array<std::uint64_t, 3> sides{};
    for (size_t k = 0; k < 3; ++k) sides[k] = SideSet::key(e.corners[k], e.corners[(k + 1) % 3]);
    if (std::any_of(sides.begin(), sides.end(), [&](std::uint64_t side) { return taken.contains(side); })) return true;
    for (const std::uint64_t side : sides) taken.insert(side);
    return false;
  });
  thin.F.resize(static_cast<Eigen::Index>(found.size()), 3);
  for (size_t f = 0; f < found.size(); ++f)
    thin.F.row(static_cast<Eigen::Index>(f)) = Eigen::Map<const Eigen::RowVector3i>(found[f].corners.data());
  return thin;
}

Mesh thin_mesh_to(const Mesh& mesh, Eigen::Index triangles) {
  if (mesh.F.rows() <= triangles) return mesh;
  // A surface of area A leaves some 2 A / cell^2 triangles; rough ones leave more.
  const double area = face_areas(mesh.V, mesh.F).sum();
  double cell = std::sqrt(2 * area / static_cast<double>(triangles));
  if (!(cell > 0)) throw InvalidInput("thin_mesh: the mesh has no area");
  Mesh thin = thin_mesh(mesh, cell);
  while (thin.F.rows() > triangles) {
    cell *= 1.02 * std::sqrt(static_cast<double>(thin.F.rows()) / static_cast<double>(triangles));
    thin = thin_mesh(mesh, cell);
  }
  return thin;
}

}  // namespace facewright
