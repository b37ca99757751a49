// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <limits>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/io/mesh_formats.h"
#include "libmodel/io/text_scanner.h"

namespace facewright {
namespace {

struct Corner {
  int v = -1, vt = -1;
};

/// State of one parse: flat arrays that become the mesh's matrices at the end.
class ObjParser {
 public:
  ObjParser(std::string_view text, const std::string& path) : scan_(text, path), path_(path) {}

  Mesh parse() {
    for (; !scan_.at_end(); scan_.next_line()) {
      const std::string_view keyword = scan_.token();
      if (keyword == "v")
        vertex();
      else if (keyword == "vt")
        texture_coordinate();
      else if (keyword == "f")
        face();
    }
    return finish();
  }

 private:
  void vertex() {
    double x[7];
    const int n = numbers(x, 7);
    if (n < 3) scan_.fail("vertex: expected 3 coordinates, got " + std::to_string(n));
    positions_.insert(positions_.end(), x, x + 3);
    if (n >= 6) colours_.insert(colours_.end(), x + n - 3, x + n);  // after x y z or x y z w
  }

  void texture_coordinate() {
    double x[3] = {0, 0, 0};
    if (numbers(x, 3) < 1) scan_.fail("vt: expected 2 coordinates, got none");
    uv_.insert(uv_.end(), x, x + 2);
  }

  int numbers(double* x, int most) {
    int n = 0;
    while (n < most && scan_.more_on_line()) x[n++] = scan_.number();
    return n;
  }

  void face() {
    polygon_.clear();
    while (scan_.more_on_line()) polygon_.push_back(corner());
    if (polygon_.size() < 3) scan_.fail("face: expected 3 or more corners, got " + std::to_string(polygon_.size()));
    for (size_t i = 2; i < polygon_.size(); ++i)
      for (const Corner& c : {polygon_[0], polygon_[i - 1], polygon_[i]}) {
        faces_.push_back(c.v);
        uv_faces_.push_back(c.vt);
        has_wedges_ = has_wedges_ || c.vt >= 0;
      }
  }

  Corner corner() {  // v, v/vt, v//vn or v/vt/vn
    Corner c;
    c.v = resolve(scan_.integer(), positions_.size() / 3, "vertex", highest_v_);
    if (scan_.accept('/')) {
      if (!scan_.accept('/')) {
        if (!scan_.at_token_end()) c.vt = resolve(scan_.integer(), uv_.size() / 2, "texture coordinate", highest_vt_);
        if (scan_.accept('/') && !scan_.at_token_end()) scan_.integer();
      } else {
        scan_.integer();
      }
    }
    if (!scan_.at_token_end()) scan_.fail("face: expected v, v/vt, v//vn or v/vt/vn");
    return c;
  }

  /// The highest index seen in a face, and where. Vertices may follow the faces, so it is checked at the end.
  struct Highest {
    int index = -1, line = 0;
  };

  /// 0-based; negative indices count back from the latest.
  int resolve(long long index, size_t count, const char* what, Highest& highest) {
    const long long zero_based = index > 0 ? index - 1 : static_cast<long long>(count) + index;
    if (index == 0 || zero_based < 0 || zero_based > std::numeric_limits<int>::max())
      scan_.fail(std::string("face: ") + what + " " + std::to_string(index) + " does not exist");
    if (zero_based > highest.index) highest = {static_cast<int>(zero_based), scan_.line()};
    return static_cast<int>(zero_based);
  }

  void check(const Highest& highest, size_t count, const char* what) const {
    if (highest.index < 0 || static_cast<size_t>(highest.index) < count) return;
    throw IoError(path_, highest.line,
                  std::string("face: ") + what + " " + std::to_string(highest.index + 1LL) +
                      " does not exist, the file has " + std::to_string(count));
  }

  Mesh finish() {
    check(highest_v_, positions_.size() / 3, "vertex");
    check(highest_vt_, uv_.size() / 2, "texture coordinate");
    Mesh mesh;
    const auto rows = [](const auto& flat, int columns) { return static_cast<Eigen::Index>(flat.size()) / columns; };
    mesh.V = Eigen::Map<const Vertices>(positions_.data(), rows(positions_, 3), 3);
    mesh.F = Eigen::Map<const Faces>(faces_.data(), rows(faces_, 3), 3);
    if (!colours_.empty() && colours_.size() == positions_.size()) mesh.colours = linear_colours();
    if (has_wedges_)
      set_wedge_uv(mesh, Eigen::Map<const TexCoords>(uv_.data(), rows(uv_, 2), 2),
                   Eigen::Map<const Faces>(uv_faces_.data(), rows(uv_faces_, 3), 3));
    return mesh;
  }

  Colours linear_colours() const {
    Colours c = Eigen::Map<const Colours>(colours_.data(), static_cast<Eigen::Index>(colours_.size()) / 3, 3);
    if (c.maxCoeff() > 1) c /= 255;
    return c.unaryExpr([](double x) { return linear_from_srgb(std::clamp(x, 0.0, 1.0)); });
  }

  TextScanner scan_;
  std::string path_;
  std::vector<double> positions_, colours_, uv_;
  std::vector<int> faces_, uv_faces_;
  std::vector<Corner> polygon_;
  bool has_wedges_ = false;
  Highest highest_v_, highest_vt_;
};

}  // namespace

Mesh parse_obj(std::string_view text, const std::string& path) { return ObjParser(text, path).parse(); }

}  // namespace facewright
