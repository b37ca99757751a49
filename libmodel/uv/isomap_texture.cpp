// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/isomap_texture.h"

#include "libmodel/core/errors.h"

namespace facewright {

namespace {

constexpr int kOverlapPixels = 2048;

void check_rows(const MultiresTemplate& reference, const Vertices& mean) {
  if (mean.rows() != reference.V.rows() || reference.levels.empty())
    throw InvalidInput("uv: the mean has " + std::to_string(mean.rows()) + " vertices, the reference " +
                       std::to_string(reference.V.rows()));
}

}  // namespace

IsomapResult base_isomap(const MultiresTemplate& reference, const Vertices& mean, const IsomapOptions& options) {
  check_rows(reference, mean);
  const int base = reference.base_count();
  std::vector<int> mirror;
  if (!reference.mirror.empty()) mirror.assign(reference.mirror.begin(), reference.mirror.begin() + base);
  return isomap_uv(mean.topRows(base), reference.levels.front().F, mirror, options);
}

IsomapTexture texture_from_base(const MultiresTemplate& reference, const Vertices& mean, const IsomapResult& base) {
  check_rows(reference, mean);
  IsomapTexture result;
  result.base = base.summary;
  result.uv = refine_field(reference.parents, reference.base_count(), base.uv, static_cast<int>(mean.rows()));
  for (const TemplateLevel& level : reference.levels) {
    const TexCoords uv = result.uv.topRows(level.vertex_count);
    result.distortion.push_back(measure_distortion(mean.topRows(level.vertex_count), level.F, uv));
    result.overlap.push_back(overlap_share(uv, level.F, kOverlapPixels));
  }
  return result;
}

IsomapTexture isomap_texture(const MultiresTemplate& reference, const Vertices& mean, const IsomapOptions& options) {
  return texture_from_base(reference, mean, base_isomap(reference, mean, options));
}

}  // namespace facewright
