// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/disc.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/core/similarity.h"
#include "libmodel/core/topology.h"

namespace facewright {
namespace {

constexpr double kNeedle = 1e-7;  // height over length of a triangle
constexpr double kNudge = 1e-4;   // of the mean edge

double loop_length(const Vertices& V, const std::vector<int>& loop) {
  double length = 0;
  for (size_t i = 0; i < loop.size(); ++i) length += (V.row(loop[(i + 1) % loop.size()]) - V.row(loop[i])).norm();
  return length;
}

// Which hole is the mirror image of hole h.
int mirrored_hole(const std::vector<std::vector<int>>& holes, size_t h, const std::vector<int>& mirror) {
  const int partner = mirror[static_cast<size_t>(holes[h].front())];
  for (size_t other = 0; other < holes.size(); ++other)
    if (std::find(holes[other].begin(), holes[other].end(), partner) != holes[other].end())
      return static_cast<int>(other);
  return static_cast<int>(h);
}

}  // namespace

Disc close_holes(const Vertices& V, const Faces& F, const std::vector<int>& mirror) {
  std::vector<std::vector<int>> holes = boundary_loops(F);
  if (holes.empty())
    throw InvalidInput(
        "uv: the surface is closed; a texture map needs a border: cut the mesh open, as make-reference does behind the "
        "ears");
  if (connected_components(V.rows(), F).count != 1)
    throw InvalidInput("uv: the surface is in pieces, or has vertices in no triangle; keep its largest piece only");
  const auto outer = std::max_element(
      holes.begin(), holes.end(), [&](const auto& a, const auto& b) { return loop_length(V, a) < loop_length(V, b); });
  holes.erase(outer);
  Disc disc{V, F, mirror};
  Eigen::Index added = 0;
  for (const auto& loop : holes) added += static_cast<Eigen::Index>(loop.size());
  disc.V.conservativeResize(V.rows() + static_cast<Eigen::Index>(holes.size()), 3);
  disc.F.conservativeResize(F.rows() + added, 3);
  Eigen::Index f = F.rows();
  for (size_t h = 0; h < holes.size(); ++h) {
    const auto& loop = holes[h];
    const int centre = static_cast<int>(V.rows() + static_cast<Eigen::Index>(h));
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (size_t i = 0; i < loop.size(); ++i) {
      sum += V.row(loop[i]);
      disc.F.row(f++) << loop[(i + 1) % loop.size()], loop[i], centre;  // against the loop's triangles
    }
    disc.V.row(centre) = sum / static_cast<double>(loop.size());
    if (!mirror.empty()) disc.mirror.push_back(static_cast<int>(V.rows()) + mirrored_hole(holes, h, mirror));
  }
  if (euler_characteristic(disc.F) != 1)
    throw InvalidInput("uv: the surface has handles (Euler characteristic " +
                       std::to_string(euler_characteristic(disc.F)) +
                       " with its holes closed, expected 1); close the tunnels, for instance behind the ears");
  return disc;
}

bool is_symmetric(const Faces& F, const std::vector<int>& mirror) {
  if (mirror.empty()) return false;
  const auto key = [](std::array<int, 3> t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  std::set<std::array<int, 3>> triangles;
  for (Eigen::Index f = 0; f < F.rows(); ++f) triangles.insert(key({F(f, 0), F(f, 1), F(f, 2)}));
  const auto partner = [&](int v) { return mirror[static_cast<size_t>(v)]; };
  return std::all_of(triangles.begin(), triangles.end(), [&](const auto& t) {
    return triangles.count(key({partner(t[0]), partner(t[2]), partner(t[1])})) > 0;
  });
}

Vertices symmetric_shape(const Vertices& V, const std::vector<int>& mirror) {
  Vertices image(V.rows(), 3);
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    const auto partner = V.row(mirror[static_cast<size_t>(v)]);
    image.row(v) << -partner.x(), partner.y(), partner.z();
  }
  return 0.5 * (V + fit_similarity(image, V, Scaling::fixed).apply(image));
}

Vertices without_needles(const Vertices& V, const Faces& F, const std::vector<int>& mirror) {
  double length = 0;
  bool needles = false;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d a = V.row(F(f, 1)) - V.row(F(f, 0)), b = V.row(F(f, 2)) - V.row(F(f, 0));
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (a - b).squaredNorm()});
    needles = needles || !(a.cross(b).norm() > kNeedle * longest);
    length += std::sqrt(longest) / static_cast<double>(F.rows());
  }
  if (!needles) return V;
  Random random(1);
  Vertices moved = V;
  for (Eigen::Index i = 0; i < V.size(); ++i) moved.data()[i] += kNudge * length * random.normal();
  return mirror.empty() ? moved : symmetric_shape(moved, mirror);
}

std::vector<int> spread_vertices(const Vertices& V, const std::vector<int>& mirror, int count) {
  const int n = static_cast<int>(V.rows());
  std::set<int> chosen;
  if (count <= 0 || count >= n) {
    for (int v = 0; v < n; ++v) chosen.insert(v);
    return {chosen.begin(), chosen.end()};
  }
  const Eigen::RowVector3d centre = V.colwise().mean();
  Eigen::VectorXd distance = (V.rowwise() - centre).rowwise().squaredNorm();
  bool first = true;
  while (static_cast<int>(chosen.size()) < count) {
    Eigen::Index next = 0;
    distance.maxCoeff(&next);
    for (int v :
         {static_cast<int>(next), mirror.empty() ? static_cast<int>(next) : mirror[static_cast<size_t>(next)]}) {
      chosen.insert(v);
      const Eigen::VectorXd to = (V.rowwise() - V.row(v)).rowwise().squaredNorm();
      distance = first ? to : distance.cwiseMin(to).eval();
      first = false;
    }
  }
  return {chosen.begin(), chosen.end()};
}

}  // namespace facewright
