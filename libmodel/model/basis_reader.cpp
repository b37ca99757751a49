// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/basis_reader.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

#include "libmodel/core/parallel.h"
#include "libmodel/core/random.h"

namespace facewright {
namespace {

constexpr Eigen::Index kChunk = 1024;  // rows taken from the file at once; sums are by chunk, in order
constexpr Eigen::Index kBlock = 32;    // rows turned at once: 32 x 200 floats stay in the first cache

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

// A fresh matrix costs more in page faults of 4 KB than in copying; a hint only, so its failure does not matter.
void prefer_huge_pages([[maybe_unused]] double* data, [[maybe_unused]] size_t bytes) {
#ifdef MADV_HUGEPAGE
  constexpr std::uintptr_t page = 4096;
  const std::uintptr_t first = (reinterpret_cast<std::uintptr_t>(data) + page - 1) / page * page;
  const std::uintptr_t last = (reinterpret_cast<std::uintptr_t>(data) + bytes) / page * page;
  if (last > first + (1u << 21)) ::madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
#endif
}

// Any r without zeros will do; a fixed one makes the same answer every time.
Eigen::VectorXf probe(Eigen::Index modes) {
  Random random(1);
  Eigen::VectorXf r(modes);
  for (float& x : r) x = static_cast<float>(random.uniform(0.5, 1.5) * (random.bits() & 1 ? 1 : -1));
  return r;
}

// B is written in blocks; z sums B'(B r) over the rows given. A NaN or an infinity anywhere in them makes one in z.
template <class Scalar>
void turn(const Scalar* rows, Eigen::Index count, Eigen::Index stride, Eigen::Index first, const Eigen::VectorXf& r,
          Eigen::MatrixXd& B, Eigen::VectorXd& z) {
  using Rows = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  const Vector s = r.cast<Scalar>();
  Vector sum = Vector::Zero(B.cols());
  for (Eigen::Index i = 0; i < count; i += kBlock) {
    const Eigen::Index n = std::min(kBlock, count - i);
    const Eigen::Map<const Rows, 0, Eigen::OuterStride<>> block(rows + i * stride, n, B.cols(),
                                                                Eigen::OuterStride<>(stride));
    for (Eigen::Index k = 0; k < B.cols(); ++k) {
      const Scalar* from = block.data() + k;
      double* to = &B(first + i, k);
      for (Eigen::Index j = 0; j < n; ++j) to[j] = static_cast<double>(from[j * stride]);
    }
    for (Eigen::Index j = 0; j < n; ++j) sum += block.row(j).dot(s) * block.row(j).transpose();
  }
  z = sum.template cast<double>();
}

}  // namespace

BasisRows read_basis(const Hdf5Reader& h5, const std::string& path, Eigen::Index rows, Eigen::Index modes) {
  BasisRows result;
  result.basis.resize(rows, modes);
  if (result.basis.size() == 0) return result;
  prefer_huge_pages(result.basis.data(), static_cast<size_t>(result.basis.size()) * sizeof(double));
  const Eigen::VectorXf r = probe(modes);
  const int chunks = static_cast<int>((rows + kChunk - 1) / kChunk);
  std::vector<Eigen::VectorXd> parts(static_cast<size_t>(chunks));
  const auto size_of = [&](int c) { return std::min(kChunk, rows - c * kChunk); };
  const Eigen::Index stride = h5.shape(path).cols;
  if (const auto offset = h5.plain_floats(path)) {
    const File file(h5.name());
    parallel_blocks(chunks, 0, [&](int first, int last) {
      std::vector<float> buffer(static_cast<size_t>(std::min(kChunk, rows) * stride));
      for (int c = first; c < last; ++c) {
        const auto at = static_cast<std::uint64_t>(c * kChunk * stride) * sizeof(float);
        if (!file.read(*offset + at, buffer.data(), static_cast<size_t>(size_of(c) * stride) * sizeof(float)))
          h5.fail(path, "ends before its last row; the file is cut short");
        turn(buffer.data(), size_of(c), stride, c * kChunk, r, result.basis, parts[static_cast<size_t>(c)]);
      }
    });
  } else {
    const RowMatrixXd all = h5.matrix(path);
    for (int c = 0; c < chunks; ++c)
      turn(all.data() + c * kChunk * stride, size_of(c), stride, c * kChunk, r, result.basis,
           parts[static_cast<size_t>(c)]);
  }
  Eigen::VectorXd z = -r.cast<double>();
  for (const Eigen::VectorXd& part : parts) z += part;
  result.finite = z.allFinite();
  result.defect = result.finite ? z.cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace facewright
