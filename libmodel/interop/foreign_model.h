// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/interop/import_model.h"

namespace facewright {

// Private to this module: a model as a file of another program has it, before units, axes, winding and scaling of the
// basis are settled.

/// What the numbers beside the columns of a basis are.
enum class ModeScale {
  variances,  ///< unit columns, variances
  sigmas,     ///< unit columns, standard deviations
  columns     ///< no numbers: each column is the step of one standard deviation
};

struct ForeignModes {
  Eigen::VectorXd mean;     ///< (3N)
  Eigen::MatrixXd columns;  ///< (3N x K)
  Eigen::VectorXd values;   ///< (K), empty for ModeScale::columns
  ModeScale scale = ModeScale::variances;
  bool empty() const { return mean.size() == 0; }
};

/// Of the numbers for colours.
enum class ColourSpace { linear, srgb };

struct ForeignModel {
  std::string path, format;  ///< format as people call it: "Basel Face Model 2009 (.mat)"
  ForeignModes shape, colour;
  std::optional<ForeignModes> expression;
  std::vector<Blendshape> blendshapes;
  Faces F;                               ///< 0-based
  TexCoords uv;                          ///< v up, or empty
  std::map<std::string, int> landmarks;  ///< 0-based vertices
  std::string units;                     ///< of the format: "um", "mm", "cm", "m"; empty: not defined
  bool inward = false;                   ///< the format's triangles are clockwise seen from outside
  ColourSpace colour_space = ColourSpace::linear;
  double colour_range = 1;         ///< white, 1 or 255
  std::vector<std::string> notes;  ///< decisions of the reader
};

/// Triangles that count from 0. `base` is what the format says; what the numbers themselves prove goes first. Throws
/// IoError for indices beyond n vertices.
Faces zero_based(Faces F, int n, int base, ForeignModel& model);

/// The readers. All throw IoError.
ForeignModel read_bfm2009(const std::filesystem::path& path);
ForeignModel read_lsfm(const std::filesystem::path& path);
ForeignModel read_lyhm(const std::filesystem::path& path);
ForeignModel read_scm(const std::filesystem::path& path);
ForeignModel read_ict_folder(const std::filesystem::path& folder);
/// `identity_modes`: how many of the columns are identity, -1 = as the file says, 300 of FLAME's 400, else all.
ForeignModel read_flame(const std::filesystem::path& path, int identity_modes);
/// A model read by other means, taken apart.
ForeignModel foreign_model(const MorphableModel& model, const std::string& path, const std::string& format);

/// Puts the model into millimetres, triangles outward, axes as asked, bases orthonormal with variances, colours linear;
/// says what was decided. Throws IoError, naming the candidates, where the file leaves it open.
ImportResult settle(ForeignModel model, const ImportOptions& options);

/// Parts of settle: the basis alone (columns kept as they are if asked), the colours alone.
PcaModel settled_modes(ForeignModes modes, const std::string& what, bool keep_columns,
                       std::vector<std::string>& decisions);
PcaModel linearised_colours(const PcaModel& encoded, std::vector<std::string>& decisions);

}  // namespace facewright
