// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/parametric_face.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"
#include "libmodel/synthetic/mean_head.h"
#include "libmodel/synthetic/smooth_noise.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

/// Barycentric coordinates of the point of triangle (a, b, c) nearest to p [ericson2005].
Vector3d nearest_barycentric(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / (d4 - d3 + d5 - d6);
    return {0, 1 - w, w};
  }
  return Vector3d{va, vb, vc} / (va + vb + vc);
}

/// Nearest point among the triangles around the vertices near p.
MeshLandmark nearest_on_mesh(const Vector3d& p, const Mesh& mesh, const Adjacency& faces_of) {
  const Eigen::VectorXd distance = (mesh.V.rowwise() - p.transpose()).rowwise().norm();
  const double reach = distance.minCoeff() + 3;
  MeshLandmark best;
  double smallest = std::numeric_limits<double>::infinity();
  for (int v = 0; v < static_cast<int>(mesh.V.rows()); ++v) {
    if (distance[v] > reach) continue;
    for (const int* f = faces_of.begin(v); f != faces_of.end(v); ++f) {
      const auto corner = [&](int k) -> Vector3d { return mesh.V.row(mesh.F(*f, k)).transpose(); };
      const SurfacePoint s{*f, nearest_barycentric(p, corner(0), corner(1), corner(2))};
      const double d = (position(s, mesh.V, mesh.F) - p).norm();
      if (d < smallest - 1e-12) smallest = d, best.point = s;
    }
  }
  return best;
}

/// Marks the midline and the left side, and mirrors those triangles to the right.
LandmarkSet mark_mesh(const Landmarks& landmarks, const CanonicalMesh& canonical) {
  const Mesh& mesh = canonical.mesh;
  const Adjacency faces_of = vertex_faces(mesh.V.rows(), mesh.F);
  const auto mirror = [&](int v) { return canonical.mirror[static_cast<size_t>(v)]; };
  LandmarkSet marks;
  for (const auto& [name, landmark] : landmarks) {
    if (landmark.position.x() < 0) continue;
    const MeshLandmark left = marks[name] = nearest_on_mesh(landmark.position, mesh, faces_of);
    const std::string other = mirrored_landmark(name);
    if (other == name) continue;
    std::array<int, 3> corners;
    for (int k = 0; k < 3; ++k) corners[static_cast<size_t>(k)] = mirror(mesh.F(left.point.triangle, k));
    for (const int* f = faces_of.begin(corners[0]); f != faces_of.end(corners[0]); ++f) {
      SurfacePoint right{*f, Vector3d::Zero()};
      int found = 0;
      for (int k = 0; k < 3; ++k)
        for (int m = 0; m < 3; ++m)
          if (mesh.F(*f, k) == corners[static_cast<size_t>(m)])
            right.barycentric[k] = left.point.barycentric[m], ++found;
      if (found == 3) marks[other].point = right;
    }
  }
  return marks;
}

/// The smooth fields that make a person an individual.
class PersonalFields {
 public:
  explicit PersonalFields(const SyntheticPerson& person)
      : random_(person.field_seed), individuality_(person.individuality), asymmetry_(person.asymmetry) {
    for (int k = 0; k < 3; ++k) symmetric_.emplace_back(random_, 32.0, 80.0, 12);
    for (int k = 0; k < 3; ++k) free_.emplace_back(random_, 60.0, 160.0, 8);
  }
  Vector3d operator()(const Vector3d& p) const {
    Vector3d d = Vector3d::Zero();
    if (individuality_ > 0) {
      const Vector3d flip{-1, 1, 1}, q = p.cwiseProduct(flip);
      const Vector3d a{symmetric_[0](p), symmetric_[1](p), symmetric_[2](p)};
      const Vector3d b{symmetric_[0](q), symmetric_[1](q), symmetric_[2](q)};
      d += individuality_ * std::sqrt(0.5) * (a + b.cwiseProduct(flip));
    }
    if (asymmetry_ > 0) d += asymmetry_ * Vector3d{free_[0](p), free_[1](p), free_[2](p)};
    return d;
  }

 private:
  Random random_;
  double individuality_, asymmetry_;
  std::vector<SmoothField> symmetric_, free_;
};

void check(const ParametricFace& face, const SyntheticPerson& person) {
  if (person.shape.size() != static_cast<Eigen::Index>(face.parameters().size()))
    throw InvalidInput("synthetic person: expected " + std::to_string(face.parameters().size()) +
                       " shape parameters, got " + std::to_string(person.shape.size()));
  if (!person.shape.allFinite()) throw InvalidInput("synthetic person: shape parameters must be finite");
}

}  // namespace

ParametricFace::ParametricFace(const CanonicalMeshOptions& options) : canonical_(extract_mean_head(options)) {
  const Landmarks marks = mean_head_landmarks();
  landmarks_ = mark_mesh(marks, canonical_);
  parameters_ = shape_parameters(marks);
  canonical_.mesh.colours = mesh(mean_person(), options.threads).colours;
}

Eigen::Index ParametricFace::parameter_index(const std::string& name) const {
  for (size_t k = 0; k < parameters_.size(); ++k)
    if (parameters_[k].name == name) return static_cast<Eigen::Index>(k);
  throw InvalidInput("parametric face: no shape parameter \"" + name + "\"");
}

