// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/model_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/render/colour_maps.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/head_pose.h"
#include "libmodel/render/overlays.h"
#include "libmodel/render/render_mesh.h"
#include "pipelines/picture_text.h"

namespace facewright {
namespace {

constexpr Rgb kInk = {40, 40, 44};
constexpr int kCaption = 22;  // pixels of a line of text
constexpr double kRadians = std::numbers::pi / 180;
constexpr double kLevelYaw = 25, kCloser = 3.5;  // degrees, times: how level_picture looks at the levels

void check(const MorphableModel& model, const ModelPictureOptions& options) {
  if (model.empty()) throw InvalidInput("picture: the model is empty");
  if (options.tile < 32 || options.tile > 2048)
    throw InvalidInput("picture: a face is 32..2048 pixels wide, got " + std::to_string(options.tile));
  if (options.yaws_deg.empty()) throw InvalidInput("picture: expected at least one view");
  if (options.level >= model.level_count())
    throw InvalidInput("picture: expected a level of -1.." + std::to_string(model.level_count() - 1) + ", got " +
                       std::to_string(options.level));
}

enum class Look { coloured, clay, unlit };

Image portrait(const Mesh& mesh, const Vertices& frame, double yaw_deg, int size, Look look, int threads) {
  RenderOptions options;
  options.width = options.height = size;
  options.use_colours = look != Look::clay;
  options.shading = look == Look::unlit ? Shading::none : Shading::studio;
  options.threads = threads;
  return render_mesh(mesh, frame_camera(frame, size, size, yaw_deg * kRadians), options);
}

// Pictures made side by side in threads; the order is theirs.
template <class Make>
std::vector<Image> make_tiles(int count, int threads, const Make& make) {
  std::vector<Image> tiles(static_cast<size_t>(count));
  parallel_for(count, threads, [&](int i) { tiles[static_cast<size_t>(i)] = make(i); });
  return tiles;
}

// A white band with a line of text under (or over) a picture.
Image captioned(const Image& picture, const std::string& text) {
  Image out(picture.width, picture.height + kCaption, 3, 255);
  std::copy(picture.data.begin(), picture.data.end(), out.data.begin() + std::ptrdiff_t{3} * picture.width * kCaption);
  draw_text(out, {6, 5}, text, kInk);
  return out;
}

Image stacked(const std::vector<Image>& rows) {
  int width = 0, height = 0;
  for (const Image& row : rows) width = std::max(width, row.width), height += row.height;
  Image out(width, height, 3, 255);
  int top = 0;
  for (const Image& row : rows) {
    for (int y = 0; y < row.height; ++y) std::copy_n(row.pixel(0, y), 3 * row.width, out.pixel(0, top + y));
    top += row.height;
  }
  return out;
}

std::string text(const char* format, double value) {
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

const PcaModel& family_of(const MorphableModel& model, ModeFamily family) {
  static const PcaModel none;
  if (family == ModeFamily::shape) return model.shape();
  if (family == ModeFamily::colour) return model.colour();
  return model.expression() ? *model.expression() : none;
}

Mesh face_at(const MorphableModel& model, ModeFamily family, Eigen::Index mode, double sigma, int level) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(mode + 1);
  c[mode] = sigma;
  if (family == ModeFamily::shape) return model.instance(c, {}, level);
  if (family == ModeFamily::colour) return model.instance({}, c, level);
  return model.instance({}, {}, level, c);
}

// As much as fits into `width` pixels.
std::string counts(const Mesh& mesh, int width) {
  const std::string vertices = std::to_string(mesh.V.rows()) + " vertices";
  const std::string all = vertices + ", " + std::to_string(mesh.F.rows()) + " triangles";
  return text_width(all) + 12 <= width ? all : vertices;
}

// The scale of deviation_picture.
Image colour_bar(int width, double range) {
  const int height = 54, left = 16, bar = std::min(width - 2 * left, 360);
  Image out(width, height, 3, 255);
  const Colours ramp = sequential_colours(Eigen::VectorXd::LinSpaced(bar, 0, range), range);
  for (int y = 8; y < 26; ++y)
    for (int x = 0; x < bar; ++x)
      for (int k = 0; k < 3; ++k) out.pixel(left + x, y)[k] = srgb8_from_linear(ramp(x, k));
  draw_text(out, {left, 32}, "0", kInk);
  const std::string end = text("%.1f mm", range);
  draw_text(out, {left + bar - text_width(end), 32}, end, kInk);
  return out;
}

}  // namespace

Image mean_picture(const MorphableModel& model, const ModelPictureOptions& options) {
  check(model, options);
  const Mesh mean = model.mean(options.level);
  const int views = static_cast<int>(options.yaws_deg.size()), rows = model.has_colour() ? 2 : 1;
  return contact_sheet(make_tiles(rows * views, options.threads,
                                  [&](int i) {
                                    const Look look = rows == 2 && i < views ? Look::coloured : Look::clay;
                                    return portrait(mean, mean.V, options.yaws_deg[static_cast<size_t>(i % views)],
                                                    options.tile, look, 1);
                                  }),
                       views);
}

Image mode_picture(const MorphableModel& model, const ModePictureOptions& options) {
  const ModelPictureOptions& faces = options.faces;
  check(model, faces);
  if (options.modes < 1 || !(options.sigma > 0)) throw InvalidInput("mode picture: expected modes >= 1 and sigma > 0");
  const PcaModel& pca = family_of(model, options.family);
  const int modes = static_cast<int>(std::min<Eigen::Index>(options.modes, pca.mode_count()));
  if (modes == 0) throw InvalidInput("mode picture: the model has no such modes");
  const bool colour = options.family == ModeFamily::colour;
  const Vertices frame = model.mean(faces.level).V;
  const int views = static_cast<int>(faces.yaws_deg.size()), columns = 3 * views;
  const std::vector<Image> tiles = make_tiles(modes * columns, faces.threads, [&](int i) {
    const int mode = i / columns, view = i % columns / 3, side = i % 3 - 1;
    const Mesh face = face_at(model, options.family, mode, side * options.sigma, faces.level);
    return portrait(face, frame, faces.yaws_deg[static_cast<size_t>(view)], faces.tile,
                    colour ? Look::unlit : Look::clay, 1);
  });
  std::vector<Image> rows;
  for (int mode = 0; mode < modes; ++mode) {
    const auto first = tiles.begin() + std::ptrdiff_t{mode} * columns;
    const std::string label =
        "mode " + std::to_string(mode + 1) +
        text(": %.1f %% of the variance kept.  ", 100 * pca.variances[mode] / pca.variances.sum()) +
        text("-%.3g, ", options.sigma) + text("0, +%.3g standard deviations", options.sigma);
    rows.push_back(captioned(contact_sheet({first, first + columns}, columns), label));
  }
  return stacked(rows);
}

Image sample_picture(const MorphableModel& model, int count, double sigma, std::uint64_t seed,
                     const ModelPictureOptions& options) {
  check(model, options);
  if (count < 1) throw InvalidInput("sample picture: expected at least one face");
  const Vertices frame = model.mean(options.level).V;
  return contact_sheet(make_tiles(count, options.threads,
                                  [&](int i) {
                                    Random random = Random::stream(seed, static_cast<std::uint64_t>(i));
                                    return portrait(model.sample(random, options.level, sigma), frame, 20, options.tile,
                                                    Look::coloured, 1);
                                  }),
                       std::min(6, count));
}

Image level_picture(const MorphableModel& model, const ModelPictureOptions& options) {
  check(model, options);
  const Vertices frame = model.mean().V;
  const OrthographicCamera whole = frame_camera(frame, options.tile, options.tile, kLevelYaw * kRadians);
  OrthographicCamera near = whole;  // eye, nose and half the mouth
  const Eigen::Vector3d low = frame.colwise().minCoeff(), high = frame.colwise().maxCoeff();
  const Eigen::Vector3d place(0.6 * low[0] + 0.4 * high[0], (low[1] + high[1]) / 2, high[2]);
  near.s *= kCloser;
  near.t = Eigen::Vector2d::Constant((options.tile - 1) / 2.0) - near.affine().A * place;
  const int levels = model.level_count();
  return contact_sheet(
      make_tiles(2 * levels, options.threads,
                 [&](int i) {
                   const Mesh mean = model.mean(i % levels);
                   const OrthographicCamera& camera = i < levels ? whole : near;
                   RenderOptions render;
                   render.width = render.height = options.tile;
                   render.use_colours = false;
                   render.threads = 1;
                   Image tile = render_mesh(mean, camera, render);
                   draw_wireframe(tile, mean.V, mean.F, camera.affine(), {20, 40, 90}, i < levels ? 0.3 : 0.6);
                   return i < levels ? captioned(tile, counts(mean, tile.width)) : tile;
                 }),
      levels);
}

Image deviation_picture(const MorphableModel& model, double range_mm, const ModelPictureOptions& options) {
  check(model, options);
  if (!(range_mm >= 0)) throw InvalidInput("deviation picture: expected a range >= 0 mm");
  Mesh mean = model.mean(options.level);
  const PcaModel& shape = model.shape();
  const Eigen::VectorXd entries =
      shape.basis.topRows(3 * mean.V.rows()).array().square().matrix() * shape.variances;  // (3N)
  Eigen::VectorXd deviation(mean.V.rows());
  for (Eigen::Index i = 0; i < deviation.size(); ++i) deviation[i] = std::sqrt(entries.segment<3>(3 * i).sum());
  const double largest = deviation.size() > 0 ? deviation.maxCoeff() : 0;
  const double range = range_mm > 0 ? range_mm : std::max(largest, 1e-3);
  mean.colours = sequential_colours(deviation, range);
  const int views = static_cast<int>(options.yaws_deg.size());
  const Image faces = contact_sheet(make_tiles(views, options.threads,
                                               [&](int i) {
                                                 return portrait(mean, mean.V, options.yaws_deg[static_cast<size_t>(i)],
                                                                 options.tile, Look::unlit, 1);
                                               }),
                                    views);
  return stacked({faces, colour_bar(faces.width, range)});
}

Image texture_map_picture(const MorphableModel& model, const ModelPictureOptions& options) {
  check(model, options);
  if (model.uv().rows() == 0) throw InvalidInput("picture of the texture map: the model has no texture coordinates");
  Mesh flat = model.mean(options.level);
  for (Eigen::Index i = 0; i < flat.V.rows(); ++i) flat.V.row(i) << model.uv()(i, 0), model.uv()(i, 1), 0;
  flat.V *= options.tile;
  flat.uv.resize(0, 2);
  OrthographicCamera camera;  // v runs up, pixels down
  camera.t = Eigen::Vector2d(-0.5, options.tile - 0.5);
  RenderOptions render;
  render.width = render.height = options.tile;
  render.shading = Shading::none;
  render.threads = options.threads;
  Image picture = render_mesh(flat, camera, render);
  draw_wireframe(picture, flat.V, flat.F, camera.affine(), {20, 40, 90}, 0.3);
  return picture;
}

std::vector<Image> turntable(const Mesh& mesh, int frames, const ModelPictureOptions& options) {
  if (frames < 1 || frames > 10000) throw InvalidInput("turntable: expected 1..10000 frames");
  // Framed once, by what fits at every angle of a turn about the head's own axis.
  const Eigen::Vector3d low = mesh.V.colwise().minCoeff(), high = mesh.V.colwise().maxCoeff();
  const Eigen::Vector3d centre = (low + high) / 2;
  const double radius = (mesh.V.leftCols<3>().rowwise() - centre.transpose()).rowwise().norm().maxCoeff();
  return make_tiles(frames, options.threads, [&](int i) {
    RenderOptions render;
    render.width = render.height = options.tile;
    render.use_colours = mesh.has_colours();
    render.threads = 1;
    OrthographicCamera camera;
    camera.s = 0.45 * options.tile / std::max(radius, 1e-9);
    camera.R = rotation({2 * std::numbers::pi * i / frames, 0, 0});
    camera.t = Eigen::Vector2d::Constant((options.tile - 1) / 2.0) - camera.affine().A * centre;
    return render_mesh(mesh, camera, render);
  });
}

}  // namespace facewright
