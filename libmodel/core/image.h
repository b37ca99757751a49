// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace facewright {

/// An 8-bit image, rows from the top, channels interleaved: 1 grey, 3 RGB, 4 RGBA (alpha not premultiplied).
/// Values are sRGB-encoded, as in files; the centre of the top-left pixel is (0, 0).
struct Image {
  int width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> data;

  Image() = default;
  Image(int w, int h, int c, std::uint8_t value = 0)
      : width(w), height(h), channels(c), data(static_cast<size_t>(w) * h * c, value) {}
  bool empty() const { return data.empty(); }
  std::uint8_t* pixel(int x, int y) { return data.data() + (static_cast<size_t>(y) * width + x) * channels; }
  const std::uint8_t* pixel(int x, int y) const {
    return data.data() + (static_cast<size_t>(y) * width + x) * channels;
  }
};

/// sRGB transfer function (IEC 61966-2-1), both on 0..1.
double srgb_from_linear(double linear);
double linear_from_srgb(double encoded);
/// The same for a byte, by table.
double linear_from_srgb8(std::uint8_t encoded);
/// Rounded and clamped.
std::uint8_t srgb8_from_linear(double linear);

/// Bilinear sample in linear RGB (3 values) at pixel position p = (x, y), clamped to the image. Grey is repeated.
Eigen::Vector3d sample_linear(const Image& image, const Eigen::Vector2d& p);

}  // namespace facewright