SyntheticPerson ParametricFace::mean_person() const {
  SyntheticPerson person;
  person.shape = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters_.size()));
  return person;
}

Vertices ParametricFace::positions(const SyntheticPerson& person, const Vertices& points, int threads) const {
  check(*this, person);
  const PersonalFields fields(person);
  Vertices result(points.rows(), 3);
  parallel_blocks(static_cast<int>(points.rows()), threads, [&](int first, int last) {
    for (int i = first; i < last; ++i) {
      const Vector3d p = points.row(i).transpose();
      Vector3d q = p + fields(p);
      for (size_t k = 0; k < parameters_.size(); ++k) {
        const double c = person.shape[static_cast<Eigen::Index>(k)];
        if (c != 0) q += c * parameters_[k].displacement(p);
      }
      result.row(i) = q.transpose();
    }
  });
  return result;
}

Vector3d ParametricFace::position(const SyntheticPerson& person, const Vector3d& p) const {
  return positions(person, p.transpose(), 1).row(0).transpose();
}

Mesh ParametricFace::mesh(const SyntheticPerson& person, int threads) const {
  Mesh result;
  result.V = positions(person, canonical_.mesh.V, threads);
  result.F = canonical_.mesh.F;
  result.colours.resize(result.V.rows(), 3);
  const SkinPainter paint(person.appearance);
  parallel_blocks(static_cast<int>(result.V.rows()), threads, [&](int first, int last) {
    for (int i = first; i < last; ++i) result.colours.row(i) = paint(canonical_.mesh.V.row(i).transpose()).transpose();
  });
  return result;
}

Landmarks ParametricFace::locate_landmarks(const SyntheticPerson& person) const {
  Vertices corners(3 * static_cast<Eigen::Index>(landmarks_.size()), 3);
  Eigen::Index row = 0;
  for (const auto& [name, mark] : landmarks_)
    for (int k = 0; k < 3; ++k) corners.row(row++) = mean().V.row(mean().F(mark.point.triangle, k));
  const Vertices moved = positions(person, corners, 1);
  Landmarks result;
  row = 0;
  for (const auto& [name, mark] : landmarks_) {
    result[name].position = moved.middleRows(row, 3).transpose() * mark.point.barycentric;
    row += 3;
  }
  return result;
}

namespace {

// Real faces vary along few directions: of the released Surrey model's variance 41, 70, 79, 89 and 95 % lie in the
// first 1, 3, 5, 10 and 20 modes. Parameters drawn one by one would spread theirs over fifty. So most of a parameter's
// variance is shared: by size, dimorphism and adiposity as named, the rest by facial types whose loadings are fixed
// random numbers of falling weight. docs/synthetic.md has the spectrum that results.
constexpr double kCommunality = 0.85;
constexpr int kTypes = 8;
constexpr double kTypeDecay = 0.85;

double named_communality(const ShapeParameter& p) {
  return p.size * p.size + p.dimorphism * p.dimorphism + p.adiposity * p.adiposity;
}

Eigen::MatrixXd type_loadings(const std::vector<ShapeParameter>& parameters) {
  Random random(20161);
  Eigen::MatrixXd loadings(static_cast<Eigen::Index>(parameters.size()), kTypes);
  for (Eigen::Index k = 0; k < loadings.rows(); ++k) {
    for (Eigen::Index f = 0; f < kTypes; ++f) loadings(k, f) = std::pow(kTypeDecay, f) * random.normal();
    const double shared = std::max(0.0, kCommunality - named_communality(parameters[static_cast<size_t>(k)]));
    loadings.row(k) *= std::sqrt(shared) / loadings.row(k).norm();
  }
  return loadings;
}

}  // namespace

SyntheticPerson draw_person(const ParametricFace& face, std::uint64_t seed, std::uint64_t index, const DrawOptions& o) {
  const auto within = [](double x, const char* name) {
    if (!(x >= 0 && x <= 2))
      throw InvalidInput("draw_person: " + std::string(name) + " must be 0 .. 2, not " + std::to_string(x));
  };
  within(o.spread, "spread");
  within(o.individuality, "individuality");
  within(o.asymmetry, "asymmetry");
  Random random = Random::stream(seed, index);
  const auto clipped = [&] { return std::clamp(random.normal(), -2.4, 2.4); };
  const double size = clipped(), dimorphism = 1.2 * std::tanh(1.1 * clipped()), adiposity = clipped();
  SyntheticPerson person = face.mean_person();
  const Eigen::MatrixXd loadings = type_loadings(face.parameters());
  Eigen::VectorXd type(loadings.cols());
  for (double& z : type) z = clipped();
  for (size_t k = 0; k < face.parameters().size(); ++k) {
    const ShapeParameter& p = face.parameters()[k];
    const auto row = static_cast<Eigen::Index>(k);
    const double shared =
        p.size * size + p.dimorphism * dimorphism + p.adiposity * adiposity + loadings.row(row).dot(type);
    const double own =
        std::sqrt(std::max(1 - kCommunality, 1 - named_communality(p) - loadings.row(row).squaredNorm()));
    person.shape[row] = o.spread * std::clamp(shared + own * clipped(), -2.5, 2.5);
  }
  person.field_seed = random.bits();
  person.individuality = o.individuality;
  person.asymmetry = o.asymmetry;
  person.appearance = draw_appearance(random, dimorphism);
  return person;
}

}  // namespace facewright
