// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/fitting/complete_texture.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/texture_layer.h"
#include "libmodel/render/linear_image.h"
#include "libmodel/render/scan_conversion.h"

namespace facewright {
namespace {

/// Calls body(triangle, planes, x, y) for each texel of the map.
template <typename Body>
void for_each_texel(const IsomapTexels& map, const Body& body) {
  for (int y = 0; y < map.size; ++y)
    for (int r = map.row_start[static_cast<size_t>(y)]; r < map.row_start[static_cast<size_t>(y) + 1]; ++r) {
      const IsomapTexels::Run& run = map.runs[static_cast<size_t>(r)];
      const int f = run.triangle;
      const BarycentricPlanes planes(map.texels, map.corners(f, 0), map.corners(f, 1), map.corners(f, 2));
      for (int x = run.begin; x < run.end; ++x) body(f, planes, x, y);
    }
}

TextureLayer map_mask(const IsomapTexels& map) {
  TextureLayer mask(map.size);
  for_each_texel(map, [&](int, const BarycentricPlanes&, int x, int y) { mask.at(x, y) = broadcast4(1); });
  return mask;
}

/// Sums over a square window of 2 r + 1 texels, along rows, then columns.
std::vector<float> box_sums(std::vector<float> values, int size, int radius) {
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<float> out(values.size());
    const auto n = static_cast<size_t>(size);
    for (size_t line = 0; line < n; ++line) {
      const auto at = [&](int i) {
        return pass == 0 ? line * n + static_cast<size_t>(i) : static_cast<size_t>(i) * n + line;
      };
      double sum = 0;
      for (int i = -radius; i < size; ++i) {
        if (i + radius < size) sum += values[at(i + radius)];
        if (i - radius - 1 >= 0) sum -= values[at(i - radius - 1)];
        if (i >= 0) out[at(i)] = static_cast<float>(sum);
      }
    }
    values = std::move(out);
  }
  return values;
}

/// Lets weights fall to 0 within `radius` texels inside sharp borders, those of the map excepted.
void feather(TextureLayer& layer, const TextureLayer& mask, int radius) {
  if (radius < 1) return;
  std::vector<float> weight(layer.texels.size()), inside(layer.texels.size());
  for (size_t i = 0; i < weight.size(); ++i)
    weight[i] = layer.texels[i][3] > 0 ? mask.texels[i][3] : 0, inside[i] = mask.texels[i][3];
  weight = box_sums(std::move(weight), layer.size, radius), inside = box_sums(std::move(inside), layer.size, radius);
  for (size_t i = 0; i < weight.size(); ++i) {
    Float4& t = layer.texels[i];
    const float wanted = std::clamp(2 * weight[i] / std::max(inside[i], 1.0F) - 1, 0.0F, 1.0F);
    if (t[3] > wanted) t *= broadcast4(wanted / t[3]);
  }
}

/// Leaves out texels within `radius` of the map's borders: their pixels may mix with what is behind the face.
void leave_out_borders(TextureLayer& layer, const TextureLayer& mask, int radius) {
  std::vector<float> inside(layer.texels.size());
  for (size_t i = 0; i < inside.size(); ++i) inside[i] = mask.texels[i][3];
  inside = box_sums(std::move(inside), layer.size, radius);
  const auto whole = static_cast<float>((2 * radius + 1) * (2 * radius + 1)) - 0.5F;
  for (size_t i = 0; i < inside.size(); ++i)
    if (inside[i] < whole) layer.texels[i] = Float4{};
}

/// What the other side of the face shows at each texel.
TextureLayer mirrored(const TextureLayer& seen, const IsomapTexels& map, const std::vector<int>& mirror) {
  TextureLayer out(map.size);
  const auto limit = static_cast<double>(map.size - 1);
  for_each_texel(map, [&](int f, const BarycentricPlanes& b, int x, int y) {
    Eigen::Vector2d p;
    for (int k = 0; k < 2; ++k) {
      const auto partner = [&](int corner) {
        return map.texels(mirror[static_cast<size_t>(map.corners(f, corner))], k);
      };
      p[k] = std::clamp(b.at(b.plane(partner(0), partner(1), partner(2)), x, y), 0.0, limit);
    }
    const int i = std::min(static_cast<int>(p[0]), map.size - 2), j = std::min(static_cast<int>(p[1]), map.size - 2);
    const Float4 fx = broadcast4(static_cast<float>(p[0] - i)), fy = broadcast4(static_cast<float>(p[1] - j));
    const Float4 upper = seen.at(i, j) + fx * (seen.at(i + 1, j) - seen.at(i, j));
    const Float4 lower = seen.at(i, j + 1) + fx * (seen.at(i + 1, j + 1) - seen.at(i, j + 1));
    out.at(x, y) = upper + fy * (lower - upper);
  });
  return out;
}

/// Colours per vertex on the map, weight 1.
TextureLayer painted(const Colours& colours, const IsomapTexels& map) {
  TextureLayer out(map.size);
  for_each_texel(map, [&](int f, const BarycentricPlanes& b, int x, int y) {
    for (int k = 0; k < 3; ++k) {
      const auto value = [&](int corner) { return colours(map.corners(f, corner), k); };
      out.at(x, y)[k] = static_cast<float>(std::clamp(b.at(b.plane(value(0), value(1), value(2)), x, y), 0.0, 1.0));
    }
    out.at(x, y)[3] = 1;
  });
  return out;
}

/// Multiplies `guess` by the smooth gain per channel that takes it to `truth` where both have weight: logarithms of
/// the ratio of mean colours over blocks, continued smoothly.
void adapt(TextureLayer& guess, const TextureLayer& truth, int block) {
  constexpr float floor = 0.01F;  // keeps dark colours from dividing by nothing
  const int n = (guess.size + block - 1) / block;
  TextureLayer a(n), b(n), gain(n);
  for (int y = 0; y < guess.size; ++y)
    for (int x = 0; x < guess.size; ++x) {
      const Float4 &g = guess.at(x, y), &t = truth.at(x, y);
      a.at(x / block, y / block) += broadcast4(g[3]) * t;
      b.at(x / block, y / block) += broadcast4(t[3]) * g;
    }
  for (size_t i = 0; i < gain.texels.size(); ++i) {
    const float w = a.texels[i][3];  // the same in both
    if (!(w > 1e-3F)) continue;
    const float confidence = std::min(1.0F, w / static_cast<float>(block * block));
    for (int k = 0; k < 3; ++k)
      gain.texels[i][k] = confidence * std::log((a.texels[i][k] / w + floor) / (b.texels[i][k] / w + floor));
    gain.texels[i][3] = confidence;
  }
  gain = filled(std::move(gain));
  for (int y = 0; y < guess.size; ++y)
    for (int x = 0; x < guess.size; ++x) {
      Float4& g = guess.at(x, y);
      if (!(g[3] > 0)) continue;
      const Float4 field = interpolated(gain, x, y, block);
      for (int k = 0; k < 3; ++k)
        g[k] = std::max(0.0F, (g[k] + floor * g[3]) * std::exp(std::clamp(field[k], -2.0F, 2.0F)) - floor * g[3]);
    }
}

/// a over b: (1 - weight of a) of b.
void put_under(TextureLayer& a, const TextureLayer& b) {
  for (size_t i = 0; i < a.texels.size(); ++i) a.texels[i] += broadcast4(1 - a.texels[i][3]) * b.texels[i];
}

struct ColourFit {
  Eigen::VectorXd coefficients;
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();
};

/// y = gain * (mean + J c) at the vertices that were seen: c by MAP and gain by least squares in turn, outliers (hair,
/// highlights) weighted down (Geman-McClure).
ColourFit fit_colour(const PcaModel& colour, const TextureLayer& seen, const IsomapTexels& map, Eigen::Index vertices,
                     const CompletionOptions& options) {
  std::vector<std::pair<Eigen::Index, Float4>> marks;
  const Eigen::Index stride = std::max<Eigen::Index>(1, vertices / 1000);
  for (Eigen::Index i = 0; i < vertices; i += stride) {
    const int x = static_cast<int>(std::lround(map.texels(i, 0))), y = static_cast<int>(std::lround(map.texels(i, 1)));
    if (x < 0 || y < 0 || x >= map.size || y >= map.size || !(seen.at(x, y)[3] > 0.05F)) continue;
    marks.emplace_back(i, seen.at(x, y));
  }
  ColourFit fit;
  fit.coefficients = Eigen::VectorXd::Zero(colour.mode_count());
  if (marks.empty()) return fit;
  const auto n = static_cast<Eigen::Index>(marks.size());
  Eigen::VectorXd y(3 * n), mean(3 * n), weight(3 * n);
  Eigen::MatrixXd J(3 * n, colour.mode_count());
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [v, c] = marks[static_cast<size_t>(i)];
    for (int k = 0; k < 3; ++k) y[3 * i + k] = double{c[k]} / double{c[3]}, weight[3 * i + k] = double{c[3]};
    mean.segment<3>(3 * i) = colour.mean.segment<3>(3 * v);
    J.middleRows(3 * i, 3) = colour.basis.middleRows(3 * v, 3) * colour.variances.cwiseSqrt().asDiagonal();
  }
  const double trust = std::min(1.0, options.observations / std::max(weight.sum() / 3, 1.0)) /
                       (options.colour_sigma * options.colour_sigma);
  Eigen::VectorXd robust = Eigen::VectorXd::Ones(3 * n);
  for (int round = 0; round < 5; ++round) {
    const Eigen::VectorXd now = mean + J * fit.coefficients, w = weight.cwiseProduct(robust);
    Eigen::Vector3d top = Eigen::Vector3d::Zero(), bottom = Eigen::Vector3d::Constant(1e-9);
    for (Eigen::Index i = 0; i < 3 * n; ++i)
      top[i % 3] += w[i] * y[i] * now[i], bottom[i % 3] += w[i] * now[i] * now[i];
    fit.gain = top.cwiseQuotient(bottom).cwiseMax(0.05).cwiseMin(20.0);
    Eigen::VectorXd g(3 * n);
    for (Eigen::Index i = 0; i < 3 * n; ++i) g[i] = fit.gain[i % 3];
    if (J.cols() > 0) {
      const Eigen::MatrixXd GJ = g.asDiagonal() * J;
      Eigen::MatrixXd H = trust * GJ.transpose() * w.asDiagonal() * GJ;
      H.diagonal().array() += 1;
      fit.coefficients = H.ldlt().solve(trust * GJ.transpose() * w.cwiseProduct(y - g.cwiseProduct(mean)));
    }
    const Eigen::VectorXd r = y - g.cwiseProduct(mean + J * fit.coefficients);
    robust = (1 + (r.array() / (2 * options.colour_sigma)).square()).square().inverse();
  }
  return fit;
}

