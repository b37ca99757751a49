// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/morphable_model.h"

#include <algorithm>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

void expect(bool ok, const std::string& what) {
  if (!ok) throw InvalidInput("model: " + what);
}
// For loops over vertices: no text is made unless it is needed.
void expect(bool ok, const char* what) {
  if (!ok) throw InvalidInput(std::string("model: ") + what);
}

void check_levels(const MorphableModelParts& p, int n) {
  expect(!p.levels.empty(), "there is no level");
  int previous = 0;
  for (const auto& level : p.levels) {
    const std::string name = "the level of " + std::to_string(level.vertex_count) + " vertices ";
    expect(level.vertex_count > previous, name + "is not finer than the one before");
    expect(level.F.size() == 0 || (level.F.minCoeff() >= 0 && level.F.maxCoeff() < level.vertex_count),
           name + "has a triangle with a vertex outside it");
    previous = level.vertex_count;
  }
  expect(previous == n,
         "the shape has " + std::to_string(n) + " vertices, the finest level " + std::to_string(previous));
}

void check_mirror(const MorphableModelParts& p, int n) {
  if (p.mirror.empty()) return;
  expect(static_cast<int>(p.mirror.size()) == n, "the symmetry table does not have one entry per vertex");
  for (int v = 0; v < n; ++v) {
    const int m = p.mirror[static_cast<size_t>(v)];
    expect(m >= 0 && m < n && p.mirror[static_cast<size_t>(m)] == v, "the symmetry table is not an involution");
  }
  for (const auto& level : p.levels)
    for (int v = 0; v < level.vertex_count; ++v)
      expect(p.mirror[static_cast<size_t>(v)] < level.vertex_count, "a vertex and its mirror are on different levels");
}

void check_parents(const MorphableModelParts& p, int n) {
  const int base = n - static_cast<int>(p.parents.size());
  expect(base >= 0, "more parents than vertices");
  for (size_t i = 0; i < p.parents.size(); ++i) {
    const int v = base + static_cast<int>(i);
    const auto& q = p.parents[i];
    if (q.a < 0 || q.b < 0 || q.a >= v || q.b >= v || q.c >= v)
      throw InvalidInput("model: vertex " + std::to_string(v) + " has no parents");
  }
  expect(p.base_faces.size() == 0 || (p.base_faces.minCoeff() >= 0 && p.base_faces.maxCoeff() < base),
         "a base triangle names a vertex that has parents");
}

void validate_statistics(const MorphableModelParts& p) {
  validate(p.shape);
  validate(p.colour);
  if (p.expression) validate(*p.expression);
}

void check_statistics(const MorphableModelParts& p) {
  const auto n = p.shape.mean.size();
  expect(p.colour.empty() || p.colour.mean.size() == n, "shape and colour differ in their number of vertices");
  std::set<std::string> names;
  for (const Blendshape& b : p.blendshapes) {
    expect(b.displacement.size() == n, "blendshape '" + b.name + "' does not have the shape's number of vertices");
    expect(b.displacement.allFinite(), "blendshape '" + b.name + "' holds NaN or infinity");
    expect(!b.name.empty() && names.insert(b.name).second, "blendshape '" + b.name + "' has no name of its own");
  }
  expect(!p.expression || p.expression->mean.size() == n, "shape and expression differ in their number of vertices");
}

PcaModel leading_rows_or_empty(const PcaModel& model, int n) { return model.empty() ? model : model.leading_rows(n); }

// Marks as unit points of a triangle of F at their vertex.
void attach(LandmarkSet& marks, const Faces& F) {
  std::vector<int> vertices;
  for (const auto& [name, mark] : marks) vertices.push_back(mark.vertex);
  const std::vector<SurfacePoint> points = points_at_vertices(F, vertices);
  size_t i = 0;
  for (auto& [name, mark] : marks) mark.point = points[i++];
}

