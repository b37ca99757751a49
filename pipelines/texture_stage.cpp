// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/texture_stage.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "libmodel/io/atomic_file.h"
#include "pipelines/json_text.h"
#include "pipelines/matrix_hash.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr int kMethodVersion = 1;  // count up when the same input would give other coordinates

Json options_json(const IsomapOptions& o) {
  return {{"landmark_count", o.landmark_count},
          {"margin", o.margin},
          {"repair_sweeps", o.repair_sweeps},
          {"stretch_weight", o.stretch_weight},
          {"iterations", o.iterations}};  // not the number of threads: it changes nothing
}

std::string key_of(const MultiresTemplate& reference, const Vertices& mean, const IsomapOptions& options) {
  const int base = reference.base_count();
  const auto rows = std::min(static_cast<Eigen::Index>(reference.mirror.size()), Eigen::Index{base});
  const Eigen::VectorXi mirror = Eigen::Map<const Eigen::VectorXi>(reference.mirror.data(), rows);
  return sha256(sha256_of(Vertices(mean.topRows(base))) + sha256_of(reference.levels.front().F) + sha256_of(mirror) +
                json_text(options_json(options)) + std::to_string(kMethodVersion));
}

// The summary's figures that only the flattening itself knows, with their names: once for writing and reading.
template <class Summary, class Visitor>
void visit_figures(Summary& s, const Visitor& visit) {
  visit("source_count", s.source_count);
  visit("computed_count", s.computed_count);
  visit("third_eigenvalue_share", s.third_eigenvalue_share);
  visit("stress_of_scaling", s.stress);
  visit("stress", s.final_stress);
  visit("asymmetry", s.asymmetry);
  visit("symmetric", s.symmetric);
  visit("flips_before_repair", s.flips_before_repair);
  visit("repair", s.repair);
  visit("iterations", s.iterations);
  visit("stop", s.stop);
  visit("overlap", s.overlap);
  visit("coverage", s.coverage);
}

Json summary_json(const IsomapSummary& s) {
  Json j;
  visit_figures(s, [&](const char* name, const auto& value) { j[name] = value; });
  return j;
}

IsomapSummary read_summary(const Json& j, const IsomapOptions& options) {
  IsomapSummary s;
  s.options = options;
  visit_figures(s, [&](const char* name, auto& value) { j.at(name).get_to(value); });
  return s;
}

// What an earlier run left, if it is of the same input.
std::optional<IsomapResult> read_base(const fs::path& file, const std::string& key, Eigen::Index rows,
                                      const IsomapOptions& options) try {
  if (!fs::exists(file)) return {};
  const Json j = Json::parse(read_file(file));
  const Json& uv = j.at("uv");
  if (j.at("key") != key || static_cast<Eigen::Index>(uv.size()) != rows) return {};
  IsomapResult base;
  base.uv.resize(rows, 2);
  for (Eigen::Index v = 0; v < rows; ++v)
    for (int k = 0; k < 2; ++k) base.uv(v, k) = uv.at(static_cast<size_t>(v)).at(static_cast<size_t>(k)).get<double>();
  base.summary = read_summary(j.at("flattening"), options);
  return base;
} catch (const Json::exception&) {
  return {};
}

Json level_json(int vertices, const UvDistortion& d, double overlap) {
  return {{"vertices", vertices}, {"flips", d.flips},
          {"overlap", overlap},   {"l2", d.l2},
          {"linf", d.linf},       {"conformal", d.conformal},
          {"area", d.area},       {"symmetric_dirichlet", d.symmetric_dirichlet}};
}

void write_texture(const fs::path& file, const std::string& key, const MultiresTemplate& reference,
                   const IsomapTexture& texture) {
  Json j;
  j["key"] = key;
  j["options"] = options_json(texture.base.options);
  j["flattening"] = summary_json(texture.base);
  for (size_t l = 0; l < reference.levels.size(); ++l)
    j["levels"].push_back(level_json(reference.levels[l].vertex_count, texture.distortion[l], texture.overlap[l]));
  for (int v = 0; v < reference.base_count(); ++v) j["uv"].push_back({texture.uv(v, 0), texture.uv(v, 1)});
  write_file(file, json_text(j) + "\n");
}

}  // namespace

TextureStage texture_stage(const MultiresTemplate& reference, const Vertices& mean, const fs::path& file,
                           const IsomapOptions& options) {
  const std::string key = key_of(reference, mean, options);
  std::optional<IsomapResult> base = read_base(file, key, reference.base_count(), options);
  TextureStage stage;
  stage.reused = base.has_value();
  if (!base) base = base_isomap(reference, mean, options);
  stage.texture = texture_from_base(reference, mean, *base);
  stage.texture.base.distortion = stage.texture.distortion.front();
  write_texture(file, key, reference, stage.texture);
  return stage;
}

}  // namespace facewright
