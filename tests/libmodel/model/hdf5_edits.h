// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <hdf5.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace facewright::testing {

inline void require_hdf5(bool ok, const std::string& what) {
  if (!ok) throw std::logic_error("test: hdf5: " + what);
}

/// Does something to an open file.
inline void edit_file(const std::filesystem::path& file, const std::function<void(hid_t)>& change) {
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  require_hdf5(h5 >= 0, file.string());
  change(h5);
  H5Fclose(h5);
}

/// Changes the numbers of a dataset in place.
template <class T>
void edit_dataset(const std::filesystem::path& file, const std::string& path, hid_t memory_type,
                  const std::function<void(std::vector<T>&)>& change) {
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t set = H5Dopen2(h5, path.c_str(), H5P_DEFAULT), space = H5Dget_space(set);
  require_hdf5(set >= 0, path);
  std::vector<T> values(static_cast<size_t>(H5Sget_simple_extent_npoints(space)));
  require_hdf5(H5Dread(set, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0, path);
  change(values);
  require_hdf5(H5Dwrite(set, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0, path);
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(h5);
}
inline void edit_floats(const std::filesystem::path& file, const std::string& path,
                        const std::function<void(std::vector<double>&)>& change) {
  edit_dataset<double>(file, path, H5T_NATIVE_DOUBLE, change);
}
inline void edit_integers(const std::filesystem::path& file, const std::string& path,
                          const std::function<void(std::vector<int>&)>& change) {
  edit_dataset<int>(file, path, H5T_NATIVE_INT, change);
}

/// Takes an object away, then puts a dataset of any type and shape in its place if `shape` is given.
inline void replace_dataset(const std::filesystem::path& file, const std::string& path, hid_t file_type = -1,
                            const std::vector<hsize_t>& shape = {}, hid_t memory_type = -1,
                            const void* data = nullptr) {
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t links = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(links, 1);
  H5E_auto2_t print = nullptr;
  void* where = nullptr;
  H5Eget_auto2(H5E_DEFAULT, &print, &where);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // there may be nothing to take away
  H5Ldelete(h5, path.c_str(), H5P_DEFAULT);
  H5Eset_auto2(H5E_DEFAULT, print, where);
  if (data != nullptr) {
    const hid_t space =
        shape.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t set = H5Dcreate2(h5, path.c_str(), file_type, space, links, H5P_DEFAULT, H5P_DEFAULT);
    require_hdf5(set >= 0 && H5Dwrite(set, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0, path);
    H5Dclose(set);
    H5Sclose(space);
  }
  H5Pclose(links);
  H5Fclose(h5);
}
inline void replace_string(const std::filesystem::path& file, const std::string& path, const std::string& text) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, text.size() + 1);
  replace_dataset(file, path, type, {1}, type, text.c_str());  // of shape (1,), as Java wrote them
  H5Tclose(type);
}

}  // namespace facewright::testing
