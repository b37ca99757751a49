// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "libmodel/core/random.h"

namespace facewright {

/// A smooth random scalar field of about unit variance: a sum of cosines with wavelengths lo .. hi (mm).
class SmoothField {
 public:
  SmoothField(Random& random, double lo, double hi, int waves = 16) {
    for (int i = 0; i < waves; ++i) {
      Eigen::Vector3d k;
      do k = {random.normal(), random.normal(), random.normal()};
      while (k.norm() < 1e-3);
      const double wavelength = lo * std::pow(hi / lo, random.uniform());
      waves_.push_back({k.normalized() * 2 * std::numbers::pi / wavelength, 2 * std::numbers::pi * random.uniform()});
    }
  }
  double operator()(const Eigen::Vector3d& p) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += std::cos(w.k.dot(p) + w.phase);
    return sum * std::sqrt(2.0 / static_cast<double>(waves_.size()));
  }

 private:
  struct Wave {
    Eigen::Vector3d k;
    double phase;
  };
  std::vector<Wave> waves_;
};

/// Lattice noise in 0..1 with unit lattice spacing, trilinear with smooth steps; the same for the same seed.
inline double lattice_noise(const Eigen::Vector3d& p, std::uint64_t seed) {
  const Eigen::Vector3d f{std::floor(p.x()), std::floor(p.y()), std::floor(p.z())}, t = p - f;
  const auto corner = [&](int dx, int dy, int dz) {
    std::uint64_t z = seed;
    for (const double c : {f.x() + dx, f.y() + dy, f.z() + dz}) {
      z = (z ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(c))) * 0x9e3779b97f4a7c15ULL;
      z ^= z >> 29;
    }
    z *= 0xbf58476d1ce4e5b9ULL;
    return static_cast<double>((z ^ (z >> 32)) >> 11) * 0x1.0p-53;
  };
  const auto s = [](double x) { return x * x * (3 - 2 * x); };
  const double a = s(t.x()), b = s(t.y()), c = s(t.z());
  const auto mix = [](double u, double v, double w) { return u + (v - u) * w; };
  const double lower = mix(mix(corner(0, 0, 0), corner(1, 0, 0), a), mix(corner(0, 1, 0), corner(1, 1, 0), a), b);
  const double upper = mix(mix(corner(0, 0, 1), corner(1, 0, 1), a), mix(corner(0, 1, 1), corner(1, 1, 1), a), b);
  return mix(lower, upper, c);
}

}  // namespace facewright
