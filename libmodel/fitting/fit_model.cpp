// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/fit_model.h"

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/overlays.h"
#include "libmodel/render/render_mesh.h"

namespace facewright {

Image textured_view(const Mesh& mesh, const Image& texture, int size, double yaw, double pitch, int threads) {
  RenderOptions options;
  options.width = options.height = size;
  options.shading = Shading::none;
  options.threads = threads;
  return render_mesh(mesh, frame_camera(mesh.V, size, size, yaw, pitch), options, texture);
}

Image frontal_view(const Mesh& mesh, const Image& isomap, int size, int threads) {
  return textured_view(mesh, isomap, size, 0, 0, threads);
}

namespace {

template <typename Fit>
Image overlay(const Image& image, const Vertices& V, const Faces& F, const Fit& fit) {
  Image out = to_rgb(image);
  draw_wireframe(out, V, F, fit.camera, {90, 170, 255}, 0.25);
  const double radius = std::max(2.0, fit.summary.outer_eye_distance_px / 50);
  for (const LandmarkResidual& r : fit.summary.residuals) {
    draw_disc(out, r.fitted, 0.6 * radius, r.used ? Rgb{230, 30, 40} : Rgb{150, 150, 150});
    draw_cross(out, r.measured, radius, {30, 220, 60}, std::max(1.0, radius / 3));
  }
  return out;
}

/// Mesh, texture and pictures of a fit.
template <typename Fit, typename Options>
void show(const MorphableModel& model, const Image& image, const Fit& fit, const Options& options, FittedFace& face) {
  face.mesh = fitted_mesh(model, fit, options.level);
  if (face.mesh.has_uv()) {
    TextureOptions texture = options.texture;
    texture.threads = options.threads;
    const IsomapTexels texels = isomap_texels(face.mesh, texture.size);
    face.texture = extract_texture(face.mesh, texels, image, fit.camera, texture);
    face.completed = complete_texture(model, options.level, face.texture.isomap, texels, options.completion);
  }
  face.frontal = frontal_view(face.mesh, face.completed.texture, options.frontal_size, options.threads);
  const int coarse = model.vertex_count(0);  // a finer wireframe would hide the image
  face.overlay = fit_overlay(image, face.mesh.V.topRows(coarse), model.faces(0), fit);
}

}  // namespace

Image fit_overlay(const Image& image, const Vertices& V, const Faces& F, const FitResult& fit) {
  return overlay(image, V, F, fit);
}

Image fit_overlay(const Image& image, const Vertices& V, const Faces& F, const PerspectiveFitResult& fit) {
  return overlay(image, V, F, fit);
}

FitModelResult fit_model(const MorphableModel& model, const Image& image, const ImageLandmarks& landmarks,
                         const FitModelOptions& options, const LandmarkMapper& mapper) {
  if (image.empty()) throw InvalidInput("fit: the image is empty");
  FitModelResult result;
  result.fit = fit_landmarks(model, landmarks, options.fit, mapper);
  show(model, image, result.fit, options, result);
  return result;
}

PerspectiveModelResult fit_model(const MorphableModel& model, const Image& image, const ImageLandmarks& landmarks,
                                 const PerspectiveModelOptions& options, const LandmarkMapper& mapper) {
  if (image.empty()) throw InvalidInput("fit: the image is empty");
  PerspectiveFitOptions fit = options.fit;
  if (options.centred) fit.camera.principal = Eigen::Vector2d(image.width - 1, image.height - 1) / 2;
  if (fit.camera.prior_focal_px <= 0) fit.camera.prior_focal_px = 1.2 * std::max(image.width, image.height);
  PerspectiveModelResult result;
  result.fit = fit_landmarks_perspective(model, landmarks, fit, mapper);
  show(model, image, result.fit, options, result);
  return result;
}

}  // namespace facewright
