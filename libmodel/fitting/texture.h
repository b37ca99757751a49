// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/camera.h"
#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"
#include "libmodel/render/isomap_texels.h"

namespace facewright {

struct TextureOptions {
  int size = 512;               ///< texels along each side of the isomap [huber2016]
  double hidden_cosine = 0.17;  ///< cosine of the angle to the viewer (80 degrees) at which alpha reaches 0
  double full_cosine = 0.5;     ///< 60 degrees: from here on alpha is 1
  double depth_bias = 0.005;    ///< share of the face's depth by which a point may lie behind the visible surface
  int depth_resolution = 768;  ///< most pixels of the z-buffer along the face's longer side; never finer than the image
  int threads = 0;             ///< 0 = all; the bytes do not depend on it
};

struct TextureSummary {
  int mapped_texels = 0;   ///< covered by the texture map
  int visible_texels = 0;  ///< of these, with alpha > 0
  double mean_alpha = 0;   ///< over the mapped texels, 0..1
  double resolution = 0;   ///< image pixels per texel, the root of the mean over visible texels of the area
};
struct TextureResult {
  Image isomap;  ///< (size x size) RGBA; alpha 0: hidden, outside the image or outside the map
  TextureSummary summary;
};

/// Takes the colours of the posed face from the image into its texture map. Per texel centre ((i + .5) / size): the
/// surface point, its pixel under the camera, a bilinear sample in linear light, averaged over the texel's footprint
/// where the image is finer than the map. alpha = smoothstep(n . v, hidden_cosine, full_cosine), and 0 where a z-buffer
/// of the mesh finds something nearer. Hidden texels show mesh.colours if there are any, so that viewers that ignore
/// alpha show a face; see complete_texture for better. `mesh` needs uv (V, or uv_faces). Throws InvalidInput otherwise,
/// or for options out of range.
TextureResult extract_texture(const Mesh& mesh, const Image& image, const AffineCamera& camera,
                              const TextureOptions& options = {});
TextureResult extract_texture(const Mesh& mesh, const Image& image, const PerspectiveCamera& camera,
                              const TextureOptions& options = {});
/// The same with the map's texels prepared for many images; options.size is that of the texels.
TextureResult extract_texture(const Mesh& mesh, const IsomapTexels& texels, const Image& image,
                              const AffineCamera& camera, const TextureOptions& options = {});
TextureResult extract_texture(const Mesh& mesh, const IsomapTexels& texels, const Image& image,
                              const PerspectiveCamera& camera, const TextureOptions& options = {});

}  // namespace facewright
