// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/building/pca.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/core/similarity.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

/// Whose face a registered scan is, and what it does.
struct ExpressionLabel {
  std::string subject;
  std::string expression;  ///< empty: neutral
};

struct ExpressionBuildOptions {
  double variance_share = 0.99;  ///< (0, 1]; of the displacements' variance to keep
  double still_mm = 0.5;    ///< > 0; a vertex that differs by this much counts half when a scan is laid on its neutral
  int max_iterations = 30;  ///< of that alignment
  int threads = 0;          ///< 0 = all
};

struct ExpressionSummary {
  int scans = 0;                             ///< with an expression, of a subject with a neutral scan
  int subjects = 0;                          ///< of these scans
  std::map<std::string, int> scans_of;       ///< per expression
  std::vector<std::string> without_neutral;  ///< subjects whose expressions could not be used
  std::map<std::string, double> rms_mm;      ///< root mean square displacement of each blendshape
  PcaSummary pca;
  ExpressionBuildOptions options;
};

struct ExpressionResult {
  std::optional<PcaModel> expression;   ///< displacements from neutral, with their mean; nothing without scans
  std::vector<Blendshape> blendshapes;  ///< by name: the mean displacement over people, one voice each
  ExpressionSummary summary;
};

/// Expressions from scans of the same people: each is laid on its subject's neutral face (the mean of several) by a
/// rigid motion that looks at what does not move - weights fall with the distance [geman1987], starting from the
/// regions forehead and nose, if the template has them -, and the neutral on the model's mean, so that displacements
/// are in the model's frame. `labels` (S) belong to the scans; `mean` (N x 3) is the identity model's. Throws
/// InvalidInput for sizes that differ. O(S N).
ExpressionResult build_expressions(const RegisteredSet& scans, const std::vector<ExpressionLabel>& labels,
                                   const MultiresTemplate& reference, const Vertices& mean,
                                   const ExpressionBuildOptions& options = {});

/// The rigid motion that takes A (N x 3) to B (N x 3) by what stays: iteratively reweighted with (1 + d^2 /
/// scale^2)^-2, d the distance of a vertex. `weights` (N) >= 0 start it and stay a factor; the first estimate is their
/// plain least squares, and the scale falls from the median distance to `scale` in mm.
Similarity align_still_parts(const Vertices& A, const Vertices& B, const Eigen::VectorXd& weights, double scale,
                             int iterations);

}  // namespace facewright
