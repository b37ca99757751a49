// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/template_reading.h"

#include "libmodel/core/errors.h"
#include "libregister/registration/register_scan.h"

namespace facewright {

MultiresTemplate coarse_levels(const MultiresTemplate& reference, int count) {
  if (count < 1 || count > static_cast<int>(reference.levels.size()))
    throw InvalidInput("coarse_levels: the reference has " + std::to_string(reference.levels.size()) + " levels");
  MultiresTemplate coarse;
  coarse.levels.assign(reference.levels.begin(), reference.levels.begin() + count);
  const int n = coarse.levels.back().vertex_count;
  coarse.V = reference.V.topRows(n);
  coarse.parents.assign(reference.parents.begin(), reference.parents.begin() + (n - reference.base_count()));
  if (!reference.mirror.empty()) coarse.mirror.assign(reference.mirror.begin(), reference.mirror.begin() + n);
  coarse.landmarks = reference.landmarks;
  for (const auto& [name, vertices] : reference.regions)
    for (const int v : vertices)
      if (v < n) coarse.regions[name].push_back(v);
  return coarse;
}

BentTemplate bend_template(const Vertices& reference, const MultiresTemplate& coarse, const Landmarks& landmarks) {
  const Mesh base = coarse.level_mesh(0);
  SymmetryPlane plane;
  if (!coarse.mirror.empty()) plane = symmetry_plane(coarse.V, coarse.mirror);
  const GlobalMapResult map = global_mapping(reference, coarse.mirror.empty() ? nullptr : &plane,
                                             locate(coarse.landmarks, base.V, base.F), landmarks);
  return {map.V, map.alignment.scan_from_reference};
}

TemplateReading read_off_template(const Mesh& scan, const Landmarks& landmarks, const MultiresTemplate& coarse) {
  RegisterOptions options;
  options.denoise.method = DenoiseMethod::none;  // a coarse level does not see the noise
  const RegistrationResult r = register_scan(scan, landmarks, coarse, options);
  TemplateReading reading;
  const Mesh base = coarse.level_mesh(0);
  reading.landmarks = locate(coarse.landmarks, r.V.topRows(base.V.rows()), base.F);
  reading.scan_from_head = fit_similarity(coarse.V, r.V);
  reading.dropped = r.summary.landmarks_rejected;
  reading.leave_one_out_rms = r.summary.leave_one_out_rms;
  reading.landmark_noise = r.summary.landmark_noise;
  reading.matched = r.summary.matched / static_cast<double>(r.V.rows());
  return reading;
}

}  // namespace facewright
