// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/mesh.h"
#include "libmodel/model/hdf5_archive.h"

namespace facewright {

// Private to this module.

// What a file of ours states about its geometry.
inline const char* const kLengthUnit = "mm";
inline const char* const kAxes = "+x subject's left, +y up, +z out of the face";
inline const char* const kWinding = "counter-clockwise from outside";

/// A table of three columns.
Faces read_index_triples(const Hdf5Reader& h5, const std::string& path);

/// The triangles of the statismo model at `group`, of `vertices` vertices: representer/cells (3 x M), or the older
/// representer/reference-mesh/triangle-list (M x 3). Throws IoError if one names a vertex that does not exist.
Faces read_cells(const Hdf5Reader& h5, const std::string& group, Eigen::Index vertices);

/// Throws IoError if neighbouring triangles turn opposite ways, or if the surface, by more than a third of its area,
/// faces away from +z. For files of ours: what others mean by their triangles is for import-model to find out.
void check_winding(const Hdf5Reader& h5, const std::string& group, const Faces& F, const Vertices& V);

/// Millimetres per unit of the statismo model at `group`, which may state representer/length-unit in metres.
double millimetres_per_unit(const Hdf5Reader& h5, const std::string& group);

}  // namespace facewright
