// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/hdf5_archive.h"

#include <cstring>
#include <fstream>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/hdf5_handle.h"
#include "libmodel/model/hdf5_json.h"

namespace facewright {
namespace {

void require(bool ok, const std::string& what) {
  if (!ok) throw SolverError("hdf5: cannot write " + what);
}

Hdf5Handle string_type(size_t size) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, size);
  H5Tset_strpad(type, H5T_STR_NULLTERM);
  return {type, H5Tclose};
}

std::string joined(const std::vector<hsize_t>& shape) {
  std::string text;
  for (hsize_t n : shape) text += (text.empty() ? "" : " x ") + std::to_string(n);
  return text;
}

std::vector<hsize_t> shape_of(hid_t dataset) {
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> shape(static_cast<size_t>(std::max(rank, 0)));
  if (rank > 0) H5Sget_simple_extent_dims(space, shape.data(), nullptr);
  return shape;
}

bool begins_with_brace(const std::filesystem::path& file) { return std::ifstream(file, std::ios::binary).get() == '{'; }

}  // namespace

Hdf5Writer::Hdf5Writer() {
  const Hdf5Quiet quiet;
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access, size_t{1} << 22, false);
  file_ = H5Fcreate("facewright-model", H5F_ACC_TRUNC, H5P_DEFAULT, access);
  require(file_ >= 0, "in memory");
}

Hdf5Writer::~Hdf5Writer() { H5Fclose(file_); }

