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
#include "libmodel/render/simd4.h"

namespace facewright {

/// What varies over the triangles of a picture; with perspective all of it is divided by w, which is linear on screen.
enum class Channel { u, v, lod, normal_x, normal_y, normal_z, red, green, blue, inverse_w };
constexpr size_t kChannelCount = 10;

/// What a picture shows on its triangles, per vertex.
struct PaintedMesh {
  const Mesh* mesh = nullptr;
  ProjectedVertices projected;
  Vertices normals;                      ///< (N x 3) in camera axes; empty: no shading
  bool coloured = false;                 ///< mesh.colours, else clay grey
  const LinearImage* texture = nullptr;  ///< or none
  TexCoords texels;                      ///< rows of mesh.uv as pixels of the texture
  Eigen::VectorXf lod;                   ///< (N) log2 of texels per pixel; empty: at most one

  bool shows_colours() const { return coloured && !(texture && texture->opaque()); }
};

/// Every channel in use as a plane on the screen, for every triangle: worked out once, used in each of its rows.
class ChannelPlanes {
 public:
  struct Plane {
    float value, dx, dy;  ///< at the triangle's first corner
  };
  ChannelPlanes(const PaintedMesh& scene, const ScanList& list);

  const std::vector<Channel>& channels() const { return channels_; }
  const Plane* of(int triangle) const { return planes_.data() + static_cast<size_t>(triangle) * channels_.size(); }
  bool faces_away(int triangle) const { return away_[static_cast<size_t>(triangle)] != 0; }

 private:
  void add(const PaintedMesh& scene, int f, const BarycentricPlanes& b);
  std::vector<Channel> channels_;
  std::vector<Plane> planes_;  ///< (M x channels)
  std::vector<char> away_;
};

/// Log2 of the texels per screen pixel at each vertex, the larger of the two directions, the mean over its triangles;
/// empty if there is at most one everywhere.
Eigen::VectorXf texture_lod(const Mesh& mesh, const ProjectedVertices& projected, const TexCoords& texels);

/// Colours the covered pixels of one row after the other. Attributes go into one array each, row-long, so that most of
/// the work is done four numbers at a time. One per thread.
class RowPainter {
 public:
  RowPainter(const PaintedMesh& scene, const ChannelPlanes& planes, int width);

  /// Row y; colours are then in colours()[x] for x in each of spans(), columns of the screen.
  void paint(const VisibilityRows& rows, int y);
  const std::vector<std::pair<int, int>>& spans() const { return spans_; }
  /// Linear, at most 1.
  const Float4* colours() const { return colours_.data(); }

 private:
  void add_run(int f, int y, int begin, int end);
  void undo_perspective(int begin, int end);
  void light(int begin, int end);
  void base(int begin, int end);
  void texture(int begin, int end);
  void shade(int begin, int end);
  std::vector<float>& values(Channel k) { return channels_[static_cast<size_t>(k)]; }
  float* row(Channel k) { return values(k).data(); }

  const PaintedMesh& scene_;
  const ChannelPlanes& planes_;
  std::array<std::vector<float>, kChannelCount> channels_;
  std::vector<float> gain_;                     ///< light; empty: no shading
  std::vector<LinearImage::Sampler> samplers_;  ///< per level of the texture
  std::vector<Float4> colours_;
  std::vector<std::pair<int, int>> spans_;
};

}  // namespace facewright
