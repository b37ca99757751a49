// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/hierarchy_file.h"

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/json_whole.h"
#include "libregister/reference/regions.h"
#include "libregister/subdivision/journal.h"
#include "pipelines/json_text.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

// Per vertex the mean and the deviation of each feature; a deviation of -1 says that too few faces show it.
Json appearance_json(const FaceAppearance& a) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < a.mean.rows(); ++i) {
    Json row = Json::array();
    for (int c = 0; c < kAppearanceFeatures; ++c) row.push_back(a.mean(i, c));
    for (int c = 0; c < kAppearanceFeatures; ++c)
      row.push_back(std::isfinite(a.deviation(i, c)) ? a.deviation(i, c) : -1.0);
    rows.push_back(std::move(row));
  }
  return rows;
}

FaceAppearance appearance_from(const Json& rows) {
  FaceAppearance a;
  a.mean.resize(static_cast<Eigen::Index>(rows.size()), kAppearanceFeatures);
  a.deviation.resize(static_cast<Eigen::Index>(rows.size()), kAppearanceFeatures);
  for (size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != 2 * kAppearanceFeatures) throw InvalidInput("appearance: a row of another length");
    for (size_t c = 0; c < kAppearanceFeatures; ++c) {
      const auto r = static_cast<Eigen::Index>(i), k = static_cast<Eigen::Index>(c);
      const double d = rows[i].at(kAppearanceFeatures + c).get<double>();
      a.mean(r, k) = rows[i].at(c).get<double>();
      a.deviation(r, k) = d < 0 ? std::numeric_limits<double>::infinity() : d;
    }
  }
  return a;
}

}  // namespace

void write_decision(const LevelDecision& d, const std::string& key, const OutputTree& tree) {
  Json j;
  j["key"] = key;
  j["criterion"] = criterion_name(d.summary.criterion);
  j["scans"] = d.summary.scans;
  j["left_out"] = d.summary.left_out;
  for (const TemplateLevel& l : d.reference.levels) {
    j["vertices"].push_back(l.vertex_count);
    j["triangles"].push_back(l.F.rows());
    j["boundary_edges"].push_back(boundary_edge_count(l.F));
  }
  j["parents"] = Json::array();
  for (const VertexParents& p : d.reference.parents)
    j["parents"].push_back(p.is_midpoint() ? Json{p.a, p.b} : Json{p.a, p.b, p.c});
  if (d.summary.mean_as_reference) {
    j["positions"] = Json::array();
    for (Eigen::Index i = 0; i < d.reference.V.rows(); ++i)
      j["positions"].push_back({d.reference.V(i, 0), d.reference.V(i, 1), d.reference.V(i, 2)});
  }
  if (!d.appearance.empty()) j["appearance"] = appearance_json(d.appearance);
  write_file(tree.hierarchy(), json_text(j) + "\n");
}

std::optional<LevelDecision> earlier_decision(const ReferenceFace& face, const std::string& key,
                                              const BuildPipelineOptions& options, const OutputTree& tree) {
  if (!std::filesystem::exists(tree.hierarchy())) return {};
  try {
    const Json j = Json::parse(read_file(tree.hierarchy()));
    if (j.at("key") != key || j.at("criterion") != criterion_name(options.criterion)) return {};
    if (options.mean_as_reference && options.levels.size() > 1 && !j.contains("positions")) return {};
    RefinementJournal journal{static_cast<int>(face.mesh.vertex_count()), {}};
    for (const Json& p : j.at("parents"))
      journal.parents.push_back(
          {whole_number<int>(p.at(0)), whole_number<int>(p.at(1)), p.size() > 2 ? whole_number<int>(p.at(2)) : -1});
    LevelDecision d;
    d.reference = replay(journal, face.mesh, face.mirror, face.landmarks, whole_numbers(j.at("vertices")));
    d.reference.regions = template_regions(d.reference, face.regions);
    const bool mean = j.contains("positions");
    if (mean) {
      const auto positions = j.at("positions").get<std::vector<std::vector<double>>>();
      if (static_cast<Eigen::Index>(positions.size()) != d.reference.V.rows()) return {};
      for (size_t i = 0; i < positions.size(); ++i) {
        if (positions[i].size() != 3) return {};
        d.reference.V.row(static_cast<Eigen::Index>(i)) = Eigen::RowVector3d(positions[i].data());
      }
    }
    if (j.contains("appearance")) {
      d.appearance = appearance_from(j.at("appearance"));
      if (d.appearance.mean.rows() != AppearanceSpace(d.reference).vertex_count()) return {};
    }
    d.summary = {options.criterion,
                 true,
                 mean,
                 false,
                 j.at("scans").get<std::vector<std::string>>(),
                 j.at("left_out").get<std::vector<std::string>>()};
    return d;
  } catch (const std::exception&) {  // damaged: it is decided again
    return {};
  }
}

}  // namespace facewright
