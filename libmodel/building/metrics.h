// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <vector>

#include "libmodel/core/progress.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/core/similarity.h"

namespace facewright {

/// How scans are aligned when some are left out.
enum class FoldAlignment {
  none,     ///< samples are used as they are (colours)
  shared,   ///< one alignment of all scans; each left-out scan is then moved onto the mean of the others
  per_fold  ///< Procrustes anew without the left-out scans, then these onto its mean: nothing is shared
};

struct MetricsOptions {
  std::vector<int> modes;  ///< mode counts M >= 0 to measure at; empty = 0, 1, .., as many as there can be
  int folds = 0;           ///< 0 = leave one out; else k >= 2 folds, scan i in fold i mod k
  FoldAlignment alignment = FoldAlignment::shared;
  Scaling scaling = Scaling::fixed;  ///< of Procrustes, as for the model
  int samples = 1000;                ///< random faces of the specificity [davies2002]
  int surface_samples = 100;         ///< of these, the first so many are measured to the surface too
  int surface_vertices = 2000;       ///< vertices, evenly strided, that surface distances are taken at; 0 = none
  std::uint64_t seed = 1;            ///< of the random faces
  int keep = 0;                      ///< reconstructions to return, of the first scans with all modes
  int threads = 0;                   ///< 0 = all
};

/// Samples in correspondence and how to measure them; S samples of N vertices.
struct MetricsInput {
  SampleMatrix samples;               ///< (S x 3N) mm, or linear RGB
  Faces F;                            ///< (M x 3); empty: no surface distances
  std::vector<int> landmarks;         ///< vertices; empty: no landmark distances
  Vertices reference;                 ///< (N x 3) pose of the mean in alignments
  Eigen::VectorXd alignment_weights;  ///< (N) >= 0 of Procrustes
  Eigen::VectorXd distance_weights;   ///< (N) >= 0 of the mean over vertices, e.g. areas
  SampleMatrix targets;  ///< (S x 3N) in the frames of the samples, or empty: what reconstructions are held against too
  SampleMatrix visibility;  ///< (S x N) 0..1 or empty: further weights of the mean over vertices
};

/// A quantity against the number of modes.
struct MetricCurve {
  std::vector<int> modes;
  Eigen::VectorXd value, standard_error;  ///< (modes) mean over items, and its standard error
  Eigen::MatrixXd items;                  ///< (items x modes) what the mean is of: scans or random faces; may be empty
  bool empty() const { return modes.empty(); }
};

/// One distance each: between corresponding vertices (weighted mean of Euclidean distances), between the landmark
/// vertices (mean), and from the vertices of the first surface to the nearest points of the second (weighted mean).
struct DistanceCurves {
  MetricCurve vertices, landmarks, surface;
};

struct CompactnessResult {
  MetricCurve variance;       ///< C(M) = l_1 + .. + l_M; no items
  Eigen::VectorXd share;      ///< (modes) of the total variance
  Eigen::VectorXd variances;  ///< l_k, all there are
  double total_variance = 0;  ///< sum of the variances of all 3N entries
};

struct GeneralisationResult {
  DistanceCurves own;      ///< to the left-out sample itself; per scan
  DistanceCurves target;   ///< to its target; empty without targets
  Eigen::MatrixXd errors;  ///< (N x 1 or 2) per vertex, mean over scans with the most modes: own, target
  SampleMatrix kept;       ///< (keep x 3N) reconstructions of the first scans, in the frames of the samples
  int fold_count = 0;
  int fewest_training = 0;  ///< scans in the smallest training set; curves end at one mode less
};

struct SpecificityResult {
  DistanceCurves nearest;  ///< per random face; surface: of the first `surface_samples`, at some of the mode counts
};

/// The input with its samples moved onto their common mean by generalised Procrustes [gower1975], targets along with
/// them. Nothing happens with FoldAlignment::none. Throws InvalidInput for no samples or sizes that differ.
MetricsInput align_samples(MetricsInput input, const MetricsOptions& options = {});

/// Variance explained by the first M modes of PCA of the samples as they are. Standard error: that of the sum of
/// eigenvalues of a Gaussian sample, sqrt(2 / (S - 1) sum l_k^2). O(S^2 N + S^3).
CompactnessResult compactness(const MetricsInput& input, const MetricsOptions& options = {});

/// Mean error of reconstructing a sample with M modes of a model of the others [davies2002, styner2003]. The models of
/// all folds come from one Gram matrix, recentred and cut down to the training samples, and reconstructions are linear
/// combinations of these, so that nothing is fitted twice. A left-out scan is moved onto the mean of the others
/// (least squares over all vertices, which rewards it a little, as fitting does); shared alignment lets it have a say
/// in the pose of the others, per_fold does not. Curves end at the rank a fold can have; one sample gives empty ones.
/// O(S^2 (N modes + S^2)) for leave one out. The same bytes for any number of threads.
GeneralisationResult generalisation(const MetricsInput& aligned, const MetricsOptions& options = {},
                                    const Progress& progress = {});

/// Mean distance of random faces of a model of all samples, with M modes, to the nearest sample [davies2002]. Nearest
/// is meant in the sum of squared coordinate differences, found exactly in the space of the modes; the distances are
/// then taken to that sample. Coefficients are N(0, 1), those of face i are the same for all M and in all sets.
SpecificityResult specificity(const MetricsInput& aligned, const MetricsOptions& options = {},
                              const Progress& progress = {});

/// Ratio of two curves of the same items and modes, a / b, and the standard error of the ratio of means, which respects
/// that items are pairs. Modes that only one has are left out.
MetricCurve ratio(const MetricCurve& a, const MetricCurve& b);

}  // namespace facewright
