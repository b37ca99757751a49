// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/uv/isomap_texture.h"

#include "libmodel/core/errors.h"

namespace facewright {

IsomapTexture isomap_texture(const MultiresTemplate& reference, const Vertices& mean, const IsomapOptions& options) {
  if (mean.rows() != reference.V.rows() || reference.levels.empty())
    throw InvalidInput("uv: the mean has " + std::to_string(mean.rows()) + " vertices, the reference " +
                       std::to_string(reference.V.rows()));
  const int base = reference.base_count();
  std::vector<int> mirror;
  if (!reference.mirror.empty()) mirror.assign(reference.mirror.begin(), reference.mirror.begin() + base);
  IsomapResult flat = isomap_uv(mean.topRows(base), reference.levels.front().F, mirror, options);
  IsomapTexture result;
  result.base = std::move(flat.summary);
  result.uv = refine_field(reference.parents, base, flat.uv, static_cast<int>(mean.rows()));
  for (const TemplateLevel& level : reference.levels)
    result.distortion.push_back(
        measure_distortion(mean.topRows(level.vertex_count), level.F, result.uv.topRows(level.vertex_count)));
  return result;
}

}  // namespace facewright
