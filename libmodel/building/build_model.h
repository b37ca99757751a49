// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/building/fill_unseen.h"
#include "libmodel/building/pca.h"
#include "libmodel/building/procrustes.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/progress.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

struct BuildModelOptions {
  double variance_share = 0.99;                   ///< (0, 1]; of the shape variance to keep [huber2016]
  double colour_variance_share = 0.99;            ///< (0, 1]; of the colour variance to keep [huber2016]
  int max_modes = -1;                             ///< -1 = as many as the shares need
  Scaling scaling = Scaling::fixed;               ///< of Procrustes; fixed keeps head size in the model [huber2016]
  double rim_weight = 0.2;                        ///< 0..1; of vertices of the template's region "rim" in Procrustes
  int first_level = 1;                            ///< template level that becomes level 0 of the model
  FillUnseenOptions fill;                         ///< of colours no camera saw
  int threads = 0;                                ///< 0 = all
  std::map<std::string, std::string> provenance;  ///< kept in the model
};

struct BuildModelSummary {
  ProcrustesSummary procrustes;
  PcaSummary shape, colour;
  FillUnseenSummary fill;
  std::vector<double> shape_shares, colour_shares;  ///< cumulative share of the total variance after 1, 2, ... modes
};

struct BuildModelResult {
  MorphableModel model;
  Eigen::MatrixXd shape_scores, colour_scores;  ///< (S x K) coefficients of the scans, in standard deviations
  std::vector<Similarity> mean_from_scans;      ///< (S) the alignment of each scan
  BuildModelSummary summary;
};

/// From scans in correspondence to a model: rigid Procrustes weighted by area, PCA of shape, PCA of colour after
/// filling what was not seen. The levels are those of the template from `first_level` on, and so are landmarks,
/// symmetry and parents. Texture coordinates are made from the mean: see isomap_texture (libmodel/uv) and
/// MorphableModel::with_uv. One scan gives a model without modes. Throws InvalidInput for an empty set or one that does
/// not fit the template.
BuildModelResult build_model(const RegisteredSet& scans, const MultiresTemplate& reference,
                             const BuildModelOptions& options = {}, const Progress& progress = {});

}  // namespace facewright
