// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/large_buffer.h"

#include <cstdlib>
#include <new>
#ifdef __linux__
#include <sys/mman.h>
#endif

namespace facewright {

LargeBuffer::LargeBuffer(std::size_t count) {
  constexpr std::size_t page = 64, large_page = std::size_t{2} << 20;
  const std::size_t bytes = count * sizeof(float);
  const std::size_t alignment = bytes >= large_page ? large_page : page;
  const std::size_t rounded = (bytes + alignment - 1) / alignment * alignment;
  data_.reset(static_cast<float*>(std::aligned_alloc(alignment, rounded > 0 ? rounded : alignment)));
  if (!data_) throw std::bad_alloc();
#ifdef __linux__
  if (alignment == large_page) madvise(data_.get(), rounded, MADV_HUGEPAGE);  // a wish: failing is fine
#endif
}

void LargeBuffer::Free::operator()(float* p) const { std::free(p); }

}  // namespace facewright
