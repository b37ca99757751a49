// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/foreign_model.h"
#include "libmodel/io/atomic_file.h"

namespace facewright {
namespace {

std::uint32_t count(ByteReader& in, const std::string& what, std::uint32_t most) {
  const auto n = in.value<std::uint32_t>();
  if (n > most) in.fail("has " + std::to_string(n) + " " + what + "; at most " + std::to_string(most) + " make sense");
  return n;
}

Eigen::VectorXd numbers(ByteReader& in, size_t n) {
  in.expect(n, sizeof(double));
  Eigen::VectorXd x(static_cast<Eigen::Index>(n));
  in.array(x.data(), n);
  return x;
}

// u32 modes, u32 dimension, the components one after the other; u32 dimension, mean; u32 modes, eigenvalues.
ForeignModes read_part(ByteReader& in, const std::string& what) {
  constexpr std::uint32_t kMost = 100'000'000;
  ForeignModes m;
  const auto modes = count(in, what + " modes", kMost), size = count(in, what + " values", kMost);
  in.expect(size_t{modes} * size, sizeof(double));
  m.columns.resize(size, modes);
  in.array(m.columns.data(), size_t{modes} * size);
  if (const auto n = count(in, what + " mean values", kMost); n != size)
    in.fail("has a " + what + " mean of " + std::to_string(n) + " values and a basis of " + std::to_string(size));
  m.mean = numbers(in, size);
  if (const auto n = count(in, what + " eigenvalues", kMost); n != modes)
    in.fail("has " + std::to_string(n) + " " + what + " eigenvalues for " + std::to_string(modes) + " modes");
  m.values = numbers(in, modes);
  return m;
}

}  // namespace

ForeignModel read_scm(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  ByteReader in(bytes, path.string());
  ForeignModel model;
  model.path = path.string();
  model.format = "Surrey Face Model (.scm)";
  const auto vertices = count(in, "vertices", 10'000'000), triangles = count(in, "triangles", 20'000'000);
  in.expect(triangles, 3 * sizeof(std::int32_t));
  Faces F(triangles, 3);
  in.array(F.data(), static_cast<size_t>(F.size()));
  model.shape = read_part(in, "shape");
  if (model.shape.mean.size() != 3 * Eigen::Index{vertices})
    in.fail("has " + std::to_string(vertices) + " vertices and a shape of " + std::to_string(model.shape.mean.size()) +
            " values");
  if (!in.at_end()) {
    model.colour = read_part(in, "colour");
    model.colour_space = ColourSpace::srgb;
    if (model.colour.mean.size() != 0 && model.colour.mean.size() != model.shape.mean.size())
      in.fail("has " + std::to_string(model.colour.mean.size()) + " colour values; the shape has " +
              std::to_string(model.shape.mean.size()));
    if (!model.colour.empty() && model.colour.mean.maxCoeff() > 2) model.colour_range = 255;
  }
  if (!in.at_end()) in.fail("goes on after the end of the model");
  model.F = zero_based(std::move(F), static_cast<int>(vertices), 0, model);
  model.units = "mm";
  return model;
}

}  // namespace facewright
