// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/export_model.h"

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/interop/baked_texture.h"
#include "libmodel/interop/eos_companions.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/exported_levels.h"
#include "libmodel/interop/flame_npz.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/level_files.h"
#include "libmodel/interop/npz.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"

namespace facewright {

const std::vector<std::string>& export_format_names() {
  static const std::vector<std::string> names = {"obj",      "ply", "eos",  "npz",
                                                 "statismo", "glb", "flame"};  // as ExportFormat
  return names;
}

ExportFormat export_format(const std::string& name) {
  const auto& names = export_format_names();
  const auto entry = std::find(names.begin(), names.end(), name);
  if (entry == names.end())
    throw InvalidInput("export: '" + name + "' is no format; there are obj, ply, eos, npz, statismo, glb, flame");
  return static_cast<ExportFormat>(entry - names.begin());
}

MorphableModel orthonormalised(const MorphableModel& model) {
  MorphableModelParts parts = model.parts();
  parts.shape = parts.shape.orthonormalised();
  if (!parts.colour.empty()) parts.colour = parts.colour.orthonormalised();
  if (parts.expression) parts.expression = parts.expression->orthonormalised();
  return MorphableModel(std::move(parts));
}

namespace {

// With the colours as a picture beside it, where the mesh has a place for it.
void write_textured_obj(const std::filesystem::path& path, const Mesh& mesh, int texture_size) {
  if (!mesh.has_colours() || !mesh.has_uv() || texture_size == 0) return write_obj(path, mesh);
  const std::filesystem::path texture = std::filesystem::path(path).replace_extension(".png");
  write_png(texture, baked_texture(mesh, texture_size));
  write_obj(path, mesh, ObjMaterial{texture.filename().string()});
}

}  // namespace

void export_model(const std::filesystem::path& path, const MorphableModel& model, int level, ExportFormat format,
                  const ExportOptions& options) {
  if (format == ExportFormat::obj) return write_textured_obj(path, model.mean(level), options.texture_size);
  if (format == ExportFormat::ply) return write_ply(path, model.mean(level));
  MorphableModel part = model.level(level);
  if (format == ExportFormat::glb)
    return write_file(path, glb_bytes(part, {options.morph_targets, options.texture_size}));
  if (options.basis == ExportBasis::orthonormal) part = orthonormalised(part);
  if (format == ExportFormat::eos) return write_file(path, eos_model_bytes(part, options.eos_version));
  if (format == ExportFormat::flame) return write_file(path, flame_npz_bytes(part));
  if (format == ExportFormat::npz) return write_file(path, npz_bytes(part));
  save_model(path, part);
}

std::string eos_landmark_mapping(const MorphableModel& model) {
  const auto on_contour = [](const std::string& name) {
    const bool is_number = name.find_first_not_of("0123456789") == name.npos && !name.empty() && name.size() < 3;
    const int i = is_number ? std::stoi(name) : 0;
    return i >= 1 && i <= 17 && i != 9;
  };
  std::string text = "# Landmark names and vertices of the model, 0-based\n[landmark_mappings]\n";
  std::string right, left;
  for (const auto& [name, mark] : model.landmarks())
    if (name.empty())
      continue;  // no key
    else if (!on_contour(name))
      text += name + " = " + std::to_string(mark.vertex) + "\n";
    else if (std::stoi(name) < 9)
      right += (right.empty() ? "" : ", ") + name;
    else
      left += (left.empty() ? "" : ", ") + name;
  return text +
         "\n# Image landmarks that move along the candidates of the contours file, on the subject's right and left\n" +
         "[contour_landmarks]\nright = [" + right + "]\nleft = [" + left + "]\n";
}

void export_all(const std::filesystem::path& folder, const MorphableModel& model, const ExportOptions& options) {
  for (int l = 0; l < model.level_count(); ++l) {
    const std::string v = std::to_string(model.vertex_count(l)), eos = "eos_" + v;
    export_model(folder / (eos + ".bin"), model, l, ExportFormat::eos, options);
    export_model(folder / ("statismo_" + v + ".h5"), model, l, ExportFormat::statismo, options);
    export_model(folder / ("model_" + v + ".npz"), model, l, ExportFormat::npz, options);
    export_model(folder / ("model_" + v + ".glb"), model, l, ExportFormat::glb, options);
    write_file(folder / (eos + "_landmarks.txt"), eos_landmark_mapping(model));
    write_file(folder / (eos + "_contours.json"), contours_json(model, l));
    if (model.blendshapes().empty())
      std::filesystem::remove(folder / (eos + "_blendshapes.bin"));  // an earlier model's
    else
      write_file(folder / (eos + "_blendshapes.bin"), eos_blendshapes_bytes(model.level(l).blendshapes()));
    write_file(folder / (eos + "_edge_topology.json"), edge_topology_json(model.faces(l)));
    if (model.mirror().empty())
      std::filesystem::remove(folder / (eos + "_symmetry.txt"));  // an earlier model's
    else
      write_file(folder / (eos + "_symmetry.txt"), symmetry_text(model.mirror(), model.vertex_count(l)));
  }
  const std::vector<ExportNesting> proof = nesting_of_exports(folder, level_counts(model));
  write_file(folder / "nesting.json", nesting_json(proof));
  for (const ExportNesting& e : proof)
    if (!all_hold(e.rows)) throw SolverError("export: the levels of " + e.file + " do not nest; see nesting.json");
}

}  // namespace facewright
