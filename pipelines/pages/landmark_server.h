// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "libregister/intake/scan.h"

namespace facewright {

struct LandmarkServerOptions {
  std::filesystem::path output;  ///< folder for ID.json, made when needed; empty: beside each scan
  int port = 0;                  ///< 0 = any that is free
  std::function<void(const std::string&)> saved = {};  ///< called with a line of text for each file written
};

/// Serves the page on which landmarks of scans are placed and corrected by hand, to this machine alone: it listens on
/// the loopback, answers only requests that name it as their host and carry the secret of address(), and writes nothing
/// but the landmark files ID.json, all or nothing. Landmarks stay in the units and axes of their scan; those that were
/// not moved keep their digits and their standard deviations.
class LandmarkServer {
 public:
  /// Throws IoError when the port is taken, InvalidInput for an empty list or a program built without three.js.
  LandmarkServer(std::vector<ScanFiles> scans, const LandmarkServerOptions& options);
  ~LandmarkServer();
  LandmarkServer(const LandmarkServer&) = delete;
  LandmarkServer& operator=(const LandmarkServer&) = delete;

  /// What to open, with the secret.
  const std::string& address() const;
  /// Answers until stop(), which any thread or a signal handler may call.
  void run();
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace facewright
