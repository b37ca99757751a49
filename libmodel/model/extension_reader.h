// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>

#include "libmodel/model/hdf5_archive.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

// Private to this module. All failures are IoError naming the dataset.

/// The landmarks of a model: vertices by name if the file is ours, else the vertices of the mean nearest to the
/// coordinates of landmarks/json or landmarks/text.
LandmarkSet read_landmarks_of(const Hdf5Reader& h5, const std::string& metadata, const PcaModel& shape);

/// Places of the landmarks that are no vertices.
std::map<std::string, SurfacePoint, LandmarkNameOrder> read_landmark_points(const Hdf5Reader& h5,
                                                                            const std::string& ext);

/// Throws unless the file's format and the units, axes and winding it states are those this version knows.
void check_format(const Hdf5Reader& h5, const std::string& ext);

/// Everything under metadata/ext into parts, whose last level is this one.
void read_extension(const Hdf5Reader& h5, const std::string& ext, MorphableModelParts& parts);

}  // namespace facewright
