// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "libmodel/model/morphable_model.h"

namespace facewright {

/// "auto" leaves a decision to what the format defines and the geometry shows.
struct ImportOptions {
  std::string format = "auto";   ///< one of import_format_names()
  std::string units = "auto";    ///< um, mm, cm, m
  std::string winding = "auto";  ///< keep, turn
  std::string axes = "auto";     ///< which axes of the file are ours, such as "x z -y": left, up, out of the face
  std::string values = "auto";   ///< what stands beside the basis: variance, sigma; or columns: nothing does
  std::string colours = "auto";  ///< linear, srgb
  bool keep_columns = false;     ///< of a basis that is not orthogonal: coefficients keep their meaning
  int identity_modes = -1;       ///< FLAME: leading columns that are identity; -1 = as the file says
  int leading_vertices = 0;      ///< only the first ones and the triangles among them; 0 = all
  std::filesystem::path blendshapes{};  ///< eos: the file of blendshapes beside the model
  std::filesystem::path isomap{};       ///< texture coordinates as text, "x y" per vertex, y down
};

struct ImportResult {
  MorphableModel model;                ///< mm, +x the subject's left, +y up, +z out of the face, linear RGB
  std::string format;                  ///< what the file was found to be
  std::vector<std::string> decisions;  ///< units, axes, winding, index base, scaling of the basis, colours, left out
};

/// "facewright", "statismo" (scalismo, BFM 2017 and 2019), "eos", "bfm2009", "lsfm", "lyhm", "scm", "ict", "flame",
/// "npz", "glb".
const std::vector<std::string>& import_format_names();

/// Which of them a file or folder is, by its content. Throws IoError for others, with what to do about it.
std::string sniff_model_format(const std::filesystem::path& path);

/// Reads a model of another program. Every decision is checked against the geometry where that can tell: a face is 120
/// to 350 mm high, its triangles point outward, an open face looks along +z. What the file leaves open is an IoError
/// that names the candidates and the option to choose with. The decisions also go to the model's provenance. Models of
/// another program have one level. Throws InvalidInput for unknown option values.
ImportResult import_model(const std::filesystem::path& path, const ImportOptions& options = {});

}  // namespace facewright
