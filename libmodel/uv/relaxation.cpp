// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/relaxation.h"

#include <Eigen/Geometry>
#include <limits>

#include "libmodel/core/topology.h"

namespace facewright {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLeastGain = 1e-5;  // of the energy, per sweep

// A triangle laid into its own plane: corners (0, 0), (x1, 0), (x2, y2).
struct Flat {
  double x1 = 0, x2 = 0, y2 = 0;
};

Flat lay_flat(const Eigen::Vector3d& e1, const Eigen::Vector3d& e2) {
  const double length = e1.norm();
  return {length, e1.dot(e2) / length, e1.cross(e2).norm() / length};
}

double triangle_energy(const Flat& t, const Eigen::RowVector2d& a, const Eigen::RowVector2d& b,
                       const Eigen::RowVector2d& c) {
  const double area = 0.5 * t.x1 * t.y2;
  if (!(area > 0)) return 0;  // no shape to keep
  const Eigen::RowVector2d u1 = b - a, u2 = c - a;
  const double twice = u1.x() * u2.y() - u1.y() * u2.x();
  if (!(twice > 0)) return kInfinity;
  const Eigen::RowVector2d p = u1 / t.x1, q = (u2 - t.x2 * p) / t.y2;
  const double det = twice / (2 * area), trace = p.squaredNorm() + q.squaredNorm();
  return area * (trace + trace / (det * det));
}

class Relaxation {
 public:
  Relaxation(const Vertices& V, const Faces& F, TexCoords uv, const std::vector<int>& mirror)
      : F_(F), uv_(std::move(uv)), mirror_(mirror), incident_(vertex_faces(V.rows(), F)) {
    for (Eigen::Index f = 0; f < F.rows(); ++f)
      flat_.push_back(lay_flat(V.row(F(f, 1)) - V.row(F(f, 0)), V.row(F(f, 2)) - V.row(F(f, 0))));
  }

  TexCoords run(int sweeps) {
    double before = total();
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      for (int v = 0; v < uv_.rows(); ++v)
        if (partner(v) >= v) improve(v);
      const double now = total();
      if (before - now < kLeastGain * before) break;
      before = now;
    }
    return uv_;
  }

 private:
  int partner(int v) const { return mirror_.empty() ? v : mirror_[static_cast<size_t>(v)]; }
  bool on_midline(int v) const { return !mirror_.empty() && partner(v) == v; }

  double energy_of(Eigen::Index f) const {
    return triangle_energy(flat_[static_cast<size_t>(f)], uv_.row(F_(f, 0)), uv_.row(F_(f, 1)), uv_.row(F_(f, 2)));
  }
  double total() const {
    double sum = 0;
    for (Eigen::Index f = 0; f < F_.rows(); ++f) sum += energy_of(f);
    return sum;
  }
  double energy_around(int v) const {
    double sum = 0;
    for (const int* f = incident_.begin(v); f != incident_.end(v); ++f) sum += energy_of(*f);
    return sum;
  }
  void place(int v, const Eigen::RowVector2d& p) {
    uv_.row(v) = p;
    if (!mirror_.empty()) uv_.row(partner(v)) << (on_midline(v) ? 0 : -p.x()), p.y();
  }

  // One step down the gradient (by differences), halved until the energy falls.
  void improve(int v) {
    const Eigen::RowVector2d from = uv_.row(v);
    const double start = energy_around(v);
    const double reach = mean_edge(v), h = 1e-5 * reach;
    Eigen::RowVector2d gradient;
    for (int k = 0; k < 2; ++k) {
      uv_(v, k) = from[k] + h;
      const double above = energy_around(v);
      uv_(v, k) = from[k] - h;
      gradient[k] = (above - energy_around(v)) / (2 * h);
      uv_(v, k) = from[k];
    }
    if (on_midline(v)) gradient.x() = 0;
    if (!gradient.allFinite() || !(gradient.norm() > 0)) return;
    const Eigen::RowVector2d direction = -gradient / gradient.norm();
    for (double step = 0.5 * reach; step > 1e-4 * reach; step *= 0.5) {
      place(v, from + step * direction);
      if (energy_around(v) < start) return;
    }
    place(v, from);
  }
  double mean_edge(int v) const {
    double sum = 0;
    for (const int* f = incident_.begin(v); f != incident_.end(v); ++f) sum += flat_[static_cast<size_t>(*f)].x1;
    return sum / std::max(1, incident_.degree(v));
  }

  const Faces& F_;
  TexCoords uv_;
  const std::vector<int>& mirror_;
  Adjacency incident_;
  std::vector<Flat> flat_;
};

}  // namespace

TexCoords relaxed(const Vertices& V, const Faces& F, TexCoords uv, const std::vector<int>& mirror, int sweeps) {
  return Relaxation(V, F, std::move(uv), mirror).run(sweeps);
}

}  // namespace facewright
