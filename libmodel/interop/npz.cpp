// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/npz.h"

#include <array>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/interop/byte_writer.h"

namespace facewright {
namespace {

template <class T>
using RowMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

std::uint32_t crc32(const std::string& bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      t[i] = i;
      for (int k = 0; k < 8; ++k) t[i] = t[i] & 1 ? 0xedb88320u ^ (t[i] >> 1) : t[i] >> 1;
    }
    return t;
  }();
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) crc = table[(crc ^ static_cast<unsigned char>(c)) & 0xff] ^ (crc >> 8);
  return crc ^ 0xffffffffu;
}

// An uncompressed zip archive.
class Zip {
 public:
  void add(const std::string& name, const std::string& content) {
    if (content.size() > 0xfffffff0u || out_.size() + content.size() > 0xfffffff0u)
      throw InvalidInput("npz: '" + name + "' makes the archive larger than 4 GB");
    const auto offset = static_cast<std::uint32_t>(out_.size());
    const std::uint32_t crc = crc32(content);
    out_.value(std::uint32_t{0x04034b50});
    describe(out_, name, content, crc);
    out_.text(name);
    out_.text(content);
    directory_.value(std::uint32_t{0x02014b50});
    directory_.value(std::uint16_t{20});  // made by version 2.0
    describe(directory_, name, content, crc);
    for (int i = 0; i < 3; ++i) directory_.value(std::uint16_t{0});  // comment, disk, internal attributes
    directory_.value(std::uint32_t{0});                              // external attributes
    directory_.value(offset);
    directory_.text(name);
    ++count_;
  }
  std::string finish() {
    const auto offset = static_cast<std::uint32_t>(out_.size()), size = static_cast<std::uint32_t>(directory_.size());
    out_.text(directory_.bytes());
    out_.value(std::uint32_t{0x06054b50});
    out_.value(std::uint32_t{0});  // disks
    out_.value(count_);
    out_.value(count_);
    out_.value(size);
    out_.value(offset);
    out_.value(std::uint16_t{0});
    return out_.take();
  }

 private:
  static void describe(ByteWriter& out, const std::string& name, const std::string& content, std::uint32_t crc) {
    out.value(std::uint16_t{20});                       // needs version 2.0
    out.value(std::uint16_t{0});                        // flags
    out.value(std::uint16_t{0});                        // stored
    out.value(std::uint16_t{0});                        // time
    out.value(std::uint16_t{(0 << 9) | (1 << 5) | 1});  // date: 1 January 1980, so that equal content is equal bytes
    out.value(crc);
    out.value(static_cast<std::uint32_t>(content.size()));
    out.value(static_cast<std::uint32_t>(content.size()));
    out.value(static_cast<std::uint16_t>(name.size()));
    out.value(std::uint16_t{0});  // extra field
  }
  ByteWriter out_, directory_;
  std::uint16_t count_ = 0;
};

std::string npy(const std::string& type, const std::string& shape, const std::string& data) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  while ((10 + header.size() + 1) % 64) header += ' ';
  header += '\n';
  ByteWriter out;
  out.text("\x93NUMPY");
  out.value(std::uint8_t{1});
  out.value(std::uint8_t{0});
  out.value(static_cast<std::uint16_t>(header.size()));
  out.text(header);
  out.text(data);
  return out.take();
}

template <class T>
std::string npy(const std::string& type, const RowMatrix<T>& m, bool vector = false) {
  const std::string shape = std::to_string(m.rows()) + "," + (vector ? "" : std::to_string(m.cols()));
  return npy(type, shape,
             std::string(reinterpret_cast<const char*>(m.data()), static_cast<size_t>(m.size()) * sizeof(T)));
}

std::string npy_names(const LandmarkSet& landmarks) {
  size_t width = 1;
  for (const auto& entry : landmarks) width = std::max(width, entry.first.size());
  ByteWriter data;
  for (const auto& entry : landmarks)
    for (size_t i = 0; i < width; ++i)
      data.value(static_cast<std::uint32_t>(i < entry.first.size() ? static_cast<unsigned char>(entry.first[i]) : 0));
  return npy("<U" + std::to_string(width), std::to_string(landmarks.size()) + ",", data.take());
}

void add_pca(Zip& zip, const std::string& name, const PcaModel& pca) {
  zip.add(name + "_mean.npy", npy<float>("<f4", as_vertices(pca.mean).cast<float>()));
  zip.add(name + "_basis.npy", npy<float>("<f4", pca.basis.cast<float>()));
  zip.add(name + "_variances.npy", npy<float>("<f4", pca.variances.cast<float>(), true));
}

}  // namespace

std::string npz_bytes(const MorphableModel& model) {
  if (model.level_count() != 1) throw InvalidInput("npz: a file holds one level; choose one");
  Zip zip;
  add_pca(zip, "shape", model.shape());
  if (model.has_colour()) add_pca(zip, "colour", model.colour());
  if (model.expression()) add_pca(zip, "expression", *model.expression());
  zip.add("faces.npy", npy<std::int32_t>("<i4", model.faces()));
  if (model.uv().rows() > 0) zip.add("uv.npy", npy<double>("<f8", model.uv()));
  if (!model.mirror().empty())
    zip.add(
        "mirror.npy",
        npy<std::int32_t>("<i4", Eigen::Map<const Eigen::VectorXi>(model.mirror().data(), model.vertex_count()), true));
  RowMatrix<std::int32_t> vertices(static_cast<Eigen::Index>(model.landmarks().size()), 1);
  Eigen::Index i = 0;
  for (const auto& entry : model.landmarks()) vertices(i++, 0) = entry.second.vertex;
  zip.add("landmark_vertices.npy", npy<std::int32_t>("<i4", vertices, true));
  zip.add("landmark_names.npy", npy_names(model.landmarks()));
  return zip.finish();
}

}  // namespace facewright
