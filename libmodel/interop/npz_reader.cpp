// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <map>

#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/npz.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

struct Array {
  std::string type, data;
  std::vector<Eigen::Index> shape;
};

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
  const std::string shape = between("'shape': (", ")");
  for (size_t at = 0; at < shape.size(); ++at)
    if (std::isdigit(static_cast<unsigned char>(shape[at]))) {
      size_t length = 0;
      array.shape.push_back(std::stoll(shape.substr(at), &length));
      at += length;
    }
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
  template <class T>
  Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> matrix(const std::string& name,
                                                                           const std::string& type) const {
    const Array& a = at(name);
    const Eigen::Index rows = a.shape.empty() ? 1 : a.shape[0], cols = a.shape.size() < 2 ? 1 : a.shape[1];
    if (a.type != type || a.data.size() != static_cast<size_t>(rows * cols) * sizeof(T))
      throw IoError(name_, "array '" + name + "' is not of type " + type + " or is cut short");
    Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> m(rows, cols);
    std::memcpy(m.data(), a.data.data(), a.data.size());
    return m;
  }
  PcaModel pca(const std::string& name) const {
    PcaModel result;
    const auto mean = matrix<float>(name + "_mean", "<f4");
    result.mean = Eigen::Map<const Eigen::VectorXf>(mean.data(), mean.size()).cast<double>();
    result.basis = matrix<float>(name + "_basis", "<f4").cast<double>();
    result.variances = matrix<float>(name + "_variances", "<f4").cast<double>();
    return result;
  }
  const std::string& name() const { return name_; }

 private:
  std::string name_;
  std::map<std::string, Array> arrays_;
};

LandmarkSet read_marks(const Archive& archive, const Faces& F) {
  LandmarkSet marks;
  const auto vertices = archive.matrix<std::int32_t>("landmark_vertices", "<i4");
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
  const Faces F = archive.matrix<std::int32_t>("faces", "<i4");
  p.landmarks = read_marks(archive, F);
  if (archive.has("uv")) p.uv = archive.matrix<double>("uv", "<f8");
  if (archive.has("mirror")) {
    const auto mirror = archive.matrix<std::int32_t>("mirror", "<i4");
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