TextureLayer modelled(const MorphableModel& model, int level, const TextureLayer& known, const IsomapTexels& map,
                      const CompletionOptions& options, CompletionSummary& summary) {
  const Eigen::Index n = model.vertex_count(level);
  const ColourFit fit = fit_colour(model.colour(), known, map, n, options);
  Colours colours = as_vertices(model.colour().instance(fit.coefficients, n));
  colours = colours * fit.gain.asDiagonal();
  summary.colour_coefficients = fit.coefficients, summary.gain = fit.gain;
  return painted(colours, map);
}

void check(const MorphableModel& model, int level, const Image& isomap, const IsomapTexels& map,
           const CompletionOptions& options) {
  if (isomap.channels != 4 || isomap.width != map.size || isomap.height != map.size)
    throw InvalidInput("texture: expected an RGBA isomap of " + std::to_string(map.size) + " x " +
                       std::to_string(map.size) + " texels, got " + std::to_string(isomap.width) + " x " +
                       std::to_string(isomap.height) + " of " + std::to_string(isomap.channels) + " channels");
  if (map.corners.rows() != model.faces(level).rows() || map.texels.rows() != model.vertex_count(level))
    throw InvalidInput("texture: the texels are not those of the model's level");
  if (options.adaptation_texels < 1 || options.adaptation_texels > 64 || !(options.colour_sigma > 0) ||
      options.observations < 1 || !(options.feather >= 0 && options.feather < 0.5))
    throw InvalidInput(
        "completion options: expected adaptation_texels 1..64, colour_sigma > 0, observations >= 1, "
        "feather 0..0.5");
}

