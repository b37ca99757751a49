// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <matio.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "libmodel/interop/byte_writer.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "tests/libmodel/interop/face_sheet.h"

// A model as other programs write theirs.
namespace facewright::testing {

inline void write_mat(const std::filesystem::path& path, std::map<std::string, Eigen::MatrixXd> variables,
                      mat_ft version = MAT_FT_MAT5, matio_compression compression = MAT_COMPRESSION_NONE) {
  std::filesystem::create_directories(path.parent_path());
  mat_t* file = Mat_CreateVer(path.c_str(), nullptr, version);
  for (auto& [name, m] : variables) {
    size_t dims[2] = {static_cast<size_t>(m.rows()), static_cast<size_t>(m.cols())};
    matvar_t* variable = Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, m.data(), 0);
    Mat_VarWrite(file, variable, compression);
    Mat_VarFree(variable);
  }
  Mat_Close(file);
}

inline std::map<std::string, Eigen::MatrixXd> bfm_variables(const MorphableModelParts& p) {
  Eigen::MatrixXd triangles = p.levels[0].F.cast<double>().array() + 1;
  triangles.col(1).swap(triangles.col(2));
  return {{"shapeMU", p.shape.mean * 1000},
          {"shapePC", p.shape.basis},
          {"shapeEV", p.shape.variances.cwiseSqrt() * 1000},
          {"tl", triangles}};
}

inline std::string scm_bytes(const MorphableModelParts& p) {
  ByteWriter out;
  const Faces& F = p.levels[0].F;
  out.value(static_cast<std::uint32_t>(p.shape.vertex_count()));
  out.value(static_cast<std::uint32_t>(F.rows()));
  out.array(F.data(), static_cast<size_t>(F.size()));
  const auto k = static_cast<std::uint32_t>(p.shape.mode_count()), n = static_cast<std::uint32_t>(p.shape.mean.size());
  out.value(k);
  out.value(n);
  out.array(p.shape.basis.data(), size_t{k} * n);
  out.value(n);
  out.array(p.shape.mean.data(), n);
  out.value(k);
  out.array(p.shape.variances.data(), k);
  return out.take();
}

inline void write_ict(const std::filesystem::path& folder, const MorphableModelParts& p) {
  const auto write = [&](const std::string& name, const Eigen::VectorXd& x) {
    Mesh mesh;
    mesh.V = as_vertices(x) / 10;
    mesh.F = p.levels[0].F;
    write_obj(folder / (name + ".obj"), mesh);
  };
  write("generic_neutral_mesh", p.shape.mean);
  for (int k = 0; k < p.shape.mode_count(); ++k)
    write("identity00" + std::to_string(k), p.shape.mean + std::sqrt(p.shape.variances[k]) * p.shape.basis.col(k));
  for (const Blendshape& b : p.blendshapes) write(b.name, p.shape.mean + b.displacement);
}

}  // namespace facewright::testing
