// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/subdivision/deviation.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

using Triple = std::array<int, 3>;  // apex, then the base, counter-clockwise

Vertices vertex_normals_of(const Vertices& V, const Faces& F) {
  Vertices N = Vertices::Zero(V.rows(), 3);
  for (int f = 0; f < F.rows(); ++f) {
    const Eigen::RowVector3d a = V.row(F(f, 1)) - V.row(F(f, 0)), b = V.row(F(f, 2)) - V.row(F(f, 0));
    for (int k = 0; k < 3; ++k) N.row(F(f, k)) += a.cross(b);
  }
  return N.rowwise().normalized();
}

// Walks down the forest of bisections, from the start's triangles to those of the uniform mesh.
class DeviationMeter {
 public:
  DeviationMeter(DeviationTable& table, const Faces& finest, const std::vector<Vertices>& faces)
      : table_(table), faces_(faces) {
    for (const Vertices& V : faces) normals_.push_back(vertex_normals_of(V, finest));
  }

  // Measures triangle t and everything inside it.
  void measure(const Triple& t) {
    const int m = table_.midpoint(t[1], t[2]);
    if (m < 0) return;
    inside_.clear();
    collect(t, Eigen::Matrix3d::Identity());
    for (const Corner& c : inside_)
      table_.deviations[static_cast<size_t>(m - table_.start_count)] += c.area * squared_distance(t, c);
    measure({m, t[0], t[1]});
    measure({m, t[2], t[0]});
  }

 private:
  struct Corner {
    int vertex;
    Eigen::Vector3d weights;  // of the corners of the triangle that is measured
    double area;              // mm^2 that stand for it
  };

  // The corners of the finest triangles inside t, its own excepted; rows of W are the weights of t's corners.
  void collect(const Triple& t, const Eigen::Matrix3d& W) {
    const int m = table_.midpoint(t[1], t[2]);
    if (m < 0) {
      for (int k = 0; k < 3; ++k)
        if (W.row(k).maxCoeff() < 1) inside_.push_back({t[static_cast<size_t>(k)], W.row(k), mean_area(t) / 3});
      return;
    }
    const Eigen::RowVector3d middle = 0.5 * (W.row(1) + W.row(2));
    Eigen::Matrix3d left, right;
    left << middle, W.row(0), W.row(1);
    right << middle, W.row(2), W.row(0);
    collect({m, t[0], t[1]}, left);
    collect({m, t[2], t[0]}, right);
  }

  double mean_area(const Triple& t) const {
    double sum = 0;
    for (const Vertices& V : faces_) {
      const Eigen::RowVector3d a = V.row(t[1]) - V.row(t[0]), b = V.row(t[2]) - V.row(t[0]);
      sum += 0.5 * a.cross(b).norm();
    }
    return sum / static_cast<double>(faces_.size());
  }

  double squared_distance(const Triple& t, const Corner& c) const {
    double sum = 0;
    for (size_t s = 0; s < faces_.size(); ++s) {
      const Vertices& V = faces_[s];
      const Eigen::RowVector3d d =
          V.row(c.vertex) - c.weights[0] * V.row(t[0]) - c.weights[1] * V.row(t[1]) - c.weights[2] * V.row(t[2]);
      const double h = d.dot(normals_[s].row(c.vertex));
      sum += h * h;
    }
    return sum / static_cast<double>(faces_.size());
  }

  DeviationTable& table_;
  const std::vector<Vertices>& faces_;
  std::vector<Vertices> normals_;
  std::vector<Corner> inside_;
};

void make_symmetric(const std::vector<int>& mirror, DeviationTable* table) {
  if (mirror.empty()) return;
  for (size_t i = 0; i < table->deviations.size(); ++i) {
    const auto j = static_cast<size_t>(mirror[static_cast<size_t>(table->start_count) + i] - table->start_count);
    if (j > i) table->deviations[i] = table->deviations[j] = 0.5 * (table->deviations[i] + table->deviations[j]);
  }
}

// Vertex numbers of an adaptive mesh become those of the uniform one through their parents; -1 where it is finer.
int uniform_vertex(const DeviationTable& table, const FourEightMesh& mesh, int v) {
  if (v < table.start_count) return v;
  const VertexParents& p = mesh.parents()[static_cast<size_t>(v - mesh.base_count())];
  const int a = uniform_vertex(table, mesh, p.a);
  const int b = a < 0 ? -1 : uniform_vertex(table, mesh, p.b);
  return b < 0 ? -1 : table.midpoint(a, b);
}

}  // namespace

