// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstddef>
#include <memory>

namespace facewright {

/// Floats that nobody has set yet. Large ones ask for large pages where the system has them: an image of ten megabytes
/// costs its first writer five page faults instead of thousands, which would take longer than the work itself.
class LargeBuffer {
 public:
  LargeBuffer() = default;
  explicit LargeBuffer(std::size_t count);
  float* data() { return data_.get(); }
  const float* data() const { return data_.get(); }

 private:
  struct Free {
    void operator()(float* p) const;
  };
  std::unique_ptr<float[], Free> data_;
};

}  // namespace facewright
