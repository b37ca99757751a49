// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace facewright {

int hardware_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

void parallel_for(int n, int threads, const std::function<void(int)>& body) {
  threads = std::min(threads > 0 ? threads : hardware_threads(), n);
  if (threads <= 1) {
    for (int i = 0; i < n; ++i) body(i);
    return;
  }
  std::atomic<int> next{0};
  std::mutex mutex;
  std::exception_ptr error;
  int error_index = n;
  const auto work = [&] {
    for (int i = next++; i < n; i = next++) {
      try {
        body(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (i < error_index) error = std::current_exception(), error_index = i;
        next = n;
      }
    }
  };
  std::vector<std::jthread> pool;
  for (int t = 1; t < threads; ++t) pool.emplace_back(work);
  work();
  pool.clear();
  if (error) std::rethrow_exception(error);
}

void parallel_blocks(int n, int threads, const std::function<void(int, int)>& body) {
  threads = std::max(1, std::min(threads > 0 ? threads : hardware_threads(), n));
  const int blocks = std::min(n, threads * 4);
  if (blocks <= 1 || threads == 1) {
    if (n > 0) body(0, n);
    return;
  }
  const auto edge = [&](int b) { return static_cast<int>(static_cast<long long>(n) * b / blocks); };
  parallel_for(blocks, threads, [&](int b) { body(edge(b), edge(b + 1)); });
}

}  // namespace facewright