void check_landmarks(const MorphableModelParts& p) {
  for (const auto& [name, mark] : p.landmarks)
    expect(mark.vertex >= 0 && mark.vertex < p.levels.front().vertex_count,
           "landmark '" + name + "' is not a vertex of the coarsest level");
  for (const auto& level : p.levels)
    for (const auto& [name, point] : level.landmark_points)
      expect(p.landmarks.count(name) && point.triangle >= 0 && point.triangle < level.F.rows() &&
                 point.barycentric.allFinite() && std::abs(point.barycentric.sum() - 1) < 1e-6,
             "landmark '" + name + "' has no place at " + std::to_string(level.vertex_count) + " vertices");
}

std::vector<int> below(const std::vector<int>& vertices, int n) {
  std::vector<int> kept;
  std::copy_if(vertices.begin(), vertices.end(), std::back_inserter(kept), [n](int v) { return v < n; });
  return kept;
}

}  // namespace

MorphableModel::MorphableModel(MorphableModelParts parts) : MorphableModel(std::move(parts), Unchecked{}) {
  validate_statistics(*parts_);
  check();
}

MorphableModel::MorphableModel(MorphableModelParts parts, ValidStatistics)
    : MorphableModel(std::move(parts), Unchecked{}) {
  check();
}

void MorphableModel::check() const {
  const MorphableModelParts& p = *parts_;
  const int n = static_cast<int>(p.shape.vertex_count());
  check_statistics(p);
  check_levels(p, n);
  check_mirror(p, n);
  check_parents(p, n);
  expect(p.uv.rows() == 0 || p.uv.rows() == n, "texture coordinates do not have one row per vertex");
  expect(p.uv.allFinite(), "texture coordinates hold NaN or infinity");
  check_landmarks(p);
  for (const auto& [name, region] : p.regions)
    if (std::any_of(region.begin(), region.end(), [n](int v) { return v < 0 || v >= n; }))
      throw InvalidInput("model: region '" + name + "' names a vertex that does not exist");
}

const ModelLevel& MorphableModel::at(int level) const {
  const int count = level_count(), l = level < 0 ? count - 1 : level;
  expect(l >= 0 && l < count, "there is no level " + std::to_string(level) + " of " + std::to_string(count));
  return parts_->levels[static_cast<size_t>(l)];
}

int MorphableModel::level_with(int vertex_count) const {
  std::string known;
  for (int l = 0; l < level_count(); ++l) {
    if (levels()[static_cast<size_t>(l)].vertex_count == vertex_count) return l;
    known += (l ? ", " : "") + std::to_string(levels()[static_cast<size_t>(l)].vertex_count);
  }
  throw InvalidInput("model: no level has " + std::to_string(vertex_count) + " vertices; there are " + known);
}

Mesh MorphableModel::mean(int level) const { return instance({}, {}, level); }

Mesh MorphableModel::instance(const Eigen::VectorXd& shape_coefficients, const Eigen::VectorXd& colour_coefficients,
                              int level, const Eigen::VectorXd& expression_coefficients) const {
  const ModelLevel& wanted = at(level);
  const int n = wanted.vertex_count;
  Eigen::VectorXd x = shape().instance(shape_coefficients, n);
  if (expression_coefficients.size() > 0) {
    expect(expression().has_value(), "there is no expression model");
    x += expression()->instance(expression_coefficients, n);
  }
  Mesh mesh;
  mesh.V = as_vertices(x);
  mesh.F = wanted.F;
  if (has_colour()) mesh.colours = as_vertices(colour().instance(colour_coefficients, n)).cwiseMax(0).cwiseMin(1);
  if (uv().rows() > 0) mesh.uv = uv().topRows(n);
  return mesh;
}

Mesh MorphableModel::sample(Random& random, int level, double sigma) const {
  const Eigen::VectorXd c_shape = shape().draw_coefficients(random, sigma);
  const Eigen::VectorXd c_colour = colour().draw_coefficients(random, sigma);
  return instance(c_shape, c_colour, level);
}

Eigen::VectorXd MorphableModel::coefficients(const Vertices& V) const { return shape().coefficients(as_vector(V)); }

Vertices MorphableModel::project(const Vertices& V) const { return as_vertices(shape().project(as_vector(V))); }

