// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/camera.h"
#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"
#include "libmodel/render/linear_image.h"

namespace facewright {

enum class Shading { studio, none };

struct RenderOptions {
  int width = 800, height = 800;                                 ///< pixels
  int supersampling = 2;                                         ///< n x n samples per pixel, 1..4
  Shading shading = Shading::studio;                             ///< none: colours as they are (albedo)
  bool use_colours = true;                                       ///< false: clay grey, whatever the mesh has
  bool transparent = false;                                      ///< RGBA with the coverage as alpha, else RGB
  Eigen::Vector3d background = Eigen::Vector3d::Constant(0.86);  ///< linear RGB 0..1
  int threads = 0;                                               ///< 0 = all; the bytes do not depend on it
};

/// A picture of the mesh. Colour per point: `texture` through mesh.uv (and uv_faces) where both exist, filtered over
/// the pixel where it is finer (mip maps), blended by its alpha over mesh.colours or clay grey. Studio shading: a
/// hemispheric light from above and a soft key light from the upper left, fixed to the camera, on interpolated vertex
/// normals; back faces are shown dark. All is interpolated perspective-correctly; averaging is done in linear light.
/// Throws InvalidInput for an invalid mesh or options out of range.
Image render_mesh(const Mesh& mesh, const OrthographicCamera& camera, const RenderOptions& options = {},
                  const Image& texture = {});
Image render_mesh(const Mesh& mesh, const PerspectiveCamera& camera, const RenderOptions& options = {},
                  const Image& texture = {});
/// The same with a texture that is prepared once for many pictures.
Image render_mesh(const Mesh& mesh, const OrthographicCamera& camera, const RenderOptions& options,
                  const LinearImage& texture);
Image render_mesh(const Mesh& mesh, const PerspectiveCamera& camera, const RenderOptions& options,
                  const LinearImage& texture);

}  // namespace facewright
