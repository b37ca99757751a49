// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/render/linear_image.h"
#include "libmodel/render/projection.h"
#include "libmodel/render/scan_conversion.h"

namespace facewright {

/// What a picture shows on its triangles: everything that varies over them, per vertex.
struct PaintedMesh {
  const Mesh* mesh = nullptr;
  ProjectedVertices projected;
  Vertices normals;                      ///< (N x 3) in camera axes; empty: no shading
  bool coloured = false;                 ///< mesh.colours, else clay grey
  const LinearImage* texture = nullptr;  ///< or none
  TexCoords texels;                      ///< rows of mesh.uv as pixels of the texture
  Eigen::VectorXf lod;                   ///< (N) log2 of texels per pixel; empty: at most one
};

/// Log2 of the texels per screen pixel at each vertex, the larger of the two directions, the mean over its triangles;
/// empty if there is at most one everywhere.
Eigen::VectorXf texture_lod(const Mesh& mesh, const ProjectedVertices& projected, const TexCoords& texels);

/// Colours the covered pixels of one row after the other. Attributes go into one array each, row-long, so that most of
/// the work is done four numbers at a time. One per thread.
class RowPainter {
 public:
  RowPainter(const PaintedMesh& scene, int width);

  /// Row y; colours are then in colour(x) for x in each of spans(), columns of the screen.
  void paint(const VisibilityRows& rows, int y);
  const std::vector<std::pair<int, int>>& spans() const { return spans_; }
  /// Linear, at most 1.
  const Rgba& colour(int x) const { return colours_[static_cast<size_t>(x)]; }

 private:
  enum Channel { kU, kV, kLod, kNormalX, kNormalY, kNormalZ, kRed, kGreen, kBlue, kInverseW, kGain, kChannels };
  void add_run(int f, int y, int begin, int end);
  void undo_perspective(int begin, int end);
  void light(int begin, int end);
  void shade(int begin, int end);
  float* row(Channel k) { return channels_[k].data(); }

  const PaintedMesh& scene_;
  bool base_colours_ = false;
  std::array<std::vector<float>, kChannels> channels_;
  std::vector<Rgba, Eigen::aligned_allocator<Rgba>> colours_;
  std::vector<std::pair<int, int>> spans_;
};

}  // namespace facewright
