// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/large_buffer.h"

#include <cstdlib>
#include <new>

#include "libmodel/core/large_pages.h"

namespace facewright {

LargeBuffer::LargeBuffer(std::size_t count) {
  constexpr std::size_t cache_line = 64, large_page = std::size_t{2} << 20;
  const std::size_t bytes = count * sizeof(float);
  const std::size_t alignment = bytes >= large_page ? large_page : cache_line;
  const std::size_t rounded = (bytes + alignment - 1) / alignment * alignment;
  data_.reset(static_cast<float*>(std::aligned_alloc(alignment, rounded > 0 ? rounded : alignment)));
  if (!data_) throw std::bad_alloc();
  if (alignment == large_page) prefer_large_pages(data_.get(), rounded);
}

void LargeBuffer::Free::operator()(float* p) const { std::free(p); }

}  // namespace facewright
