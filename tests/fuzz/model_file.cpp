// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Our own model files, those of statismo and the Basel models, and HDF5-JSON.
#include "libmodel/model/model_file.h"

#include "libmodel/model/check_model.h"
#include "tests/fuzz/fuzz_target.h"

using namespace facewright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  static const fuzz::Folder folder;
  const auto file = folder.put("model.h5", {reinterpret_cast<const char*>(data), size});
  bool tried = false;
  fuzz::read_or_refuse([&] { try_model_file(file), tried = true; });
  if (!tried) return 0;
  fuzz::read_or_refuse([&] { load_model(file).mean(); });
  fuzz::read_or_refuse([&] { load_model(file, "/level0").mean(); });
  fuzz::read_or_refuse([&] { stored_levels(file); });
  fuzz::read_or_refuse([&] { stored_statistics(file, "/level0", "shape"); });
  fuzz::read_or_refuse([&] { stored_edges(file); });
  return 0;
}