/// Shares of the sources as bytes that add up to 255.
void write_shares(std::uint8_t* out, float seen, float mirrored_share) {
  const int a = static_cast<int>(std::lround(255 * std::clamp(seen, 0.0F, 1.0F)));
  const int b =
      std::min(255 - a, static_cast<int>(std::lround(255 * std::clamp((1 - seen) * mirrored_share, 0.0F, 1.0F))));
  out[0] = static_cast<std::uint8_t>(a), out[1] = static_cast<std::uint8_t>(b);
  out[2] = static_cast<std::uint8_t>(255 - a - b);
}

}  // namespace

TexelSource texel_source(const Image& sources, int x, int y) {
  const std::uint8_t* s = sources.pixel(x, y);
  if (s[0] + s[1] + s[2] == 0) return TexelSource::outside;
  if (s[0] >= s[1] && s[0] >= s[2]) return TexelSource::seen;
  return s[1] >= s[2] ? TexelSource::mirrored : TexelSource::modelled;
}

CompletedTexture complete_texture(const MorphableModel& model, int level, const Image& isomap, const IsomapTexels& map,
                                  const CompletionOptions& options) {
  check(model, level, isomap, map, options);
  CompletedTexture result;
  CompletionSummary& summary = result.summary;
  summary.has_mirror = !model.mirror().empty(), summary.has_colour_model = model.has_colour();
  const TextureLayer mask = map_mask(map);
  TextureLayer known = decoded(isomap);
  for (size_t i = 0; i < known.texels.size(); ++i) known.texels[i] *= mask.texels[i];
  feather(known, mask, static_cast<int>(std::lround(options.feather * map.size)));
  leave_out_borders(known, mask, std::max(1, map.size / 512));
  const TextureLayer seen = known;
  std::optional<TextureLayer> other;
  if (options.mirror && summary.has_mirror) {
    other = mirrored(seen, map, model.mirror());
    adapt(*other, seen, options.adaptation_texels);
    put_under(known, *other);
  }
  if (options.model && summary.has_colour_model) {
    TextureLayer rest = modelled(model, level, seen, map, options, summary);
    adapt(rest, known, options.adaptation_texels);
    put_under(known, rest);
  }
  result.sources = Image(map.size, map.size, 3);
  std::array<double, 3> sums{};
  for (int y = 0; y < map.size; ++y)
    for (int x = 0; x < map.size; ++x) {
      if (mask.at(x, y)[3] == 0) continue;
      std::uint8_t* out = result.sources.pixel(x, y);
      write_shares(out, seen.at(x, y)[3], other ? other->at(x, y)[3] : 0);
      for (size_t k = 0; k < 3; ++k) sums[k] += out[k] / 255.0 / std::max(map.count, 1);
    }
  summary.seen = sums[0], summary.mirrored = sums[1], summary.modelled = sums[2];
  const TextureLayer whole = filled(std::move(known));  // what is still empty, and the surroundings of the map
  if (!whole.texels.empty() && whole.texels[0][3] == 0) return {{}, {}, summary};
  result.texture = encoded_rgb(whole);
  return result;
}

}  // namespace facewright
