// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>

#include "libmodel/core/landmarks.h"

namespace facewright {

/// Reads 3D landmarks, in the file's own units and axes. Throws IoError for malformed files, unknown extensions,
/// duplicate names, and files of 2D landmarks.
///   .json      {"31": [x, y, z], ...} or {"31": {"position": [x, y, z], "stddev": s}, ...}
///   .pts       ibug layout with three numbers per line: kept as they are, named "1", "2", ... in order
///   .pp        MeshLab picked points: attribute name; points with active="0" are left out
///   .mrk.json  Slicer markups: labels; RAS coordinates are turned into LPS (x and y change sign), so that they meet
///              meshes saved by Slicer; undefined points are left out
///   .fcsv      the same, older: the columns' label; a header without a coordinate system means RAS
///   .ljson     menpo, versions 1 to 3: named "1", "2", ... in order (all groups one after the other) unless each
///              point has a label of its own; null points are left out and keep their number
///   .tlms      scalismo: name visible x y z; points that are not visible are left out
///   .csv       name,x,y,z with or without a header (name or label, x, y, z, stddev in any order), or x,y,z alone:
///              named "1", "2", ...
///   .bnd       BU-3DFE: vertex x y z; named "bnd_1", "bnd_2", ..., since ibug's landmarks of these numbers are others
///   .lm3       Bosphorus: labels as they stand
/// Names of other schemes: read_landmark_names (landmark_names.h).
Landmarks read_landmarks(const std::filesystem::path& path);

/// Reads 2D landmarks: pixels, the centre of the top-left pixel is (0, 0), y down.
///   .json   as above with two numbers, already in this convention
///   .pts    ibug: the file counts pixels from 1, so 1 is subtracted
///   .ljson  menpo: points are (y, x), already counted from 0
ImageLandmarks read_image_landmarks(const std::filesystem::path& path);

/// Writes any of these formats, atomically; numbers read back as the same. Only .json and .csv keep standard
/// deviations. Throws InvalidInput for names that a format cannot hold: .pts needs "1".."n" without gaps, .bnd
/// "bnd_1".."bnd_n", .tlms words without blanks; and for 2D landmarks in .pp, .mrk.json, .fcsv, .bnd and .lm3. Slicer's
/// files are written in LPS, as read; 2D .pts adds 1.
void write_landmarks(const std::filesystem::path& path, const Landmarks& landmarks);
void write_image_landmarks(const std::filesystem::path& path, const ImageLandmarks& landmarks);

}  // namespace facewright
