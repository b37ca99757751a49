// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace facewright {

// Private to this module: NumPy's .npy arrays, and archives of them.

template <class T>
using NpyMatrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The bytes of an array: type such as "<f4", shape such as "12,3" or "12,", data by rows.
std::string npy_bytes(const std::string& type, const std::string& shape, const std::string& data);
std::string npy_bytes(const NpyMatrix<float>& m, bool vector = false);
std::string npy_bytes(const NpyMatrix<double>& m, bool vector = false);
std::string npy_bytes(const NpyMatrix<std::int32_t>& m, bool vector = false);
/// Text as NumPy's UTF-32 ("<U12").
std::string npy_bytes(const std::vector<std::string>& names);

struct NpyArray {
  std::string type;  ///< "<f4", ...
  bool by_columns = false;
  std::vector<std::uint64_t> shape;
  std::string data;
};

/// An .npz archive. Errors name the file, the array, what was expected and what came; nothing is trusted: sizes are
/// compared with the data before memory is taken, arrays of Python objects are refused.
class NpzArchive {
 public:
  explicit NpzArchive(const std::filesystem::path& path);
  bool has(const std::string& name) const { return arrays_.count(name + ".npy") > 0; }
  const NpyArray& at(const std::string& name) const;
  /// Numbers of any size as a matrix of `columns` columns (any number if Dynamic); a vector is one column, an array of
  /// three dimensions (a, b, c) is a matrix (a * b) x c.
  NpyMatrix<double> real(const std::string& name, Eigen::Index columns = Eigen::Dynamic) const;
  /// The same for whole numbers, which must fit into 32 bits.
  NpyMatrix<std::int32_t> whole(const std::string& name, Eigen::Index columns = Eigen::Dynamic) const;
  std::vector<std::string> names(const std::string& name) const;
  [[noreturn]] void fail(const std::string& array, const std::string& what) const;
  const std::string& path() const { return path_; }

 private:
  std::pair<Eigen::Index, Eigen::Index> size_of(const std::string& name, size_t item, Eigen::Index columns) const;
  std::string path_;
  std::map<std::string, NpyArray> arrays_;
};

}  // namespace facewright
