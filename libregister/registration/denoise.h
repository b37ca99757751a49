// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>

#include "libmodel/core/mesh.h"

namespace facewright {

enum class DenoiseMethod { automatic, gaussian, median, none };

struct DenoiseOptions {
  DenoiseMethod method =
      DenoiseMethod::automatic;  ///< automatic: spikes always, Gaussian where the noise is above the gate
  double noise_gate = 0.05;    ///< mm; below it the Gaussian filter is skipped and a clean scan comes out bit-identical
  double spike_deviation = 6;  ///< spike: this many noise deviations off its neighbours' median height, and ...
  double spike_isolation =
      1.8;  ///< ... all its edges longer than this many times the local median edge (measured: skin stays below 1.5)
  double gaussian_width = 1.0;    ///< kernel deviation in mean edge lengths
  int passes = 1;                 ///< Gaussian or median passes over the whole scan
  double highest_flagged = 0.05;  ///< share of vertices above which the spike verdict is not believed
};

struct DenoiseSummary {
  double noise = 0;       ///< estimated standard deviation along the normal, mm
  int spikes = 0;         ///< vertices put back among their neighbours
  int filtered = 0;       ///< vertices moved by the Gaussian or median filter
  double rms_motion = 0;  ///< mm, of the filtered vertices
};

struct DenoiseResult {
  Mesh mesh;                    ///< same connectivity and attributes
  Eigen::VectorXd reliability;  ///< (N) 0..1: 0 on ragged border, 0.3 for mended spikes, less on stretched triangles
  DenoiseSummary summary;
};

/// Noise standard deviation of a scan along its normals, mm: robust residual of quadrics fitted to two-ring
/// neighbourhoods of up to 4000 vertices. 0 for meshes too small to tell.
double estimate_noise(const Vertices& V, const Faces& F);

/// Removes spikes and noise from a range-like scan. Motion is along the normal only, so that nothing drifts sideways;
/// the Gaussian filter projects onto a local weighted quadric, which removes the shrinkage a plain mean would cause;
/// border vertices do not move. Cost O(N), some 0.3 s at 60,000 vertices.
DenoiseResult denoise(const Mesh& scan, const DenoiseOptions& options = {});

}  // namespace facewright
