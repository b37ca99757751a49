// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/check_model.h"

#include <algorithm>
#include <optional>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/model/level_topology.h"
#include "libmodel/model/model_file.h"
#include "libmodel/model/model_reader.h"

namespace facewright {
namespace {

constexpr double kOrthonormal = 1e-5;  // float32 storage of 3N entries per column
constexpr double kRounding = 1e-5;     // of the largest entry: float32 products of some hundred modes

ModelCheck check_basis(const std::string& name, const PcaModel& pca) {
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(pca.mode_count(), pca.mode_count());
  if (pca.mode_count() > 0) G.selfadjointView<Eigen::Lower>().rankUpdate(pca.basis.transpose());
  G -= Eigen::MatrixXd::Identity(pca.mode_count(), pca.mode_count());
  const double error =
      pca.mode_count() > 0 ? Eigen::MatrixXd(G.triangularView<Eigen::Lower>()).cwiseAbs().maxCoeff() : 0;
  std::ostringstream detail;
  detail << pca.mode_count() << " modes, max |B'B - I| = " << error;
  return {name + " basis is orthonormal", error < kOrthonormal, detail.str()};
}

ModelCheck check_variances(const std::string& name, const PcaModel& pca) {
  try {
    validate(pca);
    return {name + " variances descend", true, std::to_string(pca.mode_count()) + " variances"};
  } catch (const InvalidInput& error) {
    return {name + " variances descend", false, error.what()};
  }
}

ModelCheck check_triangles(const LevelTopology& t) {
  std::ostringstream detail;
  detail << t.triangles << " triangles, " << t.boundary_edges << " boundary edges, Euler characteristic " << t.euler
         << (t.manifold ? "" : ", NOT manifold or with unused vertices") << (t.oriented ? "" : ", NOT oriented");
  if (t.has_mirror) detail << ", " << t.mirror_errors << " mirror errors";
  return {"triangles of " + std::to_string(t.vertices) + " vertices are an oriented manifold" +
              (t.has_mirror ? ", their mirror table an exact involution" : ""),
          t.sound(), detail.str()};
}

constexpr double kInward = -1.0 / 3;         // as the reader refuses
constexpr Eigen::Index kFewTriangles = 100;  // make no face

ModelCheck check_facing(const MorphableModel& model) {
  const double f = facing(as_vertices(model.shape().mean), model.faces());
  std::ostringstream detail;
  detail << "share of the surface that faces +z, less what faces -z: " << f;
  return {"triangles of " + std::to_string(model.vertex_count()) + " vertices face outward", f >= kInward,
          detail.str()};
}

// What the level's group holds for other programs against what it means: orthonormal, and the shared rows through the
// stored map, to the precision of float32.
void check_stored_basis(const std::filesystem::path& path, const std::string& group, const std::string& part,
                        const PcaModel& shared, const std::string& unit, std::vector<ModelCheck>& checks) {
  const std::optional<OrthonormalLevel> own = stored_statistics(path, group, part);
  if (!own) return;
  const std::string name = group.substr(1) + " own " + part;
  checks.push_back(check_basis(name, own->model));
  checks.push_back(check_variances(name, own->model));
  const Eigen::MatrixXd W = shared.rescaled_basis();
  std::ostringstream detail;
  if (own->own_from_shared.cols() != W.cols() || own->model.basis.rows() != W.rows()) {
    checks.push_back({name + " basis is the shared one in other coefficients", false, "sizes differ"});
    return;
  }
  const double left = (own->model.rescaled_basis() * own->own_from_shared - W).cwiseAbs().maxCoeff();
  const Eigen::MatrixXd M = own->own_from_shared * own->own_from_shared.transpose();
  const double turn = (M - Eigen::MatrixXd::Identity(M.rows(), M.cols())).cwiseAbs().maxCoeff();
  const double allowed = kRounding * W.cwiseAbs().maxCoeff();
  detail << "maximum deviation " << left << " " << unit << " per standard deviation, rounding allows " << allowed
         << "; map " << M.rows() << " x " << W.cols() << ", max |M M' - I| = " << turn;
  checks.push_back(
      {name + " basis is the shared one in other coefficients", left <= allowed && turn < kOrthonormal, detail.str()});
}

ModelCheck check_edges(const std::filesystem::path& path, const std::string& group, const MorphableModel& level) {
  const std::string property =
      "edge topology of " + std::to_string(level.vertex_count()) + " vertices is that of its triangles";
  const std::vector<Edge> stored = stored_edges(path, group);
  std::vector<Edge> own;
  try {
    own = level.edge_topology();
  } catch (const InvalidInput& error) {
    return {property, false, error.what()};  // no manifold
  }
  const bool same = stored.size() == own.size() &&
                    std::equal(own.begin(), own.end(), stored.begin(), [](const Edge& x, const Edge& y) {
                      return x.v0 == y.v0 && x.v1 == y.v1 && x.f0 == y.f0 && x.f1 == y.f1;
                    });
  return {property, stored.empty() || same,
          std::to_string(stored.size()) + " edges stored, " + std::to_string(own.size()) + " found"};
}

}  // namespace

std::vector<ModelCheck> check_model(const MorphableModel& model) {
  std::vector<ModelCheck> checks;
  const auto add = [&](const std::string& name, const PcaModel& pca) {
    if (pca.orthonormal) checks.push_back(check_basis(name, pca));
    checks.push_back(check_variances(name, pca));
  };
  add("shape", model.shape());
  if (model.has_colour()) add("colour", model.colour());
  if (model.expression()) add("expression", *model.expression());
  for (const LevelTopology& t : level_topologies(model)) checks.push_back(check_triangles(t));
  if (model.faces().rows() > kFewTriangles) checks.push_back(check_facing(model));
  return checks;
}

ModelCheck nesting_check(const NestingRow& row) {
  std::ostringstream detail;
  detail << "maximum deviation " << row.deviation << (row.unit.empty() ? "" : " ") << row.unit;
  if (row.tolerance > 0) detail << ", rounding allows " << row.tolerance;
  return {std::to_string(row.coarse) + " in " + std::to_string(row.fine) + ": " + row.quantity, row.holds(),
          detail.str()};
}

std::vector<ModelCheck> check_model_file(const std::filesystem::path& path) {
  const std::vector<int> levels = stored_levels(path);
  if (levels.empty()) return check_model(load_model(path, "/", Loading::unproven));
  // Level by level, since the whole is refused where positions do not nest: here the figure is wanted.
  std::vector<ModelCheck> checks;
  MorphableModel coarse;
  for (size_t l = 0; l < levels.size(); ++l) {
    const std::string group = "/level" + std::to_string(l);
    MorphableModel level = load_model(path, group, Loading::unproven);
    for (ModelCheck& check : check_model(level))
      if (l == 0 || check.property.rfind("triangles", 0) != 0 ||
          check.property.find(" " + std::to_string(level.vertex_count()) + " ") != std::string::npos)
        checks.push_back(std::move(check));
    checks.push_back(check_edges(path, group, level));
    check_stored_basis(path, group, "shape", level.shape(), "mm", checks);
    if (level.has_colour()) check_stored_basis(path, group, "color", level.colour(), "linear RGB", checks);
    if (level.expression()) check_stored_basis(path, group, "expression", *level.expression(), "mm", checks);
    if (l > 0)
      for (const NestingRow& row : compare_levels(coarse, level)) checks.push_back(nesting_check(row));
    coarse = std::move(level);
  }
  return checks;
}

}  // namespace facewright
