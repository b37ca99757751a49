// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/eos_model.h"

#include "libmodel/core/errors.h"
#include "libmodel/interop/eos_binary.h"

namespace facewright {
namespace {

void write_triangles(ByteWriter& out, const Faces& F) {
  out.value(static_cast<std::uint64_t>(F.rows()));
  out.array(F.data(), static_cast<size_t>(F.size()));
}

void write_pca(ByteWriter& out, const PcaModel& pca, const Faces& F) {
  const bool empty = pca.empty();
  write_eos_matrix(out, pca.mean);
  write_eos_matrix(out, empty ? Eigen::MatrixXd(0, 0) : pca.basis);
  write_eos_matrix(out, pca.variances);
  write_triangles(out, empty ? Faces(0, 3) : F);
}

void write_landmarks_table(ByteWriter& out, const LandmarkSet& landmarks) {
  out.value(static_cast<std::uint64_t>(landmarks.size()));
  for (const auto& [name, mark] : landmarks) {
    out.value(static_cast<std::uint64_t>(name.size()));
    out.text(name);
    out.value(static_cast<std::int32_t>(mark.vertex));
  }
}

void write_uv(ByteWriter& out, const TexCoords& uv) {
  out.value(static_cast<std::uint64_t>(uv.rows()));
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    out.value(uv(v, 0));
    out.value(1 - uv(v, 1));
  }
}

// There is room for one kind: modes, else blendshapes.
void write_expressions(ByteWriter& out, const MorphableModel& model) {
  const bool none = !model.expression() && model.blendshapes().empty();
  out.value(static_cast<std::uint8_t>(none ? 1 : 0));  // 1 = nothing follows
  if (none) return;
  out.value(static_cast<std::int32_t>(model.expression() ? kEosPcaExpressions : kEosBlendshapes));
  if (model.expression())
    write_pca(out, *model.expression(), model.faces());
  else
    write_eos_blendshapes(out, model.blendshapes());
}

}  // namespace

std::string eos_model_bytes(const MorphableModel& model, int version) {
  if (model.level_count() != 1) throw InvalidInput("eos: a file holds one level; choose one");
  if (version != 1 && version != 4) throw InvalidInput("eos: version is " + std::to_string(version) + "; known: 1, 4");
  ByteWriter out;
  out.value(static_cast<std::uint32_t>(version));
  write_pca(out, model.shape(), model.faces());
  write_pca(out, model.colour(), model.faces());
  if (version == 4) {
    write_expressions(out, model);
    out.value(static_cast<std::uint8_t>(model.landmarks().empty() ? 1 : 0));
    if (!model.landmarks().empty()) write_landmarks_table(out, model.landmarks());
  }
  write_uv(out, model.uv());
  if (version == 4) write_triangles(out, Faces(0, 3));  // coordinates are per vertex
  return out.take();
}

}  // namespace facewright
