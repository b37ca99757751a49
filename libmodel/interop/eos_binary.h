// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/byte_writer.h"
#include "libmodel/model/morphable_model.h"

namespace facewright {

// Private to this module. cereal's binary archive as eos uses it: sizes are 64 bit, matrices int32 rows, int32 columns,
// float32 by columns.

constexpr std::int32_t kEosPcaExpressions = 0, kEosBlendshapes = 1;  // alternatives of the expression model

inline void write_eos_matrix(ByteWriter& out, const Eigen::MatrixXd& m) {
  const Eigen::MatrixXf values = m.cast<float>();
  out.value(static_cast<std::int32_t>(m.rows()));
  out.value(static_cast<std::int32_t>(m.cols()));
  out.array(values.data(), static_cast<size_t>(values.size()));
}

/// Throws IoError naming `what` if it is longer than the file, or holds NaN or infinity.
inline Eigen::MatrixXf read_eos_matrix(ByteReader& in, const std::string& what) {
  const auto rows = in.value<std::int32_t>(), cols = in.value<std::int32_t>();
  if (rows < 0 || cols < 0) in.fail("has a matrix of negative size: " + what);
  in.expect(static_cast<size_t>(rows) * static_cast<size_t>(cols), sizeof(float));
  Eigen::MatrixXf m(rows, cols);
  in.array(m.data(), static_cast<size_t>(m.size()));
  // 0 times a number is 0 unless it is NaN or infinite.
  if (m.size() > 0 && (m.array() * 0.0f).sum() != 0)
    in.fail("holds NaN or infinity: " + what + "; the file is damaged or its PCA failed, make it again");
  return m;
}

inline void write_eos_blendshapes(ByteWriter& out, const std::vector<Blendshape>& blendshapes) {
  out.value(static_cast<std::uint64_t>(blendshapes.size()));
  for (const Blendshape& b : blendshapes) {
    out.value(static_cast<std::uint64_t>(b.name.size()));
    out.text(b.name);
    write_eos_matrix(out, b.displacement);
  }
}

inline std::vector<Blendshape> read_eos_blendshape_list(ByteReader& in) {
  std::vector<Blendshape> result;
  for (auto n = in.value<std::uint64_t>(); n > 0; --n) {
    Blendshape b;
    b.name = in.text(in.value<std::uint64_t>());
    const Eigen::MatrixXf m = read_eos_matrix(in, "blendshape '" + b.name + "'");
    if (m.cols() != 1 || m.rows() % 3 != 0)
      in.fail("has blendshape '" + b.name + "' of " + std::to_string(m.rows()) + " x " + std::to_string(m.cols()) +
              " numbers; expected 3 per vertex in one column");
    b.displacement = m.cast<double>();
    result.push_back(std::move(b));
  }
  return result;
}

}  // namespace facewright
