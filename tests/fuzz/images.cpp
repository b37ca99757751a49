// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Pictures: PNG, JPEG, BMP, TGA, PSD, GIF, PNM by content.
#include "libmodel/io/image_files.h"
#include "tests/fuzz/fuzz_target.h"

using namespace facewright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  static const fuzz::Folder folder;
  const auto file = folder.put("picture.png", {reinterpret_cast<const char*>(data), size});
  fuzz::read_or_refuse([&] {
    const Image image = read_image(file);
    fuzz::require(!image.empty() && image.data.size() == size_t(1) * static_cast<size_t>(image.width) *
                                                             static_cast<size_t>(image.height) *
                                                             static_cast<size_t>(image.channels),
                  "an image of another size than it says");
  });
  return 0;
}