void Hdf5Writer::dataset(const std::string& path, const std::vector<std::uint64_t>& shape, std::int64_t file_type,
                         std::int64_t memory_type, const void* data) {
  const Hdf5Quiet quiet;
  const std::vector<hsize_t> extent(shape.begin(), shape.end());
  const Hdf5Handle space(extent.empty() ? H5Screate(H5S_SCALAR)
                                        : H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr),
                         H5Sclose);
  const Hdf5Handle parents(H5Pcreate(H5P_LINK_CREATE), H5Pclose), create(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(parents, 1);
  H5Pset_obj_track_times(create, false);
  const Hdf5Handle set(H5Dcreate2(file_, path.c_str(), file_type, space, parents, create, H5P_DEFAULT), H5Dclose);
  require(set.ok() && H5Dwrite(set, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0, path);
}

void Hdf5Writer::matrix(const std::string& path, const RowMatrixXf& m) {
  dataset(path, {std::uint64_t(m.rows()), std::uint64_t(m.cols())}, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, m.data());
}
void Hdf5Writer::matrix(const std::string& path, const RowMatrixXd& m) {
  dataset(path, {std::uint64_t(m.rows()), std::uint64_t(m.cols())}, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, m.data());
}
void Hdf5Writer::matrix(const std::string& path, const RowMatrixXi& m) {
  dataset(path, {std::uint64_t(m.rows()), std::uint64_t(m.cols())}, H5T_STD_I32LE, H5T_NATIVE_INT32, m.data());
}
void Hdf5Writer::vector(const std::string& path, const Eigen::VectorXf& v) {
  dataset(path, {std::uint64_t(v.size())}, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, v.data());
}
void Hdf5Writer::vector(const std::string& path, const std::vector<std::int32_t>& v) {
  dataset(path, {std::uint64_t(v.size())}, H5T_STD_I32LE, H5T_NATIVE_INT32, v.data());
}
void Hdf5Writer::scalar(const std::string& path, std::int32_t value) {
  dataset(path, {}, H5T_STD_I32LE, H5T_NATIVE_INT32, &value);
}
void Hdf5Writer::string(const std::string& path, const std::string& text) {
  const Hdf5Handle type = string_type(text.size() + 1);
  dataset(path, {}, type, type, text.c_str());
}

void Hdf5Writer::attribute(const std::string& path, const std::string& name, const std::string& text) {
  const Hdf5Quiet quiet;
  const Hdf5Handle object(H5Oopen(file_, path.c_str(), H5P_DEFAULT), H5Oclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Handle type = string_type(text.size() + 1);
  const Hdf5Handle attr(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  require(attr.ok() && H5Awrite(attr, type, text.c_str()) >= 0, path + "@" + name);
}

void Hdf5Writer::group(const std::string& path) {
  const Hdf5Quiet quiet;
  const Hdf5Handle parents(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(parents, 1);
  const Hdf5Handle made(H5Gcreate2(file_, path.c_str(), parents, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  require(made.ok(), path);
}

void Hdf5Writer::link(const std::string& new_path, const std::string& existing) {
  const Hdf5Quiet quiet;
  const Hdf5Handle parents(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(parents, 1);
  require(H5Lcreate_hard(file_, existing.c_str(), file_, new_path.c_str(), parents, H5P_DEFAULT) >= 0, new_path);
}

std::string Hdf5Writer::bytes() {
  const Hdf5Quiet quiet;
  require(H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0, "the file");
  const ssize_t size = H5Fget_file_image(file_, nullptr, 0);
  require(size > 0, "the file");
  std::string image(static_cast<size_t>(size), '\0');
  require(H5Fget_file_image(file_, image.data(), image.size()) == size, "the file");
  return image;
}

Hdf5Reader::Hdf5Reader(const std::filesystem::path& file) : name_(file.string()) {
  const Hdf5Quiet quiet;
  if (!std::filesystem::is_regular_file(file)) throw IoError(name_, "there is no such file; expected a model (.h5)");
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  if (begins_with_brace(file)) {
    std::string image = hdf5_from_json(read_file(file), name_);
    H5Pset_fapl_core(access, size_t{1} << 22, false);
    H5Pset_file_image(access, image.data(), image.size());
    is_image_ = true;
  }
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);  // a damaged file may leave something open
  // An image in memory must not have the name of a file that exists.
  file_ = H5Fopen((is_image_ ? name_ + " as HDF5" : name_).c_str(), H5F_ACC_RDONLY, access);
  if (file_ < 0) throw IoError(name_, "is not an HDF5 file, or is cut short; expected a model (.h5)");
}

Hdf5Reader::~Hdf5Reader() { H5Fclose(file_); }

void Hdf5Reader::fail(const std::string& path, const std::string& what) const {
  throw IoError(name_, "'" + path + "' " + what);
}

std::pair<std::int64_t, std::string> Hdf5Reader::place_of(const std::string& path) const {
  const size_t slash = path.rfind('/');
  if (slash == path.npos || slash == 0) return {file_, path.substr(slash == 0 ? 1 : 0)};
  std::string parent = path.substr(0, slash), name = path.substr(slash + 1);
  if (const auto known = groups_.find(parent); known != groups_.end()) return {known->second, std::move(name)};
  const auto [above, own] = place_of(parent);
  const bool exists = above >= 0 && !own.empty() && H5Lexists(above, own.c_str(), H5P_DEFAULT) > 0;
  const hid_t group = exists ? H5Gopen2(above, own.c_str(), H5P_DEFAULT) : H5I_INVALID_HID;
  groups_.emplace(std::move(parent), group);
  return {group, std::move(name)};
}

bool Hdf5Reader::has(const std::string& path) const {
  if (const auto known = known_.find(path); known != known_.end()) return known->second;
  const Hdf5Quiet quiet;
  const auto [group, name] = place_of(path);
  const bool is_there = group >= 0 && (name.empty() || H5Lexists(group, name.c_str(), H5P_DEFAULT) > 0);
  known_.emplace(path, is_there);
  return is_there;
}

std::int64_t Hdf5Reader::open_dataset(const std::string& path) const {
  const auto [group, name] = place_of(path);
  return group < 0 || name.empty() ? H5I_INVALID_HID : H5Dopen2(group, name.c_str(), H5P_DEFAULT);
}

std::vector<std::string> Hdf5Reader::children(const std::string& group) const {
  const Hdf5Quiet quiet;
  std::vector<std::string> names;
  if (!has(group)) return names;
  const Hdf5Handle at(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose);
  H5G_info_t info{};
  if (!at.ok() || H5Gget_info(at, &info) < 0) return names;
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    const auto get = [&](char* to, size_t size) {
      return H5Lget_name_by_idx(at, ".", H5_INDEX_NAME, H5_ITER_INC, i, to, size, H5P_DEFAULT);
    };
    const ssize_t length = get(nullptr, 0);
    if (length <= 0) fail(group, "cannot be listed; the file is damaged");
    std::string name(static_cast<size_t>(length), ' ');
    get(name.data(), name.size() + 1);
    names.push_back(std::move(name));
  }
  return names;
}

// A dataset of numbers, which the caller closes.
std::int64_t Hdf5Reader::open_numbers(const std::string& path) const {
  const hid_t set = open_dataset(path);
  if (set < 0) fail(path, has(path) ? "is not a dataset" : "is missing; is this a statismo 0.9 or Facewright model?");
  const Hdf5Handle type(H5Dget_type(set), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type);
  if (kind == H5T_FLOAT || kind == H5T_INTEGER) return set;
  H5Dclose(set);
  fail(path, "does not hold numbers");
}

Hdf5Reader::Shape Hdf5Reader::checked_shape(std::int64_t dataset, const std::string& path) const {
  const std::vector<hsize_t> shape = shape_of(dataset);
  if (shape.size() > 2) fail(path, "has shape " + joined(shape) + ", expected a matrix or vector");
  const hsize_t rows = shape.empty() ? 1 : shape[0], cols = shape.size() < 2 ? 1 : shape[1];
  hsize_t file_size = 0;
  H5Fget_filesize(file_, &file_size);
  if (rows > kMostHdf5Values || cols > kMostHdf5Values || rows * cols > kMostHdf5Values ||
      rows * cols / kMostInflation > file_size || (rows * cols > 0 && !H5Dget_storage_size(dataset)) ||
      H5Dget_storage_size(dataset) > file_size)
    fail(path, "says it has shape " + joined(shape) + ", which the file cannot hold");
  return {static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols)};
}

Hdf5Reader::Shape Hdf5Reader::shape(const std::string& path) const {
  const Hdf5Quiet quiet;
  const Hdf5Handle set(open_numbers(path), H5Dclose), type(H5Dget_type(set), H5Tclose);
  const Hdf5Handle layout(H5Dget_create_plist(set), H5Pclose);
  Shape n = checked_shape(set, path);
  const haddr_t offset = H5Dget_offset(set);
  const std::uint64_t bytes = static_cast<std::uint64_t>(n.rows) * static_cast<std::uint64_t>(n.cols) * sizeof(float);
  if (!is_image_ && H5Tequal(type, H5T_IEEE_F32LE) > 0 && H5Pget_layout(layout) == H5D_CONTIGUOUS &&
      H5Pget_external_count(layout) == 0 && offset != HADDR_UNDEF && H5Dget_storage_size(set) == bytes)
    n.plain_floats = offset;
  return n;
}

template <class Matrix>
Matrix Hdf5Reader::read_open(std::int64_t dataset, const std::string& path, std::int64_t memory_type) const {
  const Shape n = checked_shape(dataset, path);
  Matrix m(n.rows, n.cols);
  if (m.size() > 0 && H5Dread(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, m.data()) < 0)
    fail(path, "cannot be read; the file is damaged");
  return m;
}

RowMatrixXd Hdf5Reader::matrix(const std::string& path) const {
  const Hdf5Quiet quiet;
  const Hdf5Handle set(open_numbers(path), H5Dclose), type(H5Dget_type(set), H5Tclose);
  // HDF5's own conversion is ten times slower.
  if (H5Tequal(type, H5T_NATIVE_FLOAT) > 0) return read_open<RowMatrixXf>(set, path, H5T_NATIVE_FLOAT).cast<double>();
  return read_open<RowMatrixXd>(set, path, H5T_NATIVE_DOUBLE);
}
RowMatrixXi Hdf5Reader::integers(const std::string& path) const {
  const Hdf5Quiet quiet;
  const Hdf5Handle set(open_numbers(path), H5Dclose);
  return read_open<RowMatrixXi>(set, path, H5T_NATIVE_INT32);
}

std::string Hdf5Reader::string(const std::string& path) const {
  const Hdf5Quiet quiet;
  const Hdf5Handle set(open_dataset(path), H5Dclose);
  if (!set.ok()) fail(path, has(path) ? "is not a dataset" : "is missing");
  const Hdf5Handle type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1) fail(path, "is not one string");
  if (H5Tis_variable_str(type) > 0) {
    char* data = nullptr;
    const Hdf5Handle memory(H5Tcopy(type), H5Tclose);
    if (H5Dread(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, &data) < 0 || !data) fail(path, "cannot be read");
    std::string text(data);
    H5free_memory(data);
    return text;
  }
  const size_t size = H5Tget_size(type);
  if (size > kMostHdf5Values || (size > 1 && H5Dget_storage_size(set) < size)) fail(path, "is longer than the file");
  std::string text(size, '\0');
  if (H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) < 0) fail(path, "cannot be read");
  text.resize(strnlen(text.data(), text.size()));
  return text;
}

}  // namespace facewright
