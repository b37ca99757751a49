// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/render/linear_image.h"
#include "libmodel/render/projection.h"
#include "libmodel/render/scan_conversion.h"
#include "libmodel/render/srgb_encoder.h"

namespace facewright {
namespace {

/// The face before the camera, in quantities that are linear over each triangle.
struct PosedFace {
  ProjectedVertices projected;
  Vertices place;                 ///< affine: pixel and depth; perspective: camera axes, mm
  Vertices normals;               ///< affine: model axes; perspective: camera axes
  Eigen::Vector3f view{0, 0, 1};  ///< affine: towards the camera
  float focal = 0;                ///< 0: affine
  Eigen::Vector2f principal{0, 0};
};

PosedFace pose(const Mesh& mesh, const AffineCamera& camera) {
  PosedFace face;
  face.projected = project_vertices(mesh.V, camera);
  face.place.resize(mesh.V.rows(), 3);
  face.place << face.projected.pixels, face.projected.depth;
  face.normals = vertex_normals(mesh.V, mesh.F);
  face.view = camera.towards_camera().cast<float>();
  return face;
}

PosedFace pose(const Mesh& mesh, const PerspectiveCamera& camera) {
  PosedFace face;
  face.projected = project_vertices(mesh.V, camera);
  face.place = (mesh.V * camera.R.transpose()).rowwise() + camera.t.transpose();
  face.normals = vertex_normals(mesh.V, mesh.F) * camera.R.transpose();
  face.focal = static_cast<float>(camera.focal_px);
  face.principal = camera.principal.cast<float>();
  return face;
}

/// A z-buffer of its own resolution round the face.
class DepthMap {
 public:
  DepthMap(const PosedFace& face, const Faces& F, const TextureOptions& options) {
    ProjectedVertices p = face.projected;
    const auto finite = p.pixels.array().isFinite().rowwise().all();
    Eigen::RowVector2d low = Eigen::RowVector2d::Constant(1e30), high = -low;
    double nearest = -1e30, farthest = 1e30;
    for (Eigen::Index i = 0; i < p.pixels.rows(); ++i) {
      if (!finite[i]) continue;
      low = low.cwiseMin(p.pixels.row(i)), high = high.cwiseMax(p.pixels.row(i));
      nearest = std::max(nearest, p.depth[i]), farthest = std::min(farthest, p.depth[i]);
    }
    if (!(low[0] <= high[0])) return;
    // Finer than the image it would tell nothing more.
    const double extent = (high - low).maxCoeff();
    const double resolution = std::min<double>(std::max(extent, 256.0), options.depth_resolution);
    scale_ = static_cast<float>((resolution - 5) / std::max(extent, 1e-9));
    shift_ = (Eigen::RowVector2d(2, 2) - double{scale_} * low).cast<float>().transpose();
    p.pixels = (double{scale_} * p.pixels).rowwise() + shift_.cast<double>().transpose();
    perspective_ = p.perspective();
    bias_ = static_cast<float>(options.depth_bias * (nearest - farthest));
    width_ = static_cast<int>(double{scale_} * (high - low)[0]) + 5;
    height_ = static_cast<int>(double{scale_} * (high - low)[1]) + 5;
    rows_.clear_depth(0, width_, 0, height_);
    constexpr int band_rows = 32;
    const ScanList list = scan_list(p, F, height_, false);
    const auto bands = bands_of(list, height_, band_rows);
    for (size_t band = 0; band < bands.size(); ++band)
      for (const int i : bands[band])
        rows_.draw_depth(list.items[static_cast<size_t>(i)], width_, static_cast<int>(band) * band_rows,
                         static_cast<int>(band) * band_rows + band_rows - 1);
  }

  /// Whether a point at pixel (x, y) with that cosine to the viewer is nearest to the camera. The depth varies within a
  /// pixel by the slope of the surface, which is allowed for; `pixel_mm` is a pixel of the image on the face.
  bool sees(float x, float y, float depth, float cosine, float pixel_mm) const {
    const float px = scale_ * x + shift_[0] + 0.5F, py = scale_ * y + shift_[1] + 0.5F;
    if (!(px >= 0 && py >= 0)) return false;
    const int i = static_cast<int>(px), j = static_cast<int>(py);
    if (i >= width_ || j >= height_) return false;
    const float z = rows_.z(j)[i];  // -infinity where empty, just outside the outline
    const float behind = (perspective_ ? (z > 0 ? -1 / z : z) : z) - depth - bias_;
    if (behind <= 0) return true;
    const float tangent = std::min(std::sqrt(std::max(1 - cosine * cosine, 0.0F)) / cosine, 6.0F);
    return behind <= 0.71F * (pixel_mm / scale_) * tangent;
  }

