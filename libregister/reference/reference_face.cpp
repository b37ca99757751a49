// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/reference/reference_face.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libregister/reference/regions.h"

namespace facewright {
namespace {

// Vertex nearest to a point among those sorted by y, within tolerance; -1 if there is none.
int match(const Vertices& V, const std::vector<int>& by_y, const Eigen::RowVector3d& p, double tolerance) {
  auto it = std::lower_bound(by_y.begin(), by_y.end(), p.y() - tolerance, [&](int v, double y) { return V(v, 1) < y; });
  int best = -1;
  double distance = tolerance;
  for (; it != by_y.end() && V(*it, 1) <= p.y() + tolerance; ++it)
    if (const double d = (V.row(*it) - p).norm(); d <= distance) distance = d, best = *it;
  return best;
}

class Parser {
 public:
  Parser(const std::string& text, const std::string& name) : in_(text), name_(name) {}

  ReferenceFace run() {
    for (std::string line; std::getline(in_, line);) {
      ++line_;
      std::istringstream words(line);
      std::string kind;
      if (!(words >> kind) || kind[0] == '#') continue;
      read_record(kind, words);
    }
    fill();
    return std::move(face_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw IoError(name_, line_, what); }

  void read_record(const std::string& kind, std::istringstream& words) {
    if (kind == "v") {
      std::array<double, 3> p{};
      if (!(words >> p[0] >> p[1] >> p[2])) fail("expected \"v x y z\"");
      vertices_.push_back(p);
    } else if (kind == "f") {
      std::array<int, 3> t{};
      if (!(words >> t[0] >> t[1] >> t[2])) fail("expected \"f a b c\", three vertex numbers");
      for (const int v : t) check_vertex(v);
      faces_.push_back(t);
    } else if (kind == "l") {
      std::string name;
      int v = -1;
      if (!(words >> name >> v)) fail("expected \"l name vertex\"");
      check_vertex(v);
      marks_[name] = v;
      if (std::string word; words >> word) {
        if (word != "derived") fail("landmark " + name + ": expected nothing or \"derived\" after the vertex");
        face_.derived.insert(name);
      }
    } else if (kind == "r") {
      std::string name;
      if (!(words >> name)) fail("expected \"r region vertices\"");
      auto& region = face_.regions[name];
      for (int v = 0; words >> v;) {
        check_vertex(v);
        region.push_back(v);
      }
      if (!words.eof()) fail("region " + name + ": expected vertex numbers");
    } else {
      fail("unknown record \"" + kind + "\"");
    }
  }

  // Vertices come first, so that numbers can be checked as they are read.
  void check_vertex(int v) const {
    if (v < 0 || v >= static_cast<int>(vertices_.size()))
      fail("vertex " + std::to_string(v) + " is not among the " + std::to_string(vertices_.size()) + " above");
  }

  void fill() {
    if (faces_.empty()) fail("no triangles");
    face_.mesh.V.resize(static_cast<Eigen::Index>(vertices_.size()), 3);
    face_.mesh.F.resize(static_cast<Eigen::Index>(faces_.size()), 3);
    for (size_t v = 0; v < vertices_.size(); ++v)
      face_.mesh.V.row(static_cast<Eigen::Index>(v)) << vertices_[v][0], vertices_[v][1], vertices_[v][2];
    for (size_t f = 0; f < faces_.size(); ++f)
      face_.mesh.F.row(static_cast<Eigen::Index>(f)) << faces_[f][0], faces_[f][1], faces_[f][2];
    for (const auto& [name, v] : marks_) face_.landmarks[name] = mark_vertex(face_.mesh.F, v);
    face_.mirror = find_mirror(face_.mesh);
  }

  std::istringstream in_;
  std::string name_;
  int line_ = 0;
  std::vector<std::array<double, 3>> vertices_;
  std::vector<std::array<int, 3>> faces_;
  std::map<std::string, int> marks_;
  ReferenceFace face_;
};

}  // namespace

std::vector<int> find_mirror(const Mesh& mesh, double tolerance) {
  if (!(tolerance > 0)) throw InvalidInput("find_mirror: the tolerance must be positive");
  const Vertices& V = mesh.V;
  std::vector<int> by_y(static_cast<size_t>(V.rows())), mirror(by_y.size());
  std::iota(by_y.begin(), by_y.end(), 0);
  std::sort(by_y.begin(), by_y.end(), [&](int a, int b) { return V(a, 1) < V(b, 1); });
  for (int v = 0; v < V.rows(); ++v) {
    mirror[v] = match(V, by_y, {-V(v, 0), V(v, 1), V(v, 2)}, tolerance);
    if (mirror[v] < 0) return {};
  }
  try {
    mirrored_triangles(mesh.F, mirror);
  } catch (const InvalidInput&) {
    return {};
  }
  return mirror;
}

int nearest_corner(const MeshLandmark& mark, const Faces& F) {
  if (mark.vertex >= 0) return mark.vertex;
  Eigen::Index corner = 0;
  mark.point.barycentric.maxCoeff(&corner);
  return F(mark.point.triangle, corner);
}

MeshLandmark mark_vertex(const Faces& F, int v) {
  for (int f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      if (F(f, k) == v) return {{f, Eigen::Vector3d::Unit(k)}, v};
  throw InvalidInput("reference: no triangle uses vertex " + std::to_string(v));
}

std::string format_reference(const ReferenceFace& face) {
  std::ostringstream out;
  char line[128];
  for (int v = 0; v < face.mesh.V.rows(); ++v) {
    const auto p = face.mesh.V.row(v);
    std::snprintf(line, sizeof line, "v %.4f %.4f %.4f\n", p.x() + 0.0, p.y() + 0.0, p.z() + 0.0);
    out << line;
  }
  for (int f = 0; f < face.mesh.F.rows(); ++f)
    out << "f " << face.mesh.F(f, 0) << ' ' << face.mesh.F(f, 1) << ' ' << face.mesh.F(f, 2) << '\n';
  for (const auto& [name, mark] : face.landmarks)
    out << "l " << name << ' ' << nearest_corner(mark, face.mesh.F) << (face.derived.count(name) ? " derived\n" : "\n");
  for (const auto& [name, vertices] : face.regions) {
    out << "r " << name;
    for (const int v : vertices) out << ' ' << v;
    out << '\n';
  }
  return out.str();
}

ReferenceFace parse_reference(const std::string& text, const std::string& name) { return Parser(text, name).run(); }

MultiresTemplate build_template(const ReferenceFace& face, const std::vector<int>& budgets,
                                const HierarchyOptions& options) {
  MultiresTemplate result = build_hierarchy(face.mesh, face.mirror, face.landmarks, budgets, options);
  result.regions = template_regions(result, face.regions);
  return result;
}

}  // namespace facewright
