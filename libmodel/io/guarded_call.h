// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace facewright {

struct GuardLimits {
  std::uint64_t bytes = std::uint64_t{1} << 31;  ///< that the work may take in addition to what is in use
  int cpu_seconds = 8;                           ///< after which it is ended
};

/// Runs `work` in a copy of this process (fork) and returns the bytes that it returned: a library that a damaged file
/// makes crash, run on or eat memory then ends that copy only. Throws InvalidInput with what the work threw, or with
/// how it ended: "crashed", "took longer than 8 s", "needs more memory than 2048 MB". The work must start no threads
/// and leave no trace outside its result. A few milliseconds.
std::string guarded_call(const std::function<std::string()>& work, const GuardLimits& limits = {});

}  // namespace facewright
