// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Models in MATLAB files: Basel 2009, LSFM, LYHM.
#include "libmodel/interop/import_model.h"
#include "tests/fuzz/fuzz_target.h"

using namespace facewright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  static const fuzz::Folder folder;
  const auto file = folder.put("model.mat", {reinterpret_cast<const char*>(data), size});
  fuzz::read_or_refuse([&] { import_model(file); });
  for (const char* format : {"bfm2009", "lsfm", "lyhm"})
    fuzz::read_or_refuse([&] { import_model(file, {.format = format, .units = "mm", .winding = "keep"}); });
  return 0;
}
