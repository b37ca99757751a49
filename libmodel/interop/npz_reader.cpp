// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <charconv>
#include <limits>
#include <map>

#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/npz.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

struct Array {
  std::string type, data;
  std::vector<std::uint64_t> shape;
};

// The lengths of a tuple such as "12,3" or "12,".
std::vector<std::uint64_t> parse_shape(const std::string& text, const ByteReader& in) {
  std::vector<std::uint64_t> shape;
  for (const char *at = text.data(), *const end = at + text.size(); at != end;) {
    if (*at == ',' || *at == ' ') {
      ++at;
      continue;
    }
    const auto [next, error] = std::from_chars(at, end, shape.emplace_back());
    if (error != std::errc()) in.fail("has the shape (" + text + "), which is none");
    at = next;
  }
  return shape;
}

// The parts of a header {'descr': '<f4', 'fortran_order': False, 'shape': (12,3), } that matter.
Array parse_array(const std::string& bytes, const std::string& name) {
  ByteReader in(bytes, name);
  if (in.text(6) != "\x93NUMPY" || in.value<std::uint8_t>() != 1) in.fail("is no NumPy array of format 1");
  in.value<std::uint8_t>();
  const std::string header = in.text(in.value<std::uint16_t>());
  const auto between = [&](const std::string& left, const std::string& right) {
    const size_t a = header.find(left), b = a == header.npos ? a : header.find(right, a + left.size());
    if (b == header.npos) in.fail("has an unexpected header");
    return header.substr(a + left.size(), b - a - left.size());
  };
  Array array{between("'descr': '", "'"), bytes.substr(in.position()), {}};
  if (header.find("'fortran_order': False") == header.npos) in.fail("is stored by columns; rows are expected");
  array.shape = parse_shape(between("'shape': (", ")"), in);
  return array;
}

std::map<std::string, Array> read_archive(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  ByteReader in(bytes, path.string());
  constexpr size_t kEnd = 22;  // bytes of the record that ends an archive without comment
  if (bytes.size() < kEnd || bytes.compare(bytes.size() - kEnd, 4, "PK\x05\x06") != 0)
    in.fail("is no zip archive, or is cut short");
  std::map<std::string, Array> arrays;
  while (in.value<std::uint32_t>() == 0x04034b50) {
    in.text(4);  // version, flags
    if (in.value<std::uint16_t>() != 0) in.fail("is compressed; save it with numpy.savez");
    in.text(8);  // time, date, checksum
    const auto size = in.value<std::uint32_t>();
    in.value<std::uint32_t>();
    const auto name_size = in.value<std::uint16_t>(), extra = in.value<std::uint16_t>();
    const std::string name = in.text(name_size);
    in.text(extra);
    arrays[name] = parse_array(in.text(size), path.string() + ": " + name);
  }
  return arrays;
}

class Archive {
 public:
  explicit Archive(const std::filesystem::path& path) : name_(path.string()), arrays_(read_archive(path)) {}
  bool has(const std::string& name) const { return arrays_.count(name + ".npy") > 0; }
  const Array& at(const std::string& name) const {
    const auto entry = arrays_.find(name + ".npy");
    if (entry == arrays_.end()) throw IoError(name_, "there is no array '" + name + "'");
    return entry->second;
  }
  // A matrix of `columns` columns (or any number, if Dynamic); a vector is one column.
  template <class T>
  Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> matrix(const std::string& name,
                                                                           const std::string& type,
                                                                           Eigen::Index columns) const {
    const Array& a = at(name);
    const auto fail = [&](const std::string& what) { throw IoError(name_, "array '" + name + "' " + what); };
    if (a.type != type) fail("is of type '" + a.type + "'; expected '" + type + "'");
    if (a.shape.size() > 2) fail("has " + std::to_string(a.shape.size()) + " dimensions; expected 1 or 2");
    const std::uint64_t rows = a.shape.empty() ? 1 : a.shape[0], cols = a.shape.size() < 2 ? 1 : a.shape[1];
    if (columns != Eigen::Dynamic && cols != static_cast<std::uint64_t>(columns))
      fail("has " + std::to_string(cols) + " columns; expected " + std::to_string(columns));
    constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();  // so that the product cannot wrap
    if (rows > kMost || cols > kMost || rows * cols != a.data.size() / sizeof(T) || a.data.size() % sizeof(T) != 0)
      fail("does not hold the " + std::to_string(rows) + " x " + std::to_string(cols) + " numbers it promises");
    Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> m(static_cast<Eigen::Index>(rows),
                                                                        static_cast<Eigen::Index>(cols));
    if (m.size() > 0) std::memcpy(m.data(), a.data.data(), a.data.size());
    return m;
  }
  PcaModel pca(const std::string& name) const {
    PcaModel result;
    const auto mean = matrix<float>(name + "_mean", "<f4", 3);
    result.mean = Eigen::Map<const Eigen::VectorXf>(mean.data(), mean.size()).cast<double>();
    result.basis = matrix<float>(name + "_basis", "<f4", Eigen::Dynamic).cast<double>();
    result.variances = matrix<float>(name + "_variances", "<f4", 1).cast<double>();
    return result;
  }

 private:
  std::string name_;
  std::map<std::string, Array> arrays_;
};

LandmarkSet read_marks(const Archive& archive, const Faces& F) {
  LandmarkSet marks;
  const auto vertices = archive.matrix<std::int32_t>("landmark_vertices", "<i4", 1);
  const Array& names = archive.at("landmark_names");  // '<U12': twelve code points each, the rest zero
  const size_t count = static_cast<size_t>(vertices.size()), width = count > 0 ? names.data.size() / count : 0;
  for (size_t i = 0; i < count; ++i) {
    std::string name;
    for (size_t k = 0; k + 4 <= width; k += 4)
      if (const char c = names.data[i * width + k]; c != '\0') name += c;
    const int v = vertices(static_cast<Eigen::Index>(i));
    marks[name] = {point_at_vertex(F, v), v};
  }
  return marks;
}

}  // namespace

MorphableModel read_npz_model(const std::filesystem::path& path) {
  const Archive archive(path);
  MorphableModelParts p;
  p.shape = archive.pca("shape");
  if (archive.has("colour_mean")) p.colour = archive.pca("colour");
  if (archive.has("expression_mean")) p.expression = archive.pca("expression");
  const Faces F = archive.matrix<std::int32_t>("faces", "<i4", 3);
  p.landmarks = read_marks(archive, F);
  if (archive.has("uv")) p.uv = archive.matrix<double>("uv", "<f8", 2);
  if (archive.has("mirror")) {
    const auto mirror = archive.matrix<std::int32_t>("mirror", "<i4", 1);
    p.mirror.assign(mirror.data(), mirror.data() + mirror.size());
  }
  p.levels = {{static_cast<int>(p.shape.vertex_count()), F}};
  try {
    return MorphableModel(std::move(p));
  } catch (const InvalidInput& error) {
    throw IoError(path.string(), error.what());
  }
}

}  // namespace facewright
