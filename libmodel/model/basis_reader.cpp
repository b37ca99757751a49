// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/basis_reader.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <vector>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "libmodel/core/large_pages.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

constexpr Eigen::Index kChunkFloats = 1 << 14;  // taken from the file at once: stays in the cache, and in the heap
constexpr Eigen::Index kBlock =
    128;  // rows turned at once: 128 x 63 floats stay in the first cache, 1 KB goes to each column

class File {
 public:
  explicit File(const std::string& name) : descriptor_(::open(name.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~File() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  bool read(std::uint64_t offset, void* to, size_t bytes) const {
    for (auto* at = static_cast<char*>(to); bytes > 0;) {
      const ssize_t n = ::pread(descriptor_, at, bytes, static_cast<off_t>(offset));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      at += n, offset += static_cast<std::uint64_t>(n), bytes -= static_cast<size_t>(n);
    }
    return true;
  }

 private:
  int descriptor_;
};

// Any r without zeros will do; a fixed one makes the same answer every time.
Eigen::VectorXf probe(Eigen::Index modes) {
  Random random(1);
  Eigen::VectorXf r(modes);
  for (float& x : r) x = static_cast<float>(random.uniform(0.5, 1.5) * (random.bits() & 1 ? 1 : -1));
  return r;
}

// Rows of a file become columns of doubles.
template <class Scalar>
void turn_columns(const Scalar* rows, Eigen::Index count, Eigen::Index stride, Eigen::Index first_column,
                  Eigen::Index columns, double* to, Eigen::Index height) {
  for (Eigen::Index k = first_column; k < columns; ++k)
    for (Eigen::Index j = 0; j < count; ++j) to[k * height + j] = static_cast<double>(rows[j * stride + k]);
}

template <class Scalar>
void turn_block(const Scalar* rows, Eigen::Index count, Eigen::Index stride, Eigen::Index columns, double* to,
                Eigen::Index height) {
  turn_columns(rows, count, stride, 0, columns, to, height);
}

#ifdef __SSE2__
// Four rows by four columns at a time; the same numbers, half the time.
void turn_block(const float* rows, Eigen::Index count, Eigen::Index stride, Eigen::Index columns, double* to,
                Eigen::Index height) {
  const Eigen::Index whole_rows = count / 4 * 4, whole_columns = columns / 4 * 4;
  for (Eigen::Index k = 0; k < whole_columns; k += 4)
    for (Eigen::Index j = 0; j < whole_rows; j += 4) {
      const float* from = rows + j * stride + k;
      __m128 a = _mm_loadu_ps(from), b = _mm_loadu_ps(from + stride), c = _mm_loadu_ps(from + 2 * stride),
             d = _mm_loadu_ps(from + 3 * stride);
      _MM_TRANSPOSE4_PS(a, b, c, d);
      double* column = to + k * height + j;
      for (const __m128 x : {a, b, c, d}) {
        _mm_storeu_pd(column, _mm_cvtps_pd(x));
        _mm_storeu_pd(column + 2, _mm_cvtps_pd(_mm_movehl_ps(x, x)));
        column += height;
      }
    }
  turn_columns(rows, whole_rows, stride, whole_columns, columns, to, height);
  turn_columns(rows + whole_rows * stride, count - whole_rows, stride, 0, columns, to + whole_rows, height);
}
#endif

// B is written in blocks; z sums B'(B r) over the rows given. A NaN or an infinity anywhere in them makes one in z.
template <class Scalar>
void turn(const Scalar* rows, Eigen::Index count, Eigen::Index stride, Eigen::Index first, const Eigen::VectorXf& r,
          Eigen::MatrixXd& B, Eigen::VectorXd& z) {
  using Row = Eigen::Map<const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>>;
  const Eigen::Matrix<Scalar, Eigen::Dynamic, 1> s = r.cast<Scalar>();
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1> sum = s * 0;
  const auto row = [&](Eigen::Index i) { return Row(rows + i * stride, B.cols()); };
  for (Eigen::Index i = 0; i < count; i += kBlock) {
    const Eigen::Index n = std::min(kBlock, count - i);
    turn_block(rows + i * stride, n, stride, B.cols(), &B(first + i, 0), B.rows());
    Eigen::Index j = i;
    for (; j + 4 <= i + n; j += 4) {
      const Scalar y0 = row(j).dot(s), y1 = row(j + 1).dot(s), y2 = row(j + 2).dot(s), y3 = row(j + 3).dot(s);
      sum += (y0 * row(j) + y1 * row(j + 1)) + (y2 * row(j + 2) + y3 * row(j + 3));
    }
    for (; j < i + n; ++j) sum += row(j).dot(s) * row(j);
  }
  z = sum.template cast<double>();
}

}  // namespace

BasisRows read_basis(const Hdf5Reader& h5, const std::string& path, const Hdf5Reader::Shape& stored, Eigen::Index rows,
                     Eigen::Index modes) {
  BasisRows result;
  result.basis.resize(rows, modes);
  if (result.basis.size() == 0) return result;
  prefer_large_pages(result.basis.data(), static_cast<size_t>(result.basis.size()) * sizeof(double));
  const Eigen::VectorXf r = probe(modes);
  const Eigen::Index stride = stored.cols;
  const Eigen::Index chunk = std::max(kBlock, kChunkFloats / stride / kBlock * kBlock);  // rows; sums are by chunk
  const int chunks = static_cast<int>((rows + chunk - 1) / chunk);
  std::vector<Eigen::VectorXd> parts(static_cast<size_t>(chunks));
  const auto size_of = [&](int c) { return std::min(chunk, rows - c * chunk); };
  if (const auto offset = stored.plain_floats) {
    const File file(h5.name());
    parallel_blocks(chunks, 0, [&](int first, int last) {
      std::vector<float> buffer(static_cast<size_t>(std::min(chunk, rows) * stride));
      for (int c = first; c < last; ++c) {
        const auto at = static_cast<std::uint64_t>(c * chunk * stride) * sizeof(float);
        if (!file.read(*offset + at, buffer.data(), static_cast<size_t>(size_of(c) * stride) * sizeof(float)))
          h5.fail(path, "ends before its last row; the file is cut short");
        turn(buffer.data(), size_of(c), stride, c * chunk, r, result.basis, parts[static_cast<size_t>(c)]);
      }
    });
  } else {
    const RowMatrixXd all = h5.matrix(path);
    for (int c = 0; c < chunks; ++c)
      turn(all.data() + c * chunk * stride, size_of(c), stride, c * chunk, r, result.basis,
           parts[static_cast<size_t>(c)]);
  }
  Eigen::VectorXd z = -r.cast<double>();
  for (const Eigen::VectorXd& part : parts) z += part;
  result.finite = z.allFinite();
  result.defect = result.finite ? z.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace facewright
