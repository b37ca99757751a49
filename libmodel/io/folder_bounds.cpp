// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/folder_bounds.h"

#include <system_error>

namespace facewright {

namespace fs = std::filesystem;

bool lies_inside(const fs::path& file, const fs::path& folder) {
  std::error_code bad;
  const fs::path real_folder = fs::canonical(folder.empty() ? fs::path(".") : folder, bad);
  if (bad) return false;
  const fs::path real_file = fs::weakly_canonical(fs::absolute(file, bad), bad);
  if (bad) return false;
  const fs::path relative = real_file.lexically_relative(real_folder);
  return !relative.empty() && *relative.begin() != "..";
}

bool is_file(const fs::path& path) {
  std::error_code bad;
  return fs::is_regular_file(path, bad) && !bad;
}

}  // namespace facewright
