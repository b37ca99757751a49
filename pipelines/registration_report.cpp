// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/registration_report.h"

#include <nlohmann/json.hpp>

#include "libmodel/building/colour_sampling.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/surface/nearest.h"

namespace facewright {

using Json = nlohmann::ordered_json;

std::string describe_registration(const Scan& scan, const RegisterSummary& s) {
  const Json report = {
      {"id", scan.id},
      {"units", {{"mm_per_unit", scan.mm_per_unit}, {"reason", scan.units_reason}}},
      {"warnings", scan.warnings},
      {"repair",
       {{"degenerate", scan.repair.degenerate},
        {"duplicate", scan.repair.duplicate},
        {"non_manifold", scan.repair.non_manifold},
        {"island_triangles", scan.repair.island_triangles},
        {"unused_vertices", scan.repair.unused_vertices}}},
      {"scan", {{"vertices", scan.mesh.vertex_count()}, {"triangles", scan.mesh.face_count()}}},
      {"noise_mm", s.denoise.noise},
      {"spikes", s.denoise.spikes},
      {"landmarks",
       {{"used", s.landmarks_used},
        {"rejected", s.landmarks_rejected},
        {"swapped_left_right", s.swapped_left_right},
        {"residual_mean_mm", s.landmark_mean},
        {"residual_max_mm", s.landmark_max}}},
      {"global_mapping", {{"scale", s.scale}, {"lambda", s.lambda}, {"leave_one_out_rms_mm", s.leave_one_out_rms}}},
      {"origins",
       {{"matched", s.matched}, {"mirrored", s.mirrored}, {"interpolated", s.interpolated}, {"free", s.free}}},
      {"surface_mm", {{"mean", s.surface_mean}, {"p95", s.surface_p95}}},
      {"folded_edges", {{"count", s.folds}, {"percent", s.fold_percent}}},
      {"acceptable", s.acceptable},
      {"concern", s.concern}};
  return report.dump(1);
}

Mesh coloured_registration(const Scan& scan, const RegistrationResult& r, const Faces& F) {
  Mesh mesh;
  mesh.V = r.V;
  mesh.F = F;
  Mesh source = scan.mesh;
  source.V = r.denoised.V;
  const SurfaceIndex index(source.V, source.F);
  mesh.colours = sample_colours(source, scan.texture, index.nearest(r.V), vertex_edge_lengths(r.V, F));
  return mesh;
}

std::string origin_letters(const std::vector<MatchOrigin>& origins) {
  constexpr char kLetters[] = {'f', 'm', 'r', 'i'};  // in the order of MatchOrigin
  std::string letters;
  for (const MatchOrigin o : origins) letters += kLetters[static_cast<int>(o)];
  return letters;
}

}  // namespace facewright