MorphableModel MorphableModel::level(int l) const {
  const ModelLevel& wanted = at(l);
  const int n = wanted.vertex_count;
  MorphableModelParts p;
  p.shape = shape().leading_rows(n);
  p.colour = leading_rows_or_empty(colour(), n);
  if (expression()) p.expression = expression()->leading_rows(n);
  for (const Blendshape& b : blendshapes()) p.blendshapes.push_back({b.name, b.displacement.head(3 * n)});
  p.levels = {wanted};
  if (uv().rows() > 0) p.uv = uv().topRows(n);
  p.landmarks = landmarks();
  attach(p.landmarks, wanted.F);
  if (!mirror().empty()) p.mirror.assign(mirror().begin(), mirror().begin() + n);
  p.parents.assign(parents().begin(), parents().begin() + std::max(0, n - base_vertex_count()));
  if (base_vertex_count() <= n) p.base_faces = base_faces();
  p.regions = regions(l);
  p.provenance = provenance();
  return MorphableModel(std::move(p));
}

LandmarkSet MorphableModel::landmarks(int level) const {
  const ModelLevel& wanted = at(level);
  LandmarkSet marks = landmarks();
  attach(marks, wanted.F);
  for (const auto& [name, point] : wanted.landmark_points) marks[name] = {point, -1};
  return marks;
}

std::map<std::string, std::vector<int>> MorphableModel::regions(int level) const {
  std::map<std::string, std::vector<int>> result;
  for (const auto& [name, region] : regions()) result[name] = below(region, at(level).vertex_count);
  return result;
}

FaceContours MorphableModel::contours(int level) const {
  const int n = at(level).vertex_count;
  const auto find = [&](const char* region, int first, int last) {
    if (const auto entry = regions().find(region); entry != regions().end()) return below(entry->second, n);
    std::vector<int> vertices;
    for (int i = first; i <= last; ++i)
      if (const auto mark = landmarks().find(std::to_string(i)); mark != landmarks().end())
        vertices.push_back(mark->second.vertex);
    return vertices;
  };
  return {find("right_contour", 1, 8), find("left_contour", 10, 17)};
}

MorphableModel MorphableModel::truncated(int shape_modes, int colour_modes) const {
  MorphableModelParts p = parts();
  p.shape = shape().truncated(shape_modes);
  p.colour = colour().truncated(colour_modes < 0 ? shape_modes : colour_modes);
  return MorphableModel(std::move(p));
}

MorphableModel MorphableModel::with_uv(TexCoords uv) const {
  MorphableModelParts p = parts();
  p.uv = std::move(uv);
  return MorphableModel(std::move(p));
}

MorphableModel MorphableModel::with_provenance(const std::map<std::string, std::string>& entries) const {
  MorphableModelParts p = parts();
  for (const auto& [key, value] : entries) p.provenance[key] = value;
  return MorphableModel(std::move(p));
}

LandmarkSet landmarks_on_vertices(const LandmarkSet& marks, const Faces& marked_on, const Faces& F) {
  LandmarkSet result = marks;
  for (auto& [name, mark] : result) {
    if (mark.vertex >= 0) continue;
    expect(mark.point.triangle >= 0 && mark.point.triangle < marked_on.rows(), "landmark '" + name + "' has no place");
    Eigen::Index corner = 0;
    mark.point.barycentric.maxCoeff(&corner);
    mark.vertex = marked_on(mark.point.triangle, corner);
  }
  attach(result, F);
  return result;
}

std::map<std::string, SurfacePoint, LandmarkNameOrder> landmark_points(const MultiresTemplate& reference, int l) {
  std::map<std::string, SurfacePoint, LandmarkNameOrder> points;
  for (const auto& [name, mark] : reference.landmarks) {
    if (mark.vertex >= 0) continue;
    SurfacePoint point = mark.point;
    // Level by level, as the nesting proof does it again from what is stored.
    for (size_t k = 0; k < static_cast<size_t>(l); ++k) {
      const TemplateLevel &from = reference.levels.at(k), &to = reference.levels.at(k + 1);
      const auto first = reference.parents.begin() + (from.vertex_count - reference.base_count());
      const auto last = reference.parents.begin() + (to.vertex_count - reference.base_count());
      point = carry_point(point, from.F, from.vertex_count, {first, last}, to.F);
    }
    points[name] = point;
  }
  return points;
}

}  // namespace facewright