 private:
  VisibilityRows rows_;
  Eigen::Vector2f shift_{0, 0};
  float scale_ = 1, bias_ = 0;
  int width_ = 0, height_ = 0;
  bool perspective_ = false;
};

/// A triangle in the map: its place, normal and colour as planes over the texels, and how to sample the image there.
struct TexturedTriangle {
  static constexpr int kPlanes = 9;
  std::array<std::array<float, 3>, kPlanes> planes{};  ///< value at the first corner, slopes
  float x0 = 0, y0 = 0;
  std::array<float, 4> step{};  ///< pixels of the image per texel: dx/di, dy/di, dx/dj, dy/dj
  int level = 0, samples = 1;   ///< of the image
  float pixel_mm = 1;           ///< a pixel of the image, seen from the front
};

/// Whether no texel of a triangle can be seen, by the normals at its corners; in perspective that is left open.
bool faces_away(const PosedFace& face, const std::array<int, 3>& v) {
  if (face.focal > 0) return false;
  const Eigen::Vector3d view = face.view.cast<double>();
  return std::all_of(v.begin(), v.end(), [&](int i) { return face.normals.row(i).dot(view) <= 0; });
}

TexturedTriangle prepare(const Mesh& mesh, const IsomapTexels& map, const PosedFace& face, int f) {
  TexturedTriangle t;
  const std::array<int, 3> v = {mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2)};
  const BarycentricPlanes b(map.texels, map.corners(f, 0), map.corners(f, 1), map.corners(f, 2));
  t.x0 = static_cast<float>(b.x0), t.y0 = static_cast<float>(b.y0);
  const auto store = [&](int at, const Vertices& rows) {
    for (int k = 0; k < 3; ++k) {
      const ScreenPlane q = b.plane(rows(v[0], k), rows(v[1], k), rows(v[2], k));
      t.planes[static_cast<size_t>(at + k)] = {static_cast<float>(q.value), static_cast<float>(q.dx),
                                               static_cast<float>(q.dy)};
    }
  };
  store(0, face.place), store(3, face.normals);
  if (mesh.has_colours()) store(6, mesh.colours);
  const TexCoords& p = face.projected.pixels;
  const ScreenPlane x = b.plane(p(v[0], 0), p(v[1], 0), p(v[2], 0)), y = b.plane(p(v[0], 1), p(v[1], 1), p(v[2], 1));
  t.step = {static_cast<float>(x.dx), static_cast<float>(y.dx), static_cast<float>(x.dy), static_cast<float>(y.dy)};
  const float reach = std::max(std::hypot(t.step[0], t.step[1]), std::hypot(t.step[2], t.step[3]));
  if (reach > 1.001F && !faces_away(face, v)) {
    t.level = std::min(static_cast<int>(std::log2(reach)), 12);
    t.samples = 2;
  }
  return t;
}

/// Colours the texels of a row, one run after the other.
class Extractor {
 public:
  Extractor(const Mesh& mesh, const IsomapTexels& map, const PosedFace& face, const Image& image,
            const TextureOptions& options)
      : map_(map),
        face_(face),
        options_(options),
        depth_(face, mesh.F, options),
        triangles_(static_cast<size_t>(mesh.F.rows())),
        fill_hidden_(mesh.has_colours()),
        limit_x_(static_cast<float>(image.width) - 0.5F),
        limit_y_(static_cast<float>(image.height) - 0.5F),
        image_(whole_or_part(mesh, image)) {}

  void row(int y, Image& isomap) const {
    for (int r = map_.row_start[static_cast<size_t>(y)]; r < map_.row_start[static_cast<size_t>(y) + 1]; ++r)
      run(map_.runs[static_cast<size_t>(r)], y, isomap.pixel(0, y));
  }
  double pixels_per_texel(int triangle) const {
    const auto& s = triangles_[static_cast<size_t>(triangle)].step;
    return std::abs(s[0] * s[3] - s[1] * s[2]);
  }

