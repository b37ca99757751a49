// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace facewright {

/// Wall seconds of each stage of a job, in their order.
using StageSeconds = std::vector<std::pair<std::string, double>>;

/// Appends to `seconds` how long each stage took since the one before.
class StageClock {
 public:
  explicit StageClock(StageSeconds* seconds) : seconds_(seconds) {}
  void finish(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds_->emplace_back(stage, std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }

 private:
  StageSeconds* seconds_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace facewright
