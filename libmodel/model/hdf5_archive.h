// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace facewright {

// Not installed: the part of HDF5 that model files of this module and of interop need. Paths are absolute
// ("/shape/model/mean"); missing groups on the way are made. Everything is contiguous, little-endian and row-major,
// strings are fixed-length, NUL-terminated and scalar, and no time stamps are kept, so equal content is equal bytes.

using RowMatrixXf = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using RowMatrixXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using RowMatrixXi = Eigen::Matrix<std::int32_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Composes a file in memory.
class Hdf5Writer {
 public:
  Hdf5Writer();
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  void matrix(const std::string& path, const RowMatrixXf& values);
  void matrix(const std::string& path, const RowMatrixXd& values);
  void matrix(const std::string& path, const RowMatrixXi& values);
  void vector(const std::string& path, const Eigen::VectorXf& values);
  void vector(const std::string& path, const std::vector<std::int32_t>& values);
  void scalar(const std::string& path, std::int32_t value);
  void string(const std::string& path, const std::string& text);
  void attribute(const std::string& path, const std::string& name, const std::string& text);
  void group(const std::string& path);
  /// A second name for an object, at no cost.
  void link(const std::string& new_path, const std::string& existing);
  std::string bytes();

 private:
  void dataset(const std::string& path, const std::vector<std::uint64_t>& shape, std::int64_t file_type,
               std::int64_t memory_type, const void* data);
  std::int64_t file_ = -1;
};

/// Reads an HDF5 file, or HDF5-JSON (by its first byte, `{`); all failures are IoError naming the file and the path
/// within.
class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::filesystem::path& file);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  const std::string& name() const { return name_; }
  bool has(const std::string& path) const;
  /// Names in a group, in alphabetical order; empty if there is no such group.
  std::vector<std::string> children(const std::string& group) const;
  /// Rows and columns, as matrix() gives them.
  struct Shape {
    Eigen::Index rows = 0, cols = 0;
    /// Where in the file the values lie if they are plain: little-endian float32, all there, one after another by
    /// rows. Nothing if they are not; then matrix() reads them.
    std::optional<std::uint64_t> plain_floats = std::nullopt;
  };
  Shape shape(const std::string& path) const;
  /// Scalars come as 1 x 1, vectors as one column, any numeric type is converted.
  RowMatrixXd matrix(const std::string& path) const;
  RowMatrixXi integers(const std::string& path) const;
  std::string string(const std::string& path) const;
  [[noreturn]] void fail(const std::string& path, const std::string& what) const;

 private:
  /// The group that holds `path`, kept open with the file, and the name in it; negative if there is no such group.
  std::pair<std::int64_t, std::string> place_of(const std::string& path) const;
  std::int64_t open_dataset(const std::string& path) const;
  std::int64_t open_numbers(const std::string& path) const;
  Shape checked_shape(std::int64_t dataset, const std::string& path) const;
  template <class Matrix>
  Matrix read_open(std::int64_t dataset, const std::string& path, std::int64_t memory_type) const;
  std::string name_;
  // By their paths: every name that HDF5 is given from the root costs a walk from there.
  mutable std::map<std::string, std::int64_t, std::less<>> groups_;
  mutable std::map<std::string, bool, std::less<>> known_;  // asked for by has()
  std::int64_t file_ = -1;
  bool is_image_ = false;  // made of HDF5-JSON: not the bytes of the file
};

}  // namespace facewright
