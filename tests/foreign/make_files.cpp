// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Writes a small model in the formats that foreign readers open, and one of its faces for them to reproduce.
#include <iostream>
#include <nlohmann/json.hpp>

#include "libmodel/interop/export_model.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/model_file.h"
#include "tests/libmodel/interop/face_sheet.h"
using namespace facewright;

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_foreign_files FOLDER\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  save_model(folder / "model.h5", MorphableModel(testing::face_sheet_parts(5)));
  const MorphableModel model = load_model(folder / "model.h5");
  export_model(folder / "model.npz", model, 0, ExportFormat::npz);
  export_model(folder / "flame.npz", model, 0, ExportFormat::flame);
  export_model(folder / "textured.glb", model, 0, ExportFormat::glb);
  export_model(folder / "coloured.glb", model, 0, ExportFormat::glb, {.texture_size = 0});
  MorphableModelParts plain = model.parts();
  plain.colour = {};
  plain.uv.resize(0, 2);
  plain.expression.reset();
  plain.blendshapes.clear();
  export_model(folder / "plain.glb", MorphableModel(plain), 0, ExportFormat::glb, {.morph_targets = 0});
  const Eigen::Vector4d shape(1.5, -1, 0.5, 2);
  const Eigen::Vector2d expression(1, -2);
  const Eigen::VectorXd face =
      as_vector(model.instance(shape, {}, -1, expression).V) + 0.5 * model.blendshapes()[1].displacement;
  write_file(folder / "face.json",
             nlohmann::json{{"shape", std::vector<double>(shape.begin(), shape.end())},
                            {"expression", std::vector<double>(expression.begin(), expression.end())},
                            {"blendshape", "jaw open"},
                            {"weight", 0.5},
                            {"face_mm", std::vector<double>(face.begin(), face.end())}}
                 .dump());
}
