// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "libmodel/building/fill_unseen.h"
#include "libmodel/building/gain_balance.h"
#include "libmodel/building/pca.h"
#include "libmodel/building/pca_out_of_core.h"
#include "libmodel/building/procrustes.h"
#include "libmodel/building/prune.h"
#include "libmodel/building/sample_store.h"
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
  double unseen_weight = 0.2;                     ///< (0, 1]; of vertices no camera saw in Procrustes
  PcaSolver solver = PcaSolver::automatic;        ///< of shape and colour
  double prune_quantile = 0;                      ///< 0 = off, or < 1: leave out scans beyond this quantile [booth2016]
  int prune_modes = 50;                           ///< leading modes that pruning looks at [booth2016]
  int first_level = 1;                            ///< template level that becomes level 0 of the model
  GainBalance gain_balance = GainBalance::none;   ///< of colours, before they are filled
  FillUnseenOptions fill;                         ///< of colours no camera saw
  int threads = 0;                                ///< 0 = all
  std::map<std::string, std::string> provenance;  ///< kept in the model
};

struct BuildModelSummary {
  PruneResult pruned;  ///< rows of the set as given; empty when pruning is off
  ProcrustesSummary procrustes;
  PcaSummary shape, colour;
  FillUnseenSummary fill;
  Eigen::MatrixXd gains;                            ///< (S'' x 3) colours were divided by; empty without balance
  std::vector<double> shape_shares, colour_shares;  ///< cumulative share of the total variance after 1, 2, ... modes
};

struct BuildModelResult {
  MorphableModel model;
  std::vector<int> scans;                   ///< (S') rows of the set that the model is made of: all, but for pruning
  std::vector<int> colour_scans;            ///< (S'') those of them with colours
  Eigen::MatrixXd shape_scores;             ///< (S' x K) coefficients of these scans, in standard deviations
  Eigen::MatrixXd colour_scores;            ///< (S'' x K') the same of colours
  std::vector<Similarity> mean_from_scans;  ///< (S') the alignment of each, with its scale
  BuildModelSummary summary;
};

/// From scans in correspondence to a model: rigid Procrustes weighted by area and by what was seen, PCA of shape, PCA
/// of colour, of the scans that have any, after filling what was not seen; with pruning, scans that lie too far out are
/// found by a first PCA of shape and the rest aligned anew. The levels are those of the template from `first_level` on,
/// and so are landmarks, symmetry and parents. Texture coordinates are made from the mean: see isomap_texture
/// (libmodel/uv) and MorphableModel::with_uv. One scan gives a model without modes. Throws InvalidInput for an empty
/// set or one that does not fit the template.
BuildModelResult build_model(const RegisteredSet& scans, const MultiresTemplate& reference,
                             const BuildModelOptions& options = {}, const Progress& progress = {});

/// The same from samples on disk, for sets that do not fit into memory: `shapes` is realigned in place, pruned scans
/// are removed from it. `colours`, or null, has the ids of those that have colours, in the same order; what was not
/// seen must have been filled (UnseenFill). `visibility` as RegisteredSet::visibility. Transforms are those of the
/// store.
BuildModelResult build_model(SampleStore& shapes, SampleStore* colours, const MultiresTemplate& reference,
                             const BuildModelOptions& options = {}, const SampleVisibility& visibility = {},
                             const Progress& progress = {});

}  // namespace facewright
