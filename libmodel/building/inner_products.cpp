// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/inner_products.h"

#include <algorithm>

namespace facewright {
namespace {

constexpr Eigen::Index kLeft = 4, kRight = 12;  // rows of a panel: the sums of 4 x 12 products stay in registers
constexpr Eigen::Index kDepth = 256;            // columns summed at a time: a panel of each side stays in the L1 cache
constexpr Eigen::Index kBand = 128;             // left rows that stay in the L2 cache

#if defined(__GNUC__) && defined(__x86_64__)
#define FACEWRIGHT_AVX2 1
using Wide = double __attribute__((vector_size(32), aligned(8), may_alias));
#endif
#if defined(__GNUC__)
using Narrow = double __attribute__((vector_size(16), aligned(8), may_alias));
#define FACEWRIGHT_INLINE inline __attribute__((always_inline))
#else
using Narrow = double;
#define FACEWRIGHT_INLINE inline
#endif

// sums (4 x Count vectors) of depth products; a, b: panels.
template <class Vector, int Count>
FACEWRIGHT_INLINE void multiply(const double* a, const double* b, Eigen::Index depth, double* sums) {
  Vector sum[kLeft][Count] = {};
  constexpr Eigen::Index lanes = sizeof(Vector) / sizeof(double);
  for (Eigen::Index k = 0; k < depth; ++k, a += kLeft, b += kRight)
    for (int i = 0; i < kLeft; ++i)
      for (int j = 0; j < Count; ++j) sum[i][j] += a[i] * *reinterpret_cast<const Vector*>(b + j * lanes);
  for (int i = 0; i < kLeft; ++i)
    for (int j = 0; j < Count; ++j) *reinterpret_cast<Vector*>(sums + i * kRight + j * lanes) = sum[i][j];
}

#ifdef FACEWRIGHT_AVX2
__attribute__((target("avx2"))) void multiply_panels_avx2(const double* a, const double* b, Eigen::Index depth,
                                                          double* sums) {
  multiply<Wide, 3>(a, b, depth, sums);
}
#endif

void multiply_panels_plain(const double* a, const double* b, Eigen::Index depth, double* sums) {
  constexpr Eigen::Index lanes = sizeof(Narrow) / sizeof(double);
  for (Eigen::Index j = 0; j < kRight; j += 2 * lanes) multiply<Narrow, 2>(a, b + j, depth, sums + j);
}

using MultiplyPanels = void (*)(const double*, const double*, Eigen::Index, double*);

MultiplyPanels best_for_this_machine() {
#ifdef FACEWRIGHT_AVX2
  if (__builtin_cpu_supports("avx2")) return multiply_panels_avx2;
#endif
  return multiply_panels_plain;
}

}  // namespace

PackedRows::PackedRows(Side side, Eigen::Index rows, Eigen::Index cols)
    : rows_(rows), cols_(cols), width_(side == Side::left ? kLeft : kRight) {
  values_.resize(static_cast<size_t>((rows + width_ - 1) / width_ * width_ * cols));
}

// Depth by depth, panel by panel, column by column.
void PackedRows::set_row(Eigen::Index row, const float* values) {
  const Eigen::Index padded = static_cast<Eigen::Index>(values_.size()) / cols_;
  for (Eigen::Index col = 0; col < cols_; col += kDepth) {
    const Eigen::Index depth = std::min(kDepth, cols_ - col);
    double* at = values_.data() + padded * col + row / width_ * width_ * depth + row % width_;
    for (Eigen::Index k = 0; k < depth; ++k) at[k * width_] = static_cast<double>(values[col + k]);
  }
}

void add_inner_products(const PackedRows& A, Eigen::Index first, const PackedRows& B, Eigen::Ref<SampleMatrix> sums) {
  static const MultiplyPanels multiply_panels = best_for_this_machine();
  const Eigen::Index padded_a = static_cast<Eigen::Index>(A.values_.size()) / A.cols_;
  const Eigen::Index padded_b = static_cast<Eigen::Index>(B.values_.size()) / B.cols_;
  Eigen::Matrix<double, kLeft, kRight, Eigen::RowMajor> part;
  for (Eigen::Index col = 0; col < A.cols_; col += kDepth) {
    const Eigen::Index depth = std::min(kDepth, A.cols_ - col);
    const double *a = A.values_.data() + padded_a * col, *b = B.values_.data() + padded_b * col;
    for (Eigen::Index band = first; band < A.rows_; band += kBand)
      for (Eigen::Index j = 0; j < B.rows_; j += kRight)
        for (Eigen::Index i = band; i < std::min(band + kBand, A.rows_); i += kLeft) {
          multiply_panels(a + i * depth, b + j * depth, depth, part.data());
          const Eigen::Index rows = std::min(kLeft, A.rows_ - i), cols = std::min(kRight, B.rows_ - j);
          sums.block(i - first, j, rows, cols) += part.topLeftCorner(rows, cols);
        }
  }
}

}  // namespace facewright
