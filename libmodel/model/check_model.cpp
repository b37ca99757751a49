// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/check_model.h"

#include <set>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/model/model_file.h"

namespace facewright {
namespace {

constexpr double kOrthonormal = 1e-5;  // float32 storage of 3N entries per column

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

ModelCheck check_triangles(int vertex_count, const Faces& F) {
  const std::string property = "triangles of " + std::to_string(vertex_count) + " vertices are a manifold";
  try {
    const std::set<int> used(F.data(), F.data() + F.size());
    const int unused = vertex_count - static_cast<int>(used.size());
    boundary_loops(F);
    return {property, unused == 0,
            std::to_string(F.rows()) + " triangles, " + std::to_string(unused) + " vertices in none"};
  } catch (const InvalidInput& error) {
    return {property, false, error.what()};
  }
}

bool leads(const PcaModel& part, const PcaModel& whole) {
  const Eigen::Index rows = part.mean.size();
  return rows <= whole.mean.size() && part.mode_count() == whole.mode_count() && part.mean == whole.mean.head(rows) &&
         (part.mode_count() == 0 || (part.basis == whole.basis.topRows(rows) && part.variances == whole.variances));
}

bool same_landmarks(const LandmarkSet& a, const LandmarkSet& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](const auto& x, const auto& y) {
           return x.first == y.first && x.second.vertex == y.second.vertex;
         });
}

void check_nesting(std::vector<ModelCheck>& checks, const MorphableModel& part, const MorphableModel& whole) {
  const int n = part.vertex_count();
  const std::string which = " of " + std::to_string(n) + " vertices lead the finest level's";
  checks.push_back({"shape rows" + which, leads(part.shape(), whole.shape()), "mean, basis and variances, bit by bit"});
  if (whole.has_colour())
    checks.push_back({"colour rows" + which, leads(part.colour(), whole.colour()), "mean, basis, variances"});
  if (whole.uv().rows() > 0) {
    const bool same = part.uv().rows() == n && part.uv() == whole.uv().topRows(n);
    checks.push_back({"texture coordinates" + which, same, "bit by bit"});
  }
  checks.push_back({"landmarks at " + std::to_string(n) + " vertices are the finest level's",
                    same_landmarks(part.landmarks(), whole.landmarks()),
                    std::to_string(whole.landmarks().size()) + " landmarks"});
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
  for (int l = 0; l < model.level_count(); ++l)
    checks.push_back(check_triangles(model.vertex_count(l), model.faces(l)));
  return checks;
}

std::vector<ModelCheck> check_model_file(const std::filesystem::path& path) {
  const MorphableModel model = load_model(path);
  std::vector<ModelCheck> checks = check_model(model);
  if (model.level_count() > 1)
    for (int l = 0; l < model.level_count(); ++l)
      check_nesting(checks, load_model(path, "/level" + std::to_string(l)), model);
  return checks;
}

}  // namespace facewright
