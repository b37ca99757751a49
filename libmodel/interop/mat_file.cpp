// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/mat_file.h"

#include <matio.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/interop/mat_elements.h"
#include "libmodel/model/hdf5_archive.h"
#include "libmodel/model/model_file.h"

namespace facewright {
namespace {

constexpr std::uint64_t kBestRatio = 1032;  // of deflate: nothing in a file unpacks to more

// Version 7.3 is HDF5 behind a header of 512 bytes. matio would hand a damaged one to the attribute reader of HDF5,
// which reads past its buffers (1.10); numbers need no attributes.
bool is_hdf5(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  char head[128] = {};
  if (!in.read(head, sizeof head)) return false;
  const bool says_so = std::strncmp(head, "MATLAB 7.3", 10) == 0 || std::memcmp(head, "\x89HDF", 4) == 0;
  return says_so || head[124] == 2 || (head[124] == 0 && head[125] == 2);
}

struct FreeVariable {
  void operator()(matvar_t* v) const { Mat_VarFree(v); }
};
struct CloseFile {
  void operator()(mat_t* f) const { Mat_Close(f); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

template <class T>
Eigen::MatrixXd copied(const void* data, Eigen::Index rows, Eigen::Index cols) {
  return Eigen::Map<const Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>>(static_cast<const T*>(data), rows, cols)
      .template cast<double>();
}

// The numbers of a variable by its storage; empty for what is no plain number.
Eigen::MatrixXd numbers(const matvar_t& v, Eigen::Index rows, Eigen::Index cols) {
  switch (v.class_type) {
    case MAT_C_DOUBLE:
      return copied<double>(v.data, rows, cols);
    case MAT_C_SINGLE:
      return copied<float>(v.data, rows, cols);
    case MAT_C_INT8:
      return copied<std::int8_t>(v.data, rows, cols);
    case MAT_C_UINT8:
      return copied<std::uint8_t>(v.data, rows, cols);
    case MAT_C_INT16:
      return copied<std::int16_t>(v.data, rows, cols);
    case MAT_C_UINT16:
      return copied<std::uint16_t>(v.data, rows, cols);
    case MAT_C_INT32:
      return copied<std::int32_t>(v.data, rows, cols);
    case MAT_C_UINT32:
      return copied<std::uint32_t>(v.data, rows, cols);
    case MAT_C_INT64:
      return copied<std::int64_t>(v.data, rows, cols);
    case MAT_C_UINT64:
      return copied<std::uint64_t>(v.data, rows, cols);
    default:
      return {};
  }
}

bool is_numeric(const matvar_t& v) { return v.class_type >= MAT_C_DOUBLE && v.class_type <= MAT_C_UINT64; }

}  // namespace

struct MatFile::Impl {
  std::string path;
  std::uint64_t most_bytes = 0;  // that variables can have
  std::unique_ptr<mat_t, CloseFile> file;
  std::unique_ptr<Hdf5Reader> hdf5;  // in place of `file`, of version 7.3
  std::vector<std::string> names;
};

MatFile::MatFile(const std::filesystem::path& path) : impl_(std::make_unique<Impl>()) {
  impl_->path = path.string();
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) throw IoError(impl_->path, "cannot be read: " + error.message());
  impl_->most_bytes = kBestRatio * (size + 1);
  if (is_hdf5(path)) {
    try_model_file(path);
    try {
      impl_->hdf5 = std::make_unique<Hdf5Reader>(path);
    } catch (const IoError&) {
      throw IoError(impl_->path, "is no MATLAB 7.3 file, or is cut short");
    }
    impl_->names = impl_->hdf5->children("/");
    return;
  }
  check_mat_elements(path);
  impl_->file.reset(Mat_Open(impl_->path.c_str(), MAT_ACC_RDONLY));
  if (!impl_->file) throw IoError(impl_->path, "is no MATLAB file, or is cut short");
  size_t count = 0;
  char** names = Mat_GetDir(impl_->file.get(), &count);  // belongs to the file
  for (size_t i = 0; names != nullptr && i < count; ++i)
    if (names[i] != nullptr) impl_->names.emplace_back(names[i]);
}

MatFile::~MatFile() = default;
MatFile::MatFile(MatFile&&) noexcept = default;

const std::vector<std::string>& MatFile::names() const { return impl_->names; }

bool MatFile::has(const std::string& name) const {
  return std::find(impl_->names.begin(), impl_->names.end(), name.substr(0, name.find('.'))) != impl_->names.end();
}

void MatFile::fail(const std::string& name, const std::string& what) const {
  throw IoError(impl_->path, "variable '" + name + "' " + what);
}

Eigen::MatrixXd MatFile::matrix(const std::string& name, Eigen::Index rows, Eigen::Index columns) const {
  if (!has(name)) throw IoError(impl_->path, "there is no variable '" + name.substr(0, name.find('.')) + "'");
  const Eigen::MatrixXd m = impl_->hdf5 ? hdf5_matrix(name) : matio_matrix(name);
  if ((rows != Eigen::Dynamic && m.rows() != rows) || (columns != Eigen::Dynamic && m.cols() != columns))
    fail(name, "is " + std::to_string(m.rows()) + " x " + std::to_string(m.cols()) + "; expected " +
                   (rows == Eigen::Dynamic ? "any" : std::to_string(rows)) + " x " +
                   (columns == Eigen::Dynamic ? "any" : std::to_string(columns)));
  if (!m.allFinite()) fail(name, "holds NaN or infinity");
  return m;
}

// Matrices lie by columns: to HDF5, which counts by rows, they are transposed.
Eigen::MatrixXd MatFile::hdf5_matrix(const std::string& name) const {
  std::string path = "/" + name;
  std::replace(path.begin(), path.end(), '.', '/');  // a structure is a group
  if (!impl_->hdf5->has(path)) fail(name, "is not in the structure");
  return impl_->hdf5->matrix(path).transpose();
}

Eigen::MatrixXd MatFile::matio_matrix(const std::string& name) const {
  const size_t dot = name.find('.');
  Mat_Rewind(impl_->file.get());
  const Variable variable(Mat_VarReadInfo(impl_->file.get(), name.substr(0, dot).c_str()));
  if (!variable) fail(name, "cannot be read; the file is damaged");
  const auto expect_room = [&](const matvar_t& v) {
    std::uint64_t items = 1;
    for (int d = 0; d < v.rank; ++d) {
      if (v.dims == nullptr || (v.dims[d] > 0 && items > impl_->most_bytes / v.dims[d]))
        fail(name, "promises more numbers than the file can hold");
      items *= v.dims[d];
    }
  };
  expect_room(*variable);
  if (variable->class_type != MAT_C_STRUCT && !is_numeric(*variable)) fail(name, "is no array of numbers");
  if (Mat_VarReadDataAll(impl_->file.get(), variable.get()) != 0) fail(name, "is damaged or cut short");
  const matvar_t* found = variable.get();
  if (dot != name.npos) {
    if (variable->class_type != MAT_C_STRUCT) fail(name, "is no structure");
    found = Mat_VarGetStructFieldByName(variable.get(), name.substr(dot + 1).c_str(), 0);
    if (found == nullptr) fail(name, "is not in the structure");
  }
  if (!is_numeric(*found) || found->isComplex) fail(name, "is no array of real numbers");
  if (found->rank != 2) fail(name, "has " + std::to_string(found->rank) + " dimensions; expected 2");
  expect_room(*found);
  const auto r = static_cast<Eigen::Index>(found->dims[0]), c = static_cast<Eigen::Index>(found->dims[1]);
  const auto needed =
      static_cast<std::uint64_t>(r) * static_cast<std::uint64_t>(c) * Mat_SizeOfClass(found->class_type);
  if (needed > 0 && (found->data == nullptr || found->nbytes < needed)) fail(name, "is damaged or cut short");
  return needed == 0 ? Eigen::MatrixXd(r, c) : numbers(*found, r, c);
}

Eigen::VectorXd MatFile::vector(const std::string& name) const {
  const Eigen::MatrixXd m = matrix(name);
  if (m.rows() != 1 && m.cols() != 1)
    fail(name, "is " + std::to_string(m.rows()) + " x " + std::to_string(m.cols()) + "; expected a row or a column");
  return m.reshaped();
}

Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> MatFile::triangles(const std::string& name) const {
  Eigen::MatrixXd m = matrix(name);
  if (m.cols() != 3 && m.rows() == 3) m.transposeInPlace();
  if (m.cols() != 3)
    fail(name, "is " + std::to_string(m.rows()) + " x " + std::to_string(m.cols()) + "; expected three columns");
  const double limit = std::numeric_limits<int>::max();
  if (m.size() > 0 && (m.minCoeff() < 0 || m.maxCoeff() >= limit || (m.array() != m.array().round()).any()))
    fail(name, "holds numbers that are no vertex indices");
  return m.cast<int>();
}

}  // namespace facewright
