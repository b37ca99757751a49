// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/representer_reader.h"

#include <cmath>

#include "libmodel/model/level_topology.h"

namespace facewright {
namespace {

constexpr double kInward = -1.0 / 3;         // of facing(): a face has 0.6, a closed surface 0
constexpr Eigen::Index kFewTriangles = 100;  // make no face

}  // namespace

Faces read_index_triples(const Hdf5Reader& h5, const std::string& path) {
  const RowMatrixXi table = h5.integers(path);
  if (table.cols() != 3) h5.fail(path, "has " + std::to_string(table.cols()) + " columns; expected 3");
  return table;
}

Faces read_cells(const Hdf5Reader& h5, const std::string& group, Eigen::Index vertices) {
  const std::string legacy = group + "/representer/reference-mesh/triangle-list", cells = group + "/representer/cells",
                    vtk = group + "/representer/reference";
  const bool is_legacy = h5.has(legacy);
  if (!is_legacy && !h5.has(cells) && h5.has(vtk))
    h5.fail(vtk,
            "holds the mesh as a VTK file, as statismo before 0.9 did; this reads representer/cells. Load the "
            "model in scalismo or statismo 0.9 and save it again");
  Faces F;
  if (is_legacy) {
    F = read_index_triples(h5, legacy);
  } else {
    const RowMatrixXi columns = h5.integers(cells);
    if (columns.rows() != 3) h5.fail(cells, "has " + std::to_string(columns.rows()) + " rows; expected 3");
    F = columns.transpose();
  }
  for (Eigen::Index i = 0; i < F.size(); ++i)
    if (F.data()[i] < 0 || F.data()[i] >= vertices)
      h5.fail(is_legacy ? legacy : cells, "has triangle " + std::to_string(i / 3) + " (from 0) at vertex " +
                                              std::to_string(F.data()[i]) + "; expected 0 to " +
                                              std::to_string(vertices - 1) + ", counted from 0");
  return F;
}

void check_winding(const Hdf5Reader& h5, const std::string& group, const Faces& F, const Vertices& V) {
  const std::string cells = group + "/representer/cells";
  if (!consistently_oriented(F))
    h5.fail(cells, "has neighbouring triangles that turn opposite ways; expected all " + std::string(kWinding));
  if (F.rows() > kFewTriangles && facing(V, F) < kInward)
    h5.fail(cells, "is wound clockwise or the face looks along -z; expected triangles " + std::string(kWinding) +
                       " and the face along +z. Swap two rows, or turn the model");
}

double millimetres_per_unit(const Hdf5Reader& h5, const std::string& group) {
  const std::string path = group + "/representer/length-unit";
  if (!h5.has(path)) return 1;
  const RowMatrixXd metres = h5.matrix(path);
  if (metres.size() != 1 || !std::isfinite(metres(0, 0)) || metres(0, 0) <= 0)
    h5.fail(path, "is no length in metres; expected one number such as 0.001 for millimetres");
  const double scale = metres(0, 0) * 1000;
  return std::abs(scale - 1) < 1e-6 ? 1 : scale;  // 0.001 as float32
}

}  // namespace facewright
