// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/io/guarded_call.h"
#include "libmodel/model/hdf5_handle.h"
#include "libmodel/model/model_file.h"

namespace facewright {
namespace {

constexpr int kDeepest = 32;
constexpr size_t kMostObjects = 200'000;
constexpr hsize_t kSmall = 1 << 16;  // values

// Goes through all that hard links lead to, each object once.
class Trial {
 public:
  explicit Trial(hid_t file) : file_(file) { H5Fget_filesize(file, &file_size_); }

  void group(hid_t group, int depth) {
    if (depth > kDeepest) throw InvalidInput("nests its groups too deeply");
    H5G_info_t info{};
    if (H5Gget_info(group, &info) < 0 || info.nlinks > kMostObjects) throw InvalidInput("is damaged");
    for (hsize_t i = 0; i < info.nlinks; ++i) {
      const std::string name = name_of(group, i);
      H5L_info_t link{};
      if (H5Lget_info(group, name.c_str(), &link, H5P_DEFAULT) < 0) throw InvalidInput("is damaged");
      if (link.type == H5L_TYPE_HARD)
        object(group, name, depth);
      else if (link.type != H5L_TYPE_SOFT)
        throw InvalidInput("leads to another file, which is not followed");
    }
  }

 private:
  static std::string name_of(hid_t group, hsize_t i) {
    const auto get = [&](char* to, size_t size) {
      return H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i, to, size, H5P_DEFAULT);
    };
    const ssize_t length = get(nullptr, 0);
    if (length <= 0) throw InvalidInput("is damaged");
    std::string name(static_cast<size_t>(length), ' ');
    get(name.data(), name.size() + 1);
    return name;
  }

  void object(hid_t group, const std::string& name, int depth) {
    const Hdf5Handle at(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
    H5O_info_t info{};
    if (!at.ok() || H5Oget_info2(at, &info, H5O_INFO_BASIC) < 0) return;  // found damaged when it is wanted
    if (!seen_.insert(info.addr).second) return;
    if (seen_.size() > kMostObjects) throw InvalidInput("holds too many objects for a model");
    if (info.type == H5O_TYPE_GROUP) this->group(at, depth + 1);
    if (info.type == H5O_TYPE_DATASET) dataset(at);
  }

  void dataset(hid_t set) {
    const Hdf5Handle type(H5Dget_type(set), H5Tclose), space(H5Dget_space(set), H5Sclose);
    const Hdf5Handle layout(H5Dget_create_plist(set), H5Pclose);
    if (!type.ok() || !space.ok() || !layout.ok()) return;
    if (H5Pget_external_count(layout) > 0 || H5Pget_layout(layout) == H5D_VIRTUAL)
      throw InvalidInput("keeps its numbers in another file, which is not followed");
    const hssize_t values = H5Sget_simple_extent_npoints(space);
    const hsize_t stored = H5Dget_storage_size(set);
    H5Dget_offset(set);
    if (values <= 0 || stored > file_size_ || static_cast<hsize_t>(values) > kMostHdf5Values ||
        static_cast<hsize_t>(values) / kMostInflation > file_size_)
      return;  // refused when it is wanted
    const H5T_class_t kind = H5Tget_class(type);
    if (kind == H5T_STRING)
      text(set, type, values);
    else if ((kind == H5T_FLOAT || kind == H5T_INTEGER) &&
             (static_cast<hsize_t>(values) <= kSmall || H5Pget_layout(layout) != H5D_CONTIGUOUS))
      numbers(set, kind == H5T_FLOAT ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT32, static_cast<size_t>(values));
  }

  static void numbers(hid_t set, hid_t as, size_t count) {
    std::vector<double> values(count);  // large enough for either
    H5Dread(set, as, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  }

  void text(hid_t set, hid_t type, hssize_t values) const {
    if (values != 1) return;  // is not read
    if (H5Tis_variable_str(type) > 0) {
      char* data = nullptr;
      const Hdf5Handle memory(H5Tcopy(type), H5Tclose);
      if (H5Dread(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, &data) >= 0) H5free_memory(data);
      return;
    }
    const size_t size = H5Tget_size(type);
    if (size == 0 || size > file_size_) return;
    std::vector<char> data(size);
    H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data());
  }

  hid_t file_;
  hsize_t file_size_ = 0;
  std::set<haddr_t> seen_;
};

std::string walk(const std::filesystem::path& file) {
  const Hdf5Quiet quiet;
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
  const Hdf5Handle open(H5Fopen(file.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
  if (!open.ok()) return "";  // is told by who opens it next
  const Hdf5Handle root(H5Gopen2(open, "/", H5P_DEFAULT), H5Gclose);
  if (root.ok()) Trial(open).group(root, 0);
  return "";
}

}  // namespace

void try_model_file(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file))
    throw IoError(file.string(), "there is no such file; expected a model (.h5)");
  if (std::ifstream(file, std::ios::binary).get() == '{') return;  // HDF5-JSON: our own reader's
  constexpr std::uint64_t kRoom = std::uint64_t{256} << 20, kRoomPerByte = 64, kBytesPerSecond = std::uint64_t{1} << 25;
  const std::uint64_t size = std::filesystem::file_size(file);
  GuardLimits limits;
  limits.bytes = kRoom + kRoomPerByte * size;
  limits.cpu_seconds = 5 + static_cast<int>(size / kBytesPerSecond);
  try {
    guarded_call([&] { return walk(file); }, limits);
  } catch (const InvalidInput& error) {
    const std::string why = error.what();
    const bool ended = why == "crashed" || why.starts_with("took longer") || why.starts_with("needs more memory");
    throw IoError(file.string(), ended ? "is damaged: HDF5 " + why + " when trying it" : why);
  }
}

}  // namespace facewright
