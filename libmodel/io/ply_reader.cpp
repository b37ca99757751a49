// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "libmodel/core/image.h"
#include "libmodel/io/mesh_formats.h"
#include "libmodel/io/ply_header.h"
#include "libmodel/io/text_scanner.h"

namespace facewright {
namespace {

/// One value after the other, from text.
class AsciiSource {
 public:
  AsciiSource(std::string_view body, const std::string& path, int first_line)
      : scan_(body, path), offset_(first_line - 1), path_(path) {}
  double value(PlyType) {
    scan_.skip_space();
    if (scan_.at_end()) fail("the file ends too early");
    try {
      return scan_.number();
    } catch (const IoError& e) {
      throw IoError(path_, scan_.line() + offset_, "expected a finite number");
    }
  }
  size_t most_values(PlyType) const { return scan_.remaining(); }
  [[noreturn]] void fail(const std::string& what) const {
    throw IoError(path_, scan_.line() + offset_, "PLY: " + what);
  }

 private:
  TextScanner scan_;
  int offset_;
  std::string path_;
};

/// One value after the other, from bytes.
class BinarySource {
 public:
  BinarySource(std::string_view body, const std::string& path, PlyEncoding encoding)
      : body_(body),
        path_(path),
        swap_((encoding == PlyEncoding::big_endian) == (std::endian::native == std::endian::little)) {}

  double value(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return take<std::int8_t>();
      case PlyType::uint8:
        return take<std::uint8_t>();
      case PlyType::int16:
        return take<std::int16_t>();
      case PlyType::uint16:
        return take<std::uint16_t>();
      case PlyType::int32:
        return take<std::int32_t>();
      case PlyType::uint32:
        return take<std::uint32_t>();
      case PlyType::float32:
        return take<float>();
      case PlyType::float64:
        return take<double>();
    }
    return 0;
  }
  size_t most_values(PlyType type) const { return (body_.size() - at_) / size_of(type); }
  [[noreturn]] void fail(const std::string& what) const { throw IoError(path_, "PLY: " + what); }

 private:
  template <typename T>
  T take() {
    if (body_.size() - at_ < sizeof(T)) fail("the file ends too early");
    char raw[sizeof(T)];
    std::memcpy(raw, body_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    if (swap_) std::reverse(raw, raw + sizeof(T));
    T out;
    std::memcpy(&out, raw, sizeof(T));
    return out;
  }

  std::string_view body_;
  std::string path_;
  size_t at_ = 0;
  bool swap_;
};

/// Where a vertex property goes: 0..2 position, 3..5 colour, 6..7 texture coordinate, -1 nowhere.
int vertex_slot(const std::string& name) {
  static const std::vector<std::vector<std::string>> slots = {{"x"},
                                                              {"y"},
                                                              {"z"},
                                                              {"red", "diffuse_red", "r"},
                                                              {"green", "diffuse_green", "g"},
                                                              {"blue", "diffuse_blue", "b"},
                                                              {"s", "u", "texture_u"},
                                                              {"t", "v", "texture_v"}};
  for (size_t i = 0; i < slots.size(); ++i)
    if (std::find(slots[i].begin(), slots[i].end(), name) != slots[i].end()) return static_cast<int>(i);
  return -1;
}

/// Largest value of a colour channel: floats run 0..1, integers up to their type's maximum.
double colour_scale(PlyType type) {
  if (type == PlyType::float32 || type == PlyType::float64) return 1;
  return type == PlyType::uint16 ? 65535 : 255;
}

template <typename Source>
class PlyParser {
 public:
  PlyParser(const PlyHeader& header, Source source, NonFinite non_finite = NonFinite::refuse)
      : header_(header), source_(std::move(source)), non_finite_(non_finite) {}

  Mesh parse() {
    bool has_vertices = false;
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex")
        vertices(element), has_vertices = true;
      else if (element.name == "face")
        faces(element);
      else
        skip(element);
    }
    if (!has_vertices) source_.fail("expected an element 'vertex'");
    finish();
    return std::move(mesh_);
  }

 private:
  void vertices(const PlyElement& element) {
    std::vector<int> slots;
    bool has[8] = {};
    double scale = 255;
    for (const PlyProperty& p : element.properties) {
      slots.push_back(p.is_list ? -1 : vertex_slot(p.name));
      if (slots.back() >= 0) has[slots.back()] = true;
      if (slots.back() == 3) scale = colour_scale(p.type);
    }
    if (!has[0] || !has[1] || !has[2]) source_.fail("element 'vertex' has no x, y, z");
    const bool coloured = has[3] && has[4] && has[5], textured = has[6] && has[7];
    mesh_.V.resize(element.count, 3);
    if (coloured) mesh_.colours.resize(element.count, 3);
    if (textured) mesh_.uv.resize(element.count, 2);
    for (Eigen::Index i = 0; i < element.count; ++i) {
      double value[8] = {};
      for (size_t k = 0; k < slots.size(); ++k) {
        const double x = property(element.properties[k]);
        if (slots[k] >= 0) value[slots[k]] = x;
      }
      for (const double x : value)
        if (!std::isfinite(x) && non_finite_ == NonFinite::refuse)
          source_.fail("vertex " + std::to_string(i) + " is not finite");
      mesh_.V.row(i) << value[0], value[1], value[2];
      if (coloured)
        for (int k = 0; k < 3; ++k)
          mesh_.colours(i, k) =
              std::isfinite(value[3 + k]) ? linear_from_srgb(std::clamp(value[3 + k] / scale, 0.0, 1.0)) : 0;
      if (textured) mesh_.uv.row(i) << (std::isfinite(value[6]) ? value[6] : 0), std::isfinite(value[7]) ? value[7] : 0;
    }
  }

