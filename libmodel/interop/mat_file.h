// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace facewright {

// Private to this module.

/// The numeric arrays of a MATLAB file (version 4, 5, 6, 7 or 7.3), by name; "shp.mu" is a field of a structure. Sizes
/// are compared with the size of the file before memory is taken. Throws IoError naming the variable.
class MatFile {
 public:
  explicit MatFile(const std::filesystem::path& path);
  ~MatFile();
  MatFile(MatFile&&) noexcept;
  const std::vector<std::string>& names() const;
  bool has(const std::string& name) const;
  /// Any real numeric array as a matrix, of `rows` and `columns` unless these are Dynamic; never NaN.
  Eigen::MatrixXd matrix(const std::string& name, Eigen::Index rows = Eigen::Dynamic,
                         Eigen::Index columns = Eigen::Dynamic) const;
  /// A row or a column.
  Eigen::VectorXd vector(const std::string& name) const;
  /// (M x 3) from (M x 3) or (3 x M) whole numbers.
  Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> triangles(const std::string& name) const;
  [[noreturn]] void fail(const std::string& name, const std::string& what) const;

 private:
  Eigen::MatrixXd hdf5_matrix(const std::string& name) const;
  Eigen::MatrixXd matio_matrix(const std::string& name) const;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace facewright