int DeviationTable::midpoint(int a, int b) const {
  if (a > b) std::swap(a, b);
  if (a < 0 || a >= static_cast<int>(middles.size())) return -1;
  for (const auto& [end, m] : middles[static_cast<size_t>(a)])
    if (end == b) return m;
  return -1;
}

DeviationTable measure_deviation(const FourEightMesh& start, const std::vector<Vertices>& faces) {
  if (faces.empty()) throw InvalidInput("deviation: no faces");
  const auto wanted = static_cast<int>(faces.front().rows());
  for (const Vertices& V : faces)
    if (V.rows() != wanted) throw InvalidInput("deviation: the faces differ in their number of vertices");
  FourEightMesh uniform = start;
  while (uniform.vertex_count() < wanted) uniform.uniform_step();
  if (uniform.vertex_count() != wanted)
    throw InvalidInput("deviation: no number of uniform steps gives " + std::to_string(wanted) + " vertices");
  DeviationTable table;
  table.start_count = start.vertex_count();
  table.parents.assign(uniform.parents().begin() + static_cast<std::ptrdiff_t>(start.parents().size()),
                       uniform.parents().end());
  table.deviations.resize(table.parents.size());
  table.middles.resize(static_cast<size_t>(wanted));
  for (size_t i = 0; i < table.parents.size(); ++i)
    table.middles[static_cast<size_t>(table.parents[i].a)].emplace_back(table.parents[i].b,
                                                                        table.start_count + static_cast<int>(i));
  const Faces F = start.faces();
  DeviationMeter meter(table, uniform.faces(), faces);
  for (int t = 0; t < F.rows(); ++t) meter.measure({F(t, 0), F(t, 1), F(t, 2)});
  make_symmetric(uniform.mirror(), &table);
  return table;
}

RefinementCriterion deviation_criterion(DeviationTable table, const DeviationCriterionOptions& options) {
  if (!(options.length_weight >= 0)) throw InvalidInput("deviation: the length weight must not be negative");
  const auto shared = std::make_shared<const DeviationTable>(std::move(table));
  return [shared, weight = options.length_weight](const FourEightMesh& mesh, int t) {
    const BaseEdge e = mesh.base_edge(t);
    const int a = uniform_vertex(*shared, mesh, e.a), b = a < 0 ? -1 : uniform_vertex(*shared, mesh, e.b);
    const int m = b < 0 ? -1 : shared->midpoint(a, b);
    const double assumed = weight * e.length * e.length;
    return assumed * assumed * mesh.base_area(t) +
           (m < 0 ? 0 : shared->deviations[static_cast<size_t>(m - shared->start_count)]);
  };
}

Vertices on_hierarchy(const DeviationTable& table, const Vertices& face, const MultiresTemplate& hierarchy) {
  const int count = static_cast<int>(hierarchy.V.rows());
  if (count < table.start_count || face.rows() != static_cast<Eigen::Index>(table.middles.size()))
    throw InvalidInput("deviation: a hierarchy of " + std::to_string(count) + " vertices and a face of " +
                       std::to_string(face.rows()) + " for a uniform mesh of " + std::to_string(table.middles.size()));
  Vertices V(count, 3);
  V.topRows(table.start_count) = face.topRows(table.start_count);
  std::vector<int> uniform(static_cast<size_t>(count), -1);  // the same vertex of the uniform mesh
  for (int v = 0; v < table.start_count; ++v) uniform[static_cast<size_t>(v)] = v;
  for (int v = table.start_count; v < count; ++v) {
    const VertexParents& p = hierarchy.parents[static_cast<size_t>(v - hierarchy.base_count())];
    const int m = table.midpoint(uniform[static_cast<size_t>(p.a)], uniform[static_cast<size_t>(p.b)]);
    uniform[static_cast<size_t>(v)] = m;
    V.row(v) = m >= 0 ? Eigen::RowVector3d(face.row(m)) : Eigen::RowVector3d(0.5 * (V.row(p.a) + V.row(p.b)));
  }
  return V;
}

}  // namespace facewright
