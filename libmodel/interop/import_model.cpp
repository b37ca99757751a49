// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/import_model.h"

#include <algorithm>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/interop/eos_companions.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/foreign_geometry.h"
#include "libmodel/interop/foreign_model.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/npz.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/model_file.h"

namespace facewright {
namespace {

void expect_one_of(const std::string& option, const std::string& value, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), value) != known.end()) return;
  std::string list;
  for (const std::string& k : known) list += (list.empty() ? "" : ", ") + k;
  throw InvalidInput("import: " + option + " is '" + value + "'; expected one of " + list);
}

void validate(const ImportOptions& o) {
  std::vector<std::string> formats = import_format_names();
  formats.insert(formats.begin(), "auto");
  expect_one_of("format", o.format, formats);
  expect_one_of("units", o.units, {"auto", "um", "mm", "cm", "m"});
  expect_one_of("winding", o.winding, {"auto", "keep", "turn"});
  expect_one_of("values", o.values, {"auto", "variance", "sigma", "columns"});
  expect_one_of("colours", o.colours, {"auto", "linear", "srgb"});
  if (o.axes != "auto") axes_rotation(o.axes);
  if (o.leading_vertices < 0) throw InvalidInput("import: leading vertices must not be negative");
}

bool asks_for_nothing(const ImportOptions& o) {
  return o.units == "auto" && o.winding == "auto" && o.axes == "auto" && o.values == "auto" && o.colours == "auto" &&
         o.leading_vertices == 0 && o.isomap.empty();
}

// "x y" per vertex, y down; stretched to the unit square if it is in pixels.
TexCoords read_isomap_text(const std::filesystem::path& path, Eigen::Index vertices) {
  const std::string text = read_file(path);
  if (text.size() / 4 + 1 < static_cast<size_t>(vertices))
    throw IoError(path.string(), "is too short for the " + std::to_string(vertices) + " vertices of the model");
  std::istringstream lines(text);
  TexCoords uv(vertices, 2);
  for (Eigen::Index v = 0; v < vertices; ++v)
    if (!(lines >> uv(v, 0) >> uv(v, 1)))
      throw IoError(path.string(), static_cast<int>(v) + 1,
                    "expected \"x y\" for each of the " + std::to_string(vertices) + " vertices");
  if (std::string rest; lines >> rest) throw IoError(path.string(), "goes on after the last vertex");
  if (!uv.allFinite()) throw IoError(path.string(), "holds NaN or infinity");
  if (uv.minCoeff() < 0 || uv.maxCoeff() > 1)
    for (int k = 0; k < 2; ++k) {
      const double low = uv.col(k).minCoeff(), span = uv.col(k).maxCoeff() - low;
      uv.col(k) = ((uv.col(k).array() - low) / (span > 0 ? span : 1)).matrix().eval();
    }
  uv.col(1) = 1 - uv.col(1).array();
  return uv;
}

std::string described(const std::string& format) {
  if (format == "facewright") return "Facewright model (.h5)";
  if (format == "npz") return "Facewright archive (.npz)";
  if (format == "glb") return "glTF binary (.glb)";
  if (format == "eos") return "eos model (.bin)";
  return "statismo, scalismo or Basel Face Model 2017/2019 (.h5)";
}

MorphableModel read_model(const std::string& format, const std::filesystem::path& path) {
  if (format == "eos") return read_eos_model(path);
  if (format == "npz") return read_npz_model(path);
  if (format == "glb") return read_glb_model(path);
  try_model_file(path);
  return load_model(path);
}

ForeignModel read_foreign(const std::string& format, const std::filesystem::path& path, const ImportOptions& options) {
  if (format == "bfm2009") return read_bfm2009(path);
  if (format == "lsfm") return read_lsfm(path);
  if (format == "lyhm") return read_lyhm(path);
  if (format == "scm") return read_scm(path);
  if (format == "ict") return read_ict_folder(path);
  if (format == "flame") return read_flame(path, options.identity_modes);
  ForeignModel m = foreign_model(read_model(format, path), path.string(), described(format));
  if (format == "statismo") m.colour_space = ColourSpace::srgb;
  return m;
}

void take_blendshapes(const std::filesystem::path& path, ForeignModel* model) {
  for (Blendshape& b : read_eos_blendshapes(path)) {
    if (b.displacement.size() != model->shape.mean.size())
      throw IoError(path.string(), "has a blendshape of " + std::to_string(b.displacement.size() / 3) +
                                       " vertices; the model has " + std::to_string(model->shape.mean.size() / 3));
    model->blendshapes.push_back(std::move(b));
  }
  model->notes.push_back("blendshapes: from " + path.filename().string());
}

// Formats of our own, and glTF, whose units are defined: nothing is left to settle.
bool is_own(const std::string& format) { return format == "facewright" || format == "npz" || format == "glb"; }

ImportResult taken_as_it_is(const MorphableModel& model, const std::string& format) {
  ImportResult result{model, described(format), {}};
  result.decisions.push_back(format == "glb" ? "units: m as glTF defines; m to mm: lengths times 1000"
                                             : "units, axes, winding, bases and colours: Facewright's own, kept");
  if (format == "glb") {
    result.decisions.push_back("axes and winding: as glTF defines");
    result.decisions.push_back("morph targets: " + std::to_string(model.shape().mode_count()) + " shape modes, " +
                               std::to_string(model.expression() ? model.expression()->mode_count() : 0) +
                               " expression modes, " + std::to_string(model.blendshapes().size()) + " blendshapes");
  }
  result.decisions.push_back("levels: " + std::to_string(model.level_count()));
  return result;
}

}  // namespace

ImportResult import_model(const std::filesystem::path& path, const ImportOptions& options) {
  validate(options);
  if (!std::filesystem::exists(path)) throw IoError(path.string(), "there is no such file or folder");
  const std::string format = options.format == "auto" ? sniff_model_format(path) : options.format;
  if (!options.blendshapes.empty() && format != "eos")
    throw InvalidInput("import: a file of blendshapes goes with eos models only; " + path.string() + " is a " + format +
                       " model");
  if (options.identity_modes >= 0 && format != "flame")
    throw InvalidInput("import: a number of identity modes goes with FLAME-style archives only; " + path.string() +
                       " is a " + format + " model");
  if (is_own(format) && asks_for_nothing(options)) return taken_as_it_is(read_model(format, path), format);
  ForeignModel model = read_foreign(format, path, options);
  if (!options.blendshapes.empty()) take_blendshapes(options.blendshapes, &model);
  if (!options.isomap.empty()) {
    model.uv = read_isomap_text(options.isomap, model.shape.mean.size() / 3);
    model.notes.push_back("texture coordinates: from " + options.isomap.filename().string() + ", v turned up");
  }
  return settle(std::move(model), options);
}

}  // namespace facewright
