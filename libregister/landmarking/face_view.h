// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libmodel/core/camera.h"
#include "libmodel/core/image.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/similarity.h"
#include "libmodel/render/linear_image.h"
#include "libmodel/render/rasterizer.h"

namespace facewright {

/// From where a face is looked at.
struct ViewAngle {
  double yaw = 0, pitch = 0;  ///< radians, see HeadPose
};

struct FaceViewOptions {
  int size = 640;                                    ///< pixels, width and height
  double field = 260;                                ///< mm of the head frame across the picture
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< mm, head frame: what lies in the picture's middle
  bool use_colour = true;                            ///< false: clay
  int threads = 1;                                   ///< the bytes do not depend on it
};

/// A picture of a surface, and what each pixel of it shows.
struct FaceView {
  OrthographicCamera camera;  ///< of scan coordinates
  Image image;
  Raster raster;
};

/// The camera that looks at a head, head_pose telling where it is in the scan.
OrthographicCamera view_camera(const Similarity& scan_from_head, const ViewAngle& angle,
                               const FaceViewOptions& options);

/// `texture`: nullptr if there is none.
FaceView look_at(const Mesh& mesh, const LinearImage* texture, const Similarity& scan_from_head, const ViewAngle& angle,
                 const FaceViewOptions& options);

struct BackProjectOptions {
  int disc = 3;     ///< pixels: radius around the point ...
  double jump = 4;  ///< ... in which depths may differ by so much, mm: more is an edge, or a surface seen too flat
};

/// The place that a point of the picture (pixels) shows; nothing where the picture is empty near it or the depth jumps.
std::optional<Eigen::Vector3d> back_project(const FaceView& view, const Mesh& mesh, const Eigen::Vector2d& pixel,
                                            const BackProjectOptions& options = {});

}  // namespace facewright
