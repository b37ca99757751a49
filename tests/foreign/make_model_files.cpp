// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Writes a model file and eos files, and beside them as JSON what an independent reader should find in them. With
// MODEL.h5, faces of that model instead of a small one.
#include <iostream>
#include <nlohmann/json.hpp>

#include "libmodel/interop/eos_companions.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/model_file.h"
#include "tests/libmodel/model/model_fixtures.h"
using namespace facewright;
using nlohmann::json;

namespace {

template <class Vector>
std::vector<double> list(const Vector& v) {
  return {v.data(), v.data() + v.size()};
}

// A level's own coefficients, drawn, and the values they stand for: through the coefficients that all levels share, and
// the rows of the finest level's basis, which is not what the level's group holds.
json values_of(const std::filesystem::path& file, const std::string& group, const std::string& part,
               const PcaModel& shared, Random& random) {
  const auto own = stored_statistics(file, group, part);
  const Eigen::VectorXd c = (own ? own->model : shared).draw_coefficients(random);
  return {{"coefficients", list(c)}, {"values", list(shared.instance(own ? own->shared(c) : c))}};
}

json levels_of(const std::filesystem::path& file) {
  json levels = json::object();
  Random random(5);
  const size_t count = stored_levels(file).size();
  for (size_t l = 0; l <= count; ++l) {
    const std::string group = l < count ? "/level" + std::to_string(l) : "/";
    const MorphableModel level = load_model(file, group);
    json& parts = levels[group];
    parts["shape"] = values_of(file, group, "shape", level.shape(), random);
    if (level.has_colour()) parts["color"] = values_of(file, group, "color", level.colour(), random);
    if (level.expression()) parts["expression"] = values_of(file, group, "expression", *level.expression(), random);
  }
  return levels;
}

json pca_json(const PcaModel& pca, const Faces& F) {
  const auto floats = [](const Eigen::MatrixXd& m) { return list(Eigen::MatrixXd(m.cast<float>().cast<double>())); };
  return {{"mean", floats(pca.mean)},
          {"basis", floats(pca.basis)},
          {"eigenvalues", floats(pca.variances)},
          {"triangles", list(F)}};
}

void write_eos(const std::filesystem::path& folder, const std::string& name, const MorphableModel& model, int version) {
  write_file(folder / (name + ".bin"), eos_model_bytes(model, version));
  json expected = {{"version", version}};
  expected["shape"] = pca_json(model.shape(), model.faces());
  if (model.has_colour()) expected["colour"] = pca_json(model.colour(), model.faces());
  if (version == 4) {
    if (model.expression()) expected["expression"] = pca_json(*model.expression(), model.faces());
    for (const auto& [key, mark] : model.landmarks()) expected["landmarks"][key] = mark.vertex;
    for (const Blendshape& b : model.blendshapes())
      if (!model.expression())
        expected["blendshapes"][b.name] = list(Eigen::VectorXd(b.displacement.cast<float>().cast<double>()));
  }
  TexCoords uv = model.uv();
  if (uv.rows() > 0) uv.col(1) = 1 - uv.col(1).array();
  expected["uv"] = list(uv);
  write_file(folder / (name + ".json"), expected.dump());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::cerr << "usage: make_model_files FOLDER [MODEL.h5]\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1], file = argc == 3 ? argv[2] : folder / "model.h5";
  if (argc == 2) save_model(file, MorphableModel(testing::random_parts(17)));
  write_file(folder / "levels.json", levels_of(file).dump());
  const MorphableModel model = orthonormalised(load_model(file).level(0));
  write_eos(folder, "version4", model, 4);
  MorphableModelParts parts = model.parts();
  parts.expression.reset();
  write_eos(folder, "blendshapes4", MorphableModel(parts), 4);
  parts.colour = {};
  write_eos(folder, "version1", MorphableModel(parts), 1);
  write_file(folder / "blendshapes_alone.bin", eos_blendshapes_bytes(model.blendshapes()));
}