 private:
  /// Prepares the triangles; the part of the image that they reach, with as many levels as they need.
  LinearImage whole_or_part(const Mesh& mesh, const Image& image) {
    int levels = 1;
    std::vector<double> mm(triangles_.size(), 1);
    for (size_t f = 0; f < triangles_.size(); ++f) {
      triangles_[f] = prepare(mesh, map_, face_, static_cast<int>(f));
      levels = std::max(levels, triangles_[f].level + 1);
    }
    set_pixel_mm(mesh);
    const PixelBox box = pixel_box(face_.projected.pixels, image.width, image.height);
    const int margin = 3 << (levels - 1);  // the neighbourhood of a sample in the smallest copy
    LinearImage linear(image, levels, (box.left - margin) >> levels << levels, (box.top - margin) >> levels << levels,
                       box.right + margin, box.bottom + margin);
    for (TexturedTriangle& t : triangles_) t.level = std::min(t.level, linear.levels() - 1);
    return linear;
  }
  void set_pixel_mm(const Mesh& mesh) {
    for (size_t f = 0; f < triangles_.size(); ++f) {
      if (face_.focal > 0) {
        triangles_[f].pixel_mm = std::abs(triangles_[f].planes[2][0]) / face_.focal;
      } else if (f > 0) {
        triangles_[f].pixel_mm = triangles_[0].pixel_mm;
      } else {  // area on the screen against area seen from the front, over the whole mesh
        triangles_[0].pixel_mm = affine_pixel_mm(mesh);
      }
    }
  }
  float affine_pixel_mm(const Mesh& mesh) const {
    double screen = 0, front = 0;
    const Eigen::Vector3d view = face_.view.cast<double>();
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
      const BarycentricPlanes b(face_.projected.pixels, mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2));
      const Eigen::Vector3d a = mesh.V.row(mesh.F(f, 0)), u = mesh.V.row(mesh.F(f, 1)), v = mesh.V.row(mesh.F(f, 2));
      screen += std::abs(b.area2), front += std::abs((u - a).cross(v - a).dot(view));
    }
    return static_cast<float>(std::sqrt(front / std::max(screen, 1e-12)));
  }

  void run(const IsomapTexels::Run& r, int y, std::uint8_t* row) const {
    const TexturedTriangle& t = triangles_[static_cast<size_t>(r.triangle)];
    const LinearImage::Sampler sample = image_.sampler(t.level);
    const float dy = static_cast<float>(y) - t.y0;
    for (int x = r.begin; x < r.end; ++x) {
      const float dx = static_cast<float>(x) - t.x0;
      const auto at = [&](size_t k) { return t.planes[k][0] + t.planes[k][1] * dx + t.planes[k][2] * dy; };
      const Texel texel = look(at(0), at(1), at(2), at(3), at(4), at(5), t.pixel_mm);
      std::uint8_t* out = row + 4 * static_cast<ptrdiff_t>(x);
      if (texel.alpha > 0) {
        encode_.write(colour(t, sample, texel.x, texel.y), out);
        out[3] = texel.alpha;
      } else if (fill_hidden_) {
        encode_.write(Float4{at(6), at(7), at(8), 1}, out);
      }
    }
  }

  struct Texel {
    float x, y;
    std::uint8_t alpha;
  };
  Texel look(float a, float b, float c, float nx, float ny, float nz, float pixel_mm) const {
    float x = a, y = b, depth = c, facing = nx * face_.view[0] + ny * face_.view[1] + nz * face_.view[2];
    float length2 = nx * nx + ny * ny + nz * nz;
    if (face_.focal > 0) {
      facing = -(nx * a + ny * b + nz * c), length2 *= a * a + b * b + c * c;
      x = face_.principal[0] - face_.focal * a / c, y = face_.principal[1] + face_.focal * b / c;
    }
    if (!(facing > 0) || !(x >= -0.5F && y >= -0.5F && x <= limit_x_ && y <= limit_y_)) return {x, y, 0};
    const auto low = static_cast<float>(options_.hidden_cosine), high = static_cast<float>(options_.full_cosine);
    if (facing * facing <= low * low * length2) return {x, y, 0};
    const float cosine = std::min(facing / std::sqrt(length2), 1.0F);
    if (!depth_.sees(x, y, depth, cosine, pixel_mm)) return {x, y, 0};
    const float s = std::clamp((cosine - low) / (high - low), 0.0F, 1.0F);
    return {x, y, static_cast<std::uint8_t>(255 * s * s * (3 - 2 * s) + 0.5F)};
  }
  Float4 colour(const TexturedTriangle& t, const LinearImage::Sampler& sample, float x, float y) const {
    if (t.samples == 1) return sample(x, y);
    const float ix = t.step[0] / 4, iy = t.step[1] / 4, jx = t.step[2] / 4, jy = t.step[3] / 4;
    return broadcast4(0.25F) * ((sample(x - ix - jx, y - iy - jy) + sample(x + ix - jx, y + iy - jy)) +
                                (sample(x - ix + jx, y - iy + jy) + sample(x + ix + jx, y + iy + jy)));
  }

  const IsomapTexels& map_;
  const PosedFace& face_;
  const TextureOptions& options_;
  DepthMap depth_;
  std::vector<TexturedTriangle> triangles_;
  bool fill_hidden_;
  float limit_x_, limit_y_;
  LinearImage image_;
  const SrgbEncoder& encode_ = SrgbEncoder::get();
};

