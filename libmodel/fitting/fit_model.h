// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include "libmodel/core/image.h"
#include "libmodel/fitting/complete_texture.h"
#include "libmodel/fitting/fit_landmarks.h"
#include "libmodel/fitting/fit_perspective.h"
#include "libmodel/fitting/texture.h"

namespace facewright {

struct FitModelOptions {
  FitOptions fit;
  TextureOptions texture;
  CompletionOptions completion;
  int level = -1;          ///< model level of the mesh, -1 = finest
  int frontal_size = 512;  ///< pixels along each side of the frontal view
  int threads = 0;         ///< 0 = all
};

/// What a fit makes of its image.
struct FittedFace {
  Mesh mesh;              ///< the fitted face in the model's frame, mm, with uv and the model's mean colours if any
  TextureResult texture;  ///< empty isomap if the model has no texture coordinates
  CompletedTexture completed;  ///< the texture without holes and what is invented in it; empty without uv
  Image frontal;               ///< the face with the completed texture from the front, RGB
  Image overlay;               ///< the image with the fit's wireframe, the landmarks (green) and their fit (red)
};

struct FitModelResult : FittedFace {
  FitResult fit;
};

/// The whole of fitting: landmarks to pose and shape, image to isomap, frontal view and overlay.
FitModelResult fit_model(const MorphableModel& model, const Image& image, const ImageLandmarks& landmarks,
                         const FitModelOptions& options = {}, const LandmarkMapper& mapper = {});

struct PerspectiveModelOptions {
  PerspectiveFitOptions fit;  ///< without a prior focal length: 1.2 times the image's longer side
  bool centred = true;        ///< the principal point is the image's centre, whatever fit.camera.principal says
  TextureOptions texture;
  CompletionOptions completion;
  int level = -1;          ///< as above, ...
  int frontal_size = 512;  ///< ... pixels ...
  int threads = 0;         ///< ... 0 = all
};
struct PerspectiveModelResult : FittedFace {
  PerspectiveFitResult fit;
};

/// The same under a pinhole camera: fit_landmarks_perspective, and texture and overlay through its camera.
PerspectiveModelResult fit_model(const MorphableModel& model, const Image& image, const ImageLandmarks& landmarks,
                                 const PerspectiveModelOptions& options, const LandmarkMapper& mapper = {});

/// The textured face without shading, size x size, RGB, the head turned by yaw and pitch (radians, see HeadPose).
Image textured_view(const Mesh& mesh, const Image& texture, int size, double yaw, double pitch = 0, int threads = 0);
/// The same from the front.
Image frontal_view(const Mesh& mesh, const Image& isomap, int size, int threads = 0);

/// The image under the fit: visible edges of (V, F), measured landmarks as green crosses, fitted ones as red discs.
Image fit_overlay(const Image& image, const Vertices& V, const Faces& F, const FitResult& fit);
Image fit_overlay(const Image& image, const Vertices& V, const Faces& F, const PerspectiveFitResult& fit);

}  // namespace facewright
