// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/errors.h"
#include "libmodel/interop/foreign_model.h"
#include "libmodel/interop/mat_file.h"

namespace facewright {
namespace {

// A basis, its mean and the numbers beside its columns; those may be more or fewer than the columns.
ForeignModes read_modes(const MatFile& file, const std::string& mean, const std::string& basis,
                        const std::string& values, ModeScale scale) {
  ForeignModes m;
  m.scale = scale;
  m.mean = file.vector(mean);
  if (m.mean.size() == 0 || m.mean.size() % 3 != 0)
    file.fail(mean, "has " + std::to_string(m.mean.size()) + " numbers, not three per vertex");
  m.columns = file.matrix(basis);
  if (m.columns.rows() != m.mean.size() && m.columns.cols() == m.mean.size()) m.columns.transposeInPlace();
  if (m.columns.rows() != m.mean.size())
    file.fail(basis, "has " + std::to_string(m.columns.rows()) + " rows; expected " + std::to_string(m.mean.size()));
  m.values = file.vector(values);
  if (m.values.size() < m.columns.cols())
    file.fail(values, "has " + std::to_string(m.values.size()) + " numbers for " + std::to_string(m.columns.cols()) +
                          " columns of '" + basis + "'");
  m.values.conservativeResize(m.columns.cols());
  return m;
}

void expect_vertices(const MatFile& file, const std::string& name, const ForeignModes& m, const ForeignModes& shape) {
  if (m.mean.size() != shape.mean.size())
    file.fail(name,
              "has " + std::to_string(m.mean.size()) + " numbers; the shape has " + std::to_string(shape.mean.size()));
}

ForeignModel start(const std::filesystem::path& path, const std::string& format) {
  ForeignModel model;
  model.path = path.string();
  model.format = format;
  return model;
}

int vertices(const ForeignModel& model) { return static_cast<int>(model.shape.mean.size() / 3); }

}  // namespace

ForeignModel read_bfm2009(const std::filesystem::path& path) {
  const MatFile file(path);
  ForeignModel model = start(path, "Basel Face Model 2009 (.mat)");
  model.shape = read_modes(file, "shapeMU", "shapePC", "shapeEV", ModeScale::sigmas);
  if (file.has("texMU")) {
    model.colour = read_modes(file, "texMU", "texPC", "texEV", ModeScale::sigmas);
    expect_vertices(file, "texMU", model.colour, model.shape);
    model.colour_space = ColourSpace::srgb;
    model.colour_range = 255;
  }
  model.F = zero_based(file.triangles("tl"), vertices(model), 1, model);
  model.units = "um";
  model.inward = true;
  return model;
}

ForeignModel read_lsfm(const std::filesystem::path& path) {
  const MatFile file(path);
  ForeignModel model = start(path, "Large Scale Facial Model (.mat)");
  model.shape = read_modes(file, "mean", "components", "eigenvalues", ModeScale::variances);
  model.F = zero_based(file.triangles("trilist"), vertices(model), 0, model);
  return model;
}

ForeignModel read_lyhm(const std::filesystem::path& path) {
  const MatFile file(path);
  ForeignModel model = start(path, "Liverpool-York Head Model (.mat)");
  model.shape = read_modes(file, "shp.mu", "shp.eigVec", "shp.eigVal", ModeScale::variances);
  if (file.has("tex")) {
    model.colour = read_modes(file, "tex.mu", "tex.eigVec", "tex.eigVal", ModeScale::variances);
    expect_vertices(file, "tex.mu", model.colour, model.shape);
    model.colour_space = ColourSpace::srgb;
  }
  const std::string triangles = file.has("tri") ? "tri" : file.has("tl") ? "tl" : "shp.tri";
  model.F = zero_based(file.triangles(triangles), vertices(model), 1, model);
  model.inward = true;
  return model;
}

}  // namespace facewright
