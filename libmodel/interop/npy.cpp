// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/npy.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/interop/byte_reader.h"
#include "libmodel/interop/byte_writer.h"
#include "libmodel/interop/zip_archive.h"

namespace facewright {
namespace {

template <class T>
std::string matrix_bytes(const std::string& type, const NpyMatrix<T>& m, bool vector) {
  const std::string shape = std::to_string(m.rows()) + "," + (vector ? "" : std::to_string(m.cols()));
  return npy_bytes(type, shape,
                   std::string(reinterpret_cast<const char*>(m.data()), static_cast<size_t>(m.size()) * sizeof(T)));
}

// UTF-8 to code points and back; what is no UTF-8 counts byte by byte.
std::u32string code_points(const std::string& text) {
  std::u32string points;
  for (size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    const size_t more = lead >= 0xf0 ? 3 : lead >= 0xe0 ? 2 : lead >= 0xc0 ? 1 : 0;
    if (more == 0 || i + more >= text.size()) {
      points += static_cast<char32_t>(lead);
      ++i;
      continue;
    }
    char32_t point = lead & (0x3fu >> more);
    for (size_t k = 1; k <= more; ++k) point = point << 6 | (static_cast<unsigned char>(text[i + k]) & 0x3fu);
    points += point;
    i += more + 1;
  }
  return points;
}

void append_utf8(std::string& text, char32_t c) {
  const auto tail = [&](int shift) { text += static_cast<char>(0x80 | ((c >> shift) & 0x3f)); };
  if (c < 0x80) {
    text += static_cast<char>(c);
  } else if (c < 0x800) {
    text += static_cast<char>(0xc0 | (c >> 6));
    tail(0);
  } else if (c < 0x10000) {
    text += static_cast<char>(0xe0 | (c >> 12));
    tail(6), tail(0);
  } else {
    text += static_cast<char>(0xf0 | ((c >> 18) & 7));
    tail(12), tail(6), tail(0);
  }
}

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
NpyArray parse_array(const std::string& bytes, const std::string& name) {
  ByteReader in(bytes, name);
  if (bytes.size() < 12 || in.text(6) != "\x93NUMPY") in.fail("is no NumPy array");
  const auto version = in.value<std::uint8_t>();
  if (version < 1 || version > 3) in.fail("is a NumPy array of format " + std::to_string(version) + "; known: 1 to 3");
  in.value<std::uint8_t>();
  const std::string header = in.text(version == 1 ? in.value<std::uint16_t>() : in.value<std::uint32_t>());
  const auto between = [&](const std::string& left, const std::string& right) {
    const size_t a = header.find(left), b = a == header.npos ? a : header.find(right, a + left.size());
    if (b == header.npos) in.fail("has an unexpected header");
    return header.substr(a + left.size(), b - a - left.size());
  };
  NpyArray array;
  array.type = between("'descr': '", "'");
  if (array.type.find('O') != array.type.npos)
    in.fail("holds Python objects (a pickle), which would run its author's code; save plain arrays");
  array.by_columns = header.find("'fortran_order': True") != header.npos;
  array.shape = parse_shape(between("'shape': (", ")"), in);
  array.data = bytes.substr(in.position());
  return array;
}

template <class From, class To>
void convert(const NpyArray& a, bool by_columns, NpyMatrix<To>& m) {
  const auto values = static_cast<size_t>(m.size());
  for (size_t i = 0; i < values; ++i) {
    From x;
    std::memcpy(&x, a.data.data() + i * sizeof(From), sizeof(From));
    const auto at = static_cast<Eigen::Index>(i);
    (by_columns ? m(at % m.rows(), at / m.rows()) : m.data()[at]) = static_cast<To>(x);
  }
}

}  // namespace

std::string npy_bytes(const std::string& type, const std::string& shape, const std::string& data) {
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

std::string npy_bytes(const NpyMatrix<float>& m, bool vector) { return matrix_bytes("<f4", m, vector); }
std::string npy_bytes(const NpyMatrix<double>& m, bool vector) { return matrix_bytes("<f8", m, vector); }
std::string npy_bytes(const NpyMatrix<std::int32_t>& m, bool vector) { return matrix_bytes("<i4", m, vector); }

std::string npy_bytes(const std::vector<std::string>& names) {
  size_t width = 1;
  std::vector<std::u32string> points;
  for (const std::string& name : names) width = std::max(width, points.emplace_back(code_points(name)).size());
  ByteWriter data;
  for (const std::u32string& name : points)
    for (size_t i = 0; i < width; ++i) data.value(static_cast<std::uint32_t>(i < name.size() ? name[i] : 0));
  return npy_bytes("<U" + std::to_string(width), std::to_string(names.size()) + ",", data.take());
}

NpzArchive::NpzArchive(const std::filesystem::path& path) : path_(path.string()) {
  for (auto& [name, bytes] : read_zip(path)) {
    if (name.ends_with(".npy")) arrays_[name] = parse_array(bytes, path_ + ": " + name);
    bytes = {};
  }
}

void NpzArchive::fail(const std::string& array, const std::string& what) const {
  throw IoError(path_, "array '" + array + "' " + what);
}

const NpyArray& NpzArchive::at(const std::string& name) const {
  const auto entry = arrays_.find(name + ".npy");
  if (entry == arrays_.end()) throw IoError(path_, "there is no array '" + name + "'");
  return entry->second;
}

std::pair<Eigen::Index, Eigen::Index> NpzArchive::size_of(const std::string& name, size_t item,
                                                          Eigen::Index columns) const {
  const NpyArray& a = at(name);
  const size_t dimensions = a.shape.size();
  if (dimensions > 3 || (dimensions == 3 && (columns != Eigen::Dynamic || a.by_columns)))
    fail(name, "has " + std::to_string(dimensions) + " dimensions; expected 1 or 2");
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();  // so that the products cannot wrap
  for (const std::uint64_t length : a.shape)
    if (length > kMost) fail(name, "does not hold the " + std::to_string(length) + " rows it promises");
  const std::uint64_t rows = dimensions == 0 ? 1 : dimensions == 3 ? a.shape[0] * a.shape[1] : a.shape[0];
  const std::uint64_t cols = dimensions < 2 ? 1 : a.shape.back();
  if (columns != Eigen::Dynamic && cols != static_cast<std::uint64_t>(columns))
    fail(name, "has " + std::to_string(cols) + " columns; expected " + std::to_string(columns));
  if (rows > kMost || rows * cols != a.data.size() / item || a.data.size() % item != 0)
    fail(name, "does not hold the " + std::to_string(rows) + " x " + std::to_string(cols) + " numbers it promises");
  return {static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols)};
}

NpyMatrix<double> NpzArchive::real(const std::string& name, Eigen::Index columns) const {
  const NpyArray& a = at(name);
  if (a.type != "<f4" && a.type != "<f8") fail(name, "is of type '" + a.type + "'; expected '<f4' or '<f8'");
  const bool single = a.type == "<f4";
  const auto [rows, cols] = size_of(name, single ? sizeof(float) : sizeof(double), columns);
  NpyMatrix<double> m(rows, cols);
  single ? convert<float>(a, a.by_columns, m) : convert<double>(a, a.by_columns, m);
  if (!m.allFinite()) fail(name, "holds NaN or infinity");
  return m;
}

NpyMatrix<std::int32_t> NpzArchive::whole(const std::string& name, Eigen::Index columns) const {
  const NpyArray& a = at(name);
  const bool narrow = a.type == "<i4" || a.type == "<u4", is_signed = a.type == "<i4" || a.type == "<i8";
  if (!narrow && a.type != "<i8" && a.type != "<u8")
    fail(name, "is of type '" + a.type + "'; expected whole numbers of 32 or 64 bits");
  const auto [rows, cols] = size_of(name, narrow ? 4 : 8, columns);
  NpyMatrix<std::int64_t> wide(rows, cols);
  if (narrow)
    is_signed ? convert<std::int32_t>(a, a.by_columns, wide) : convert<std::uint32_t>(a, a.by_columns, wide);
  else
    convert<std::int64_t>(a, a.by_columns, wide);
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (wide.size() > 0 && (wide.maxCoeff() > kMost || wide.minCoeff() < -kMost)) fail(name, "holds numbers beyond 2^31");
  return wide.cast<std::int32_t>();
}

std::vector<std::string> NpzArchive::names(const std::string& name) const {
  const NpyArray& a = at(name);
  if (!a.type.starts_with("<U") || a.shape.size() != 1)
    fail(name, "is of type '" + a.type + "'; expected a list of text");
  const size_t count = a.shape[0];
  if (count > a.data.size() || (count > 0 && a.data.size() % (4 * count) != 0))
    fail(name, "does not hold what it promises");
  const size_t width = count > 0 ? a.data.size() / count / 4 : 0;
  std::vector<std::string> result(count);
  for (size_t i = 0; i < count; ++i)
    for (size_t k = 0; k < width; ++k) {
      std::uint32_t c = 0;
      std::memcpy(&c, a.data.data() + 4 * (i * width + k), 4);
      if (c != 0) append_utf8(result[i], c);
    }
  return result;
}

}  // namespace facewright
