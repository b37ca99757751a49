// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libmodel/core/mesh.h"

namespace facewright {

enum class DenoiseMethod {
  automatic,  ///< spikes always; the quadrics where the noise is above the gate
  gaussian,   ///< quadrics always
  median,
  none,
  bilateral,
};

/// Defaults are measured: docs/denoising.md.
struct DenoiseOptions {
  DenoiseMethod method = DenoiseMethod::automatic;
  double noise_gate = 0.05;       ///< mm, >= 0; below it no filter runs and a clean scan comes out bit-identical
  double spike_deviation = 6;     ///< the surface jumps where an edge rises by this many noise deviations and ...
  double spike_isolation = 1;     ///< ... this many mean edge lengths along the normal; a spike jumps all round
  double spike_roughness = 5;     ///< a spike rises above the skin around it by this many of that skin's deviations
  int largest_cluster = 24;       ///< vertices, >= 1; larger pieces between jumps are skin
  double highest_flagged = 0.05;  ///< share of vertices above which the spike verdict is not believed
  double gaussian_width = 7;      ///< reach of the quadrics' weights, mean edge lengths
  int widest = 6;                 ///< rings of the quadrics' widest window, >= 2, ...
  double widest_mm = 12;          ///< ... which ends here, mm: on a coarse scan two rings are wide already
  double agreement = 2;           ///< a wider window is taken while quadrics agree within this many deviations, and ...
  double misfit = 2.75;           ///< ... the residuals exceed what noise explains by no more than this many
  int passes = 1;                 ///< of the filter over the whole scan
  double bilateral_sigma = 0.35;  ///< difference of unit normals at which a neighbour counts exp(-1/2) [zheng2011]
  int normal_passes = 0;          ///< of the bilateral filter over the normals; 0: 1 to 8 by the noise
  int vertex_passes = 10;         ///< of fitting vertices to normals [sun2007]
};

struct DenoiseSummary {
  double noise = 0;       ///< estimated standard deviation along the normal, mm
  int spikes = 0;         ///< vertices put back among their neighbours
  int filtered = 0;       ///< vertices moved by the filter
  double rms_motion = 0;  ///< mm, of the filtered vertices
};

struct DenoiseResult {
  Mesh mesh;                    ///< same connectivity and attributes
  Eigen::VectorXd reliability;  ///< (N) 0..1: 0 on borders and the ragged curtains along them, 0.3 for mended
                                ///< spikes, less than 1 on stretched triangles
  std::vector<int> spikes;      ///< vertices put back among their neighbours, ascending
  DenoiseSummary summary;
};

/// Noise standard deviation of a scan along its normals, mm: robust residual of quadrics fitted to two-ring
/// neighbourhoods of up to 4000 vertices. 0 for meshes too small to tell.
double estimate_noise(const Vertices& V, const Faces& F);

/// Removes spikes and noise from a range-like scan; connectivity and attributes stay. Quadrics and medians move
/// vertices along the normal only, so that nothing drifts sideways, and a quadric takes off the shrinkage of a plain
/// mean. Border vertices are filtered along their own curve. Islands are not looked for: repair_mesh() drops them;
/// holes stay open. Throws InvalidInput for options out of range. Cost O(N), 0.2 s of CPU at 60,000 vertices.
DenoiseResult denoise(const Mesh& scan, const DenoiseOptions& options = {});

}  // namespace facewright