  void faces(const PlyElement& element) {
    const auto is_indices = [](const PlyProperty& p) {
      return p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index");
    };
    if (std::none_of(element.properties.begin(), element.properties.end(), is_indices))
      source_.fail("element 'face' has no list vertex_indices");
    for (std::int64_t f = 0; f < element.count; ++f) {
      polygon_.clear();
      coordinates_.clear();
      for (const PlyProperty& p : element.properties) {
        if (is_indices(p))
          list(p, polygon_);
        else if (p.is_list && p.name == "texcoord")
          list(p, coordinates_);
        else
          property(p);
      }
      add_polygon(f);
    }
  }

  void add_polygon(std::int64_t f) {
    const size_t n = polygon_.size();
    if (n < 3) source_.fail("face " + std::to_string(f) + " has " + std::to_string(n) + " corners, expected 3 or more");
    const bool textured = coordinates_.size() == 2 * n;
    const int first_uv = textured ? static_cast<int>(uv_.size() / 2) : -1;
    if (textured) uv_.insert(uv_.end(), coordinates_.begin(), coordinates_.end());
    for (size_t i = 2; i < n; ++i)
      for (const size_t k : {size_t{0}, i - 1, i}) {
        const double index = polygon_[k];
        if (!(index >= 0 && index <= std::numeric_limits<int>::max()))
          source_.fail("face " + std::to_string(f) + " has an impossible vertex index");
        faces_.push_back(static_cast<int>(index));
        uv_faces_.push_back(textured ? first_uv + static_cast<int>(k) : -1);
      }
  }

  void skip(const PlyElement& element) {
    if (element.properties.empty()) return;
    for (std::int64_t i = 0; i < element.count; ++i)
      for (const PlyProperty& p : element.properties) property(p);
  }

  /// The value of a property; a list is read over.
  double property(const PlyProperty& p) {
    if (!p.is_list) return source_.value(p.type);
    list(p, ignored_);
    return 0;
  }

  void list(const PlyProperty& p, std::vector<double>& values) {
    const double n = source_.value(p.count_type);
    if (!(n >= 0) || n > static_cast<double>(source_.most_values(p.type)))
      source_.fail("a list of " + std::to_string(static_cast<std::int64_t>(n)) + " values does not fit into the file");
    values.resize(static_cast<size_t>(n));
    for (double& x : values) x = source_.value(p.type);
  }

  void finish() {
    mesh_.F = Eigen::Map<const Faces>(faces_.data(), static_cast<Eigen::Index>(faces_.size()) / 3, 3);
    if (mesh_.F.size() > 0 && mesh_.F.maxCoeff() >= mesh_.V.rows())
      source_.fail("a face refers to vertex " + std::to_string(mesh_.F.maxCoeff()) + " of " +
                   std::to_string(mesh_.V.rows()));
    if (uv_.empty()) return;
    if (std::any_of(uv_.begin(), uv_.end(), [](double x) { return !std::isfinite(x); }))
      source_.fail("a texture coordinate is not finite");
    mesh_.uv.resize(0, 2);  // wedges win over vertices
    set_wedge_uv(mesh_, Eigen::Map<const TexCoords>(uv_.data(), static_cast<Eigen::Index>(uv_.size()) / 2, 2),
                 Eigen::Map<const Faces>(uv_faces_.data(), static_cast<Eigen::Index>(uv_faces_.size()) / 3, 3));
  }

  const PlyHeader& header_;
  Source source_;
  NonFinite non_finite_;
  Mesh mesh_;
  std::vector<int> faces_, uv_faces_;
  std::vector<double> polygon_, coordinates_, uv_, ignored_;
};

}  // namespace

Mesh parse_ply(std::string_view bytes, const std::string& path, NonFinite non_finite) {
  const PlyHeader header = parse_ply_header(bytes, path);
  const std::string_view body = bytes.substr(header.body_offset);
  if (header.encoding == PlyEncoding::ascii)
    return PlyParser(header, AsciiSource(body, path, header.body_line)).parse();
  return PlyParser(header, BinarySource(body, path, header.encoding), non_finite).parse();
}

}  // namespace facewright