void check(const Mesh& mesh, const Image& image, const TextureOptions& o) {
  validate(mesh);
  if (!mesh.has_uv()) throw InvalidInput("texture: the mesh has no texture coordinates; the model needs a UV map");
  if (image.empty()) throw InvalidInput("texture: the image is empty");
  if (o.size < 8 || o.size > 8192 || o.depth_resolution < 16 || o.depth_resolution > 8192)
    throw InvalidInput("texture options: expected size 8..8192 and depth_resolution 16..8192");
  if (!(o.hidden_cosine >= 0 && o.hidden_cosine < o.full_cosine && o.full_cosine <= 1 && o.depth_bias >= 0))
    throw InvalidInput("texture options: expected 0 <= hidden_cosine < full_cosine <= 1 and depth_bias >= 0");
}

void summarise(TextureResult& result, const IsomapTexels& map, const Extractor& extractor) {
  TextureSummary& summary = result.summary;
  summary.mapped_texels = map.count;
  long long sum = 0;
  double area = 0;
  for (int y = 0; y < map.size; ++y)
    for (int r = map.row_start[static_cast<size_t>(y)]; r < map.row_start[static_cast<size_t>(y) + 1]; ++r) {
      const IsomapTexels::Run& run = map.runs[static_cast<size_t>(r)];
      int seen = 0;
      for (int x = run.begin; x < run.end; ++x) {
        const int alpha = result.isomap.pixel(x, y)[3];
        seen += alpha > 0, sum += alpha;
      }
      summary.visible_texels += seen;
      area += seen * extractor.pixels_per_texel(run.triangle);
    }
  summary.mean_alpha = static_cast<double>(sum) / 255 / std::max(map.count, 1);
  summary.resolution = std::sqrt(area / std::max(summary.visible_texels, 1));
}

TextureResult extract(const Mesh& mesh, const IsomapTexels& map, const Image& image, const PosedFace& face,
                      const TextureOptions& options) {
  if (map.corners.rows() != mesh.F.rows())
    throw InvalidInput("texture: the texels are of a mesh with " + std::to_string(map.corners.rows()) +
                       " triangles, this one has " + std::to_string(mesh.F.rows()));
  const Extractor extractor(mesh, map, face, image, options);
  TextureResult result;
  result.isomap = Image(map.size, map.size, 4);
  parallel_blocks(map.size, options.threads, [&](int first, int last) {
    for (int y = first; y < last; ++y) extractor.row(y, result.isomap);
  });
  summarise(result, map, extractor);
  return result;
}

}  // namespace

TextureResult extract_texture(const Mesh& mesh, const IsomapTexels& texels, const Image& image,
                              const AffineCamera& camera, const TextureOptions& options) {
  check(mesh, image, options);
  return extract(mesh, texels, image, pose(mesh, camera), options);
}

TextureResult extract_texture(const Mesh& mesh, const IsomapTexels& texels, const Image& image,
                              const PerspectiveCamera& camera, const TextureOptions& options) {
  check(mesh, image, options);
  return extract(mesh, texels, image, pose(mesh, camera), options);
}

TextureResult extract_texture(const Mesh& mesh, const Image& image, const AffineCamera& camera,
                              const TextureOptions& options) {
  check(mesh, image, options);
  return extract(mesh, isomap_texels(mesh, options.size), image, pose(mesh, camera), options);
}

TextureResult extract_texture(const Mesh& mesh, const Image& image, const PerspectiveCamera& camera,
                              const TextureOptions& options) {
  check(mesh, image, options);
  return extract(mesh, isomap_texels(mesh, options.size), image, pose(mesh, camera), options);
}

}  // namespace facewright
