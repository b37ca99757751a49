// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/texture_stage.h"

#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "libmodel/io/atomic_file.h"
#include "libmodel/io/sha256.h"

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

template <class Matrix>
std::string bytes_of(const Matrix& m) {
  std::string bytes(sizeof(typename Matrix::Scalar) * static_cast<size_t>(m.size()), '\0');
  std::memcpy(bytes.data(), m.data(), bytes.size());
  return sha256(bytes);
}

std::string key_of(const MultiresTemplate& reference, const Vertices& mean, const IsomapOptions& options) {
  const int base = reference.base_count();
  const auto rows = std::min(static_cast<Eigen::Index>(reference.mirror.size()), Eigen::Index{base});
  const Eigen::VectorXi mirror = Eigen::Map<const Eigen::VectorXi>(reference.mirror.data(), rows);
  return sha256(bytes_of(Vertices(mean.topRows(base))) + bytes_of(reference.levels.front().F) + bytes_of(mirror) +
                options_json(options).dump() + std::to_string(kMethodVersion));
}

// The summary's figures that only the flattening itself knows.
Json summary_json(const IsomapSummary& s) {
  return {{"source_count", s.source_count},
          {"computed_count", s.computed_count},
          {"third_eigenvalue_share", s.third_eigenvalue_share},
          {"stress_of_scaling", s.stress},
          {"stress", s.final_stress},
          {"asymmetry", s.asymmetry},
          {"symmetric", s.symmetric},
          {"flips_before_repair", s.flips_before_repair},
          {"repair", s.repair},
          {"iterations", s.iterations},
          {"stop", s.stop},
          {"overlap", s.overlap},
          {"coverage", s.coverage}};
}

IsomapSummary read_summary(const Json& j, const IsomapOptions& options) {
  IsomapSummary s;
  s.options = options;
  j.at("source_count").get_to(s.source_count);
  j.at("computed_count").get_to(s.computed_count);
  j.at("third_eigenvalue_share").get_to(s.third_eigenvalue_share);
  j.at("stress_of_scaling").get_to(s.stress);
  j.at("stress").get_to(s.final_stress);
  j.at("asymmetry").get_to(s.asymmetry);
  j.at("symmetric").get_to(s.symmetric);
  j.at("flips_before_repair").get_to(s.flips_before_repair);
  j.at("repair").get_to(s.repair);
  j.at("iterations").get_to(s.iterations);
  j.at("stop").get_to(s.stop);
  j.at("overlap").get_to(s.overlap);
  j.at("coverage").get_to(s.coverage);
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
  write_file(file, j.dump() + "\n");
}

}  // namespace

TextureStage texture_stage(const MultiresTemplate& reference, const Vertices& mean, const fs::path& file,
                           const IsomapOptions& options) {
  const std::string key = key_of(reference, mean, options);
  std::optional<IsomapResult> base = read_base(file, key, reference.base_count(), options);
  TextureStage stage;
  stage.reused = base.has_value();
  if (!base) base = base_isomap(reference, mean, options);
  base->summary.distortion =
      measure_distortion(mean.topRows(reference.base_count()), reference.levels.front().F, base->uv);
  stage.texture = carry_up(reference, mean, *base);
  write_texture(file, key, reference, stage.texture);
  return stage;
}

}  // namespace facewright
