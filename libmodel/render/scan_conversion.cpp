// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/render/scan_conversion.h"

#include <algorithm>
#include <limits>
#include <string>

#include "libmodel/core/errors.h"
#include "libmodel/render/simd4.h"

namespace facewright {

void check_raster_size(int width, int height) {
  if (width <= 0 || height <= 0 || width > 32768 || height > 32768)
    throw InvalidInput("raster: expected a size of 1..32768 pixels, got " + std::to_string(width) + " x " +
                       std::to_string(height));
}

void check_raster_indices(const Faces& F, Eigen::Index rows) {
  if (F.size() > 0 && (F.minCoeff() < 0 || F.maxCoeff() >= rows))
    throw InvalidInput("raster: a triangle refers to a vertex outside 0.." + std::to_string(rows - 1));
}

ScanList scan_list(const ProjectedVertices& p, const Faces& F, int height, bool cull_backfaces) {
  const Eigen::VectorXd& z = p.perspective() ? p.inverse_w : p.depth;
  std::vector<char> good(static_cast<size_t>(p.pixels.rows()));
  for (Eigen::Index i = 0; i < p.pixels.rows(); ++i)
    good[static_cast<size_t>(i)] =
        std::abs(p.pixels(i, 0)) < 1e9 && std::abs(p.pixels(i, 1)) < 1e9 && std::isfinite(z[i]);
  ScanList list;
  list.items.reserve(static_cast<size_t>(F.rows()));
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const int a = F(f, 0), b = F(f, 1), c = F(f, 2);
    if (!good[static_cast<size_t>(a)] || !good[static_cast<size_t>(b)] || !good[static_cast<size_t>(c)]) continue;
    const BarycentricPlanes planes(p.pixels, a, b, c);
    // Counter-clockwise from outside is clockwise in numbers, because y runs down.
    if (planes.area2 == 0 || (cull_backfaces && planes.area2 > 0)) continue;
    const ScanTriangle scan(static_cast<int>(f), {p.pixels.row(a), p.pixels.row(b), p.pixels.row(c)}, planes.area2,
                            height);
    if (scan.last_row < scan.first_row) continue;
    list.items.push_back({scan, planes.plane(z[a], z[b], z[c]), planes.x0, planes.y0});
  }
  return list;
}

void VisibilityRows::clear_depth(int left, int right, int first, int count) {
  left_ = left, right_ = std::max(left, right), first_ = first, count_ = count;
  const size_t pixels = static_cast<size_t>(right_ - left_) * static_cast<size_t>(count);
  z_.assign(pixels + 4, -std::numeric_limits<float>::infinity());  // whole groups of four are written
}

void VisibilityRows::clear(int left, int right, int first, int count) {
  clear_depth(left, right, first, count);
  triangle_.assign(z_.size(), -1);
}

template <bool with_triangles>
void VisibilityRows::draw(const ScanList::Item& item, int width, int from, int to) {
  const int last = std::min({item.scan.last_row, to, last_row()});
  const auto step = static_cast<float>(item.z.dx);
  for (int y = std::max({item.scan.first_row, from, first_}); y <= last; ++y) {
    auto [begin, end] = item.scan.span(y, width);
    begin = std::max(begin, left_), end = std::min(end, right_);
    if (begin >= end) continue;
    const auto start = static_cast<float>(item.z.value + item.z.dx * (begin - item.x0) + item.z.dy * (y - item.y0));
    float* __restrict z = z_.data() + offset(y) + (begin - left_);
    int* __restrict ids = with_triangles ? triangle_.data() + offset(y) + (begin - left_) : nullptr;
    const int n = end - begin;
    [[maybe_unused]] const Int4 id = {item.scan.id, item.scan.id, item.scan.id, item.scan.id};
    for (int i = 0; i < n; i += 4) {  // lanes past the end are never nearer
      const Int4 lane = Int4{0, 1, 2, 3} + i;
      const Float4 value = broadcast4(start) + broadcast4(step) * __builtin_convertvector(lane, Float4);
      const Float4 old_z = load4<Float4>(z + i);
      const Int4 nearer = (value > old_z) & (lane < n);
      store4(z + i, nearer ? value : old_z);
      if constexpr (with_triangles) store4(ids + i, nearer ? id : load4<Int4>(ids + i));
    }
  }
}

template void VisibilityRows::draw<true>(const ScanList::Item&, int, int, int);
template void VisibilityRows::draw<false>(const ScanList::Item&, int, int, int);

std::vector<std::vector<int>> bands_of(const ScanList& list, int height, int band_rows) {
  std::vector<std::vector<int>> bands(static_cast<size_t>((height + band_rows - 1) / band_rows));
  for (size_t i = 0; i < list.items.size(); ++i) {
    const ScanTriangle& scan = list.items[i].scan;
    for (int band = scan.first_row / band_rows; band <= scan.last_row / band_rows; ++band)
      bands[static_cast<size_t>(band)].push_back(static_cast<int>(i));
  }
  return bands;
}

PixelBox pixel_box(const TexCoords& pixels, int width, int height) {
  const auto range = [&](int column, int size) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (Eigen::Index i = 0; i < pixels.rows(); ++i)
      if (std::abs(pixels(i, column)) < 1e9)
        low = std::min(low, pixels(i, column)), high = std::max(high, pixels(i, column));
    if (!(low <= high)) return std::pair(0, 0);
    const int first = static_cast<int>(std::ceil(std::clamp<double>(low, 0, size)));
    return std::pair(first, std::max(first, static_cast<int>(std::floor(std::clamp<double>(high, -1, size - 1))) + 1));
  };
  PixelBox box;
  std::tie(box.left, box.right) = range(0, width);
  std::tie(box.top, box.bottom) = range(1, height);
  return box;
}

}  // namespace facewright
