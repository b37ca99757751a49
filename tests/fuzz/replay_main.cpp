// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Gives a fuzz target the files of the folders named, one by one. usage: fuzz_NAME FOLDER_OR_FILE...
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iterator>
#include <vector>

#include "tests/fuzz/fuzz_target.h"

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> files_of(int argc, char** argv) {
  std::vector<fs::path> files;
  for (int i = 1; i < argc; ++i)
    if (fs::is_directory(argv[i]))
      for (const auto& entry : fs::recursive_directory_iterator(argv[i])) files.push_back(entry.path());
    else if (fs::exists(argv[i]))  // there may be no regressions yet
      files.emplace_back(argv[i]);
  files.erase(std::remove_if(files.begin(), files.end(), [](const fs::path& f) { return !fs::is_regular_file(f); }),
              files.end());
  std::sort(files.begin(), files.end());
  return files;
}

bool survives(const fs::path& file) {
  std::printf("%s\n", file.c_str());
  std::fflush(stdout);  // the last line tells which input ended the program
  std::ifstream in(file, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
  try {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    return true;
  } catch (const std::exception& error) {
    std::printf("  is refused by another error than ours: %s\n", error.what());
    return false;
  }
}

}  // namespace

int main(int argc, char** argv) {
  facewright::fuzz::tells = true;
  const std::vector<fs::path> files = files_of(argc, argv);
  const auto failed = std::count_if(files.begin(), files.end(), [](const fs::path& f) { return !survives(f); });
  std::printf("%zu inputs, %ld failed\n", files.size(), static_cast<long>(failed));
  return files.empty() || failed > 0 ? 1 : 0;
}
