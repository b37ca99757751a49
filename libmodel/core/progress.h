// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <functional>
#include <string>

namespace facewright {

/// A step of long work: `done` of `total` items of `stage`. Libraries call it, programs draw it; it may be empty and
/// must be safe to call from several threads.
struct ProgressEvent {
  std::string stage;
  int done = 0, total = 0;
  std::string item;  ///< what was just finished, may be empty
};
using Progress = std::function<void(const ProgressEvent&)>;

}  // namespace facewright
