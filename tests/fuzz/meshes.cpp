// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Scans: OBJ with its materials and PLY through our own readers and through intake, the rest through assimp; and what
// intake does with whatever they hold.
#include <array>

#include "libmodel/io/image_files.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/intake/mesh_import.h"
#include "libregister/intake/scan.h"
#include "tests/fuzz/fuzz_target.h"

using namespace facewright;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  static constexpr std::array kNames = {"scan.obj", "scan.ply", "scan.stl", "scan.off", "scan.glb", "scan.gltf",
                                        "scan.dae", "scan.fbx", "scan.3ds", "scan.x",   "scan.wrl"};
  static const fuzz::Folder folder;
  static const bool picture = (write_png(folder / "skin.png", Image(2, 2, 3, 128)), true);
  fuzz::require(picture, "there is a picture to find");
  const fuzz::Input input(data, size, kNames.size());
  const fuzz::TwoFiles files(input.format == 0 ? input.bytes : std::string_view());
  const auto file = folder.put(kNames[input.format], input.format == 0 ? files.first : input.bytes);
  if (input.format == 0) folder.put("scan.mtl", files.second);
  if (input.format <= 1) {
    fuzz::read_or_refuse([&] {
      validate(read_mesh(file));
      texture_file(file);
    });
  }
  fuzz::read_or_refuse([&] {
    ScanFiles scan;
    scan.id = "scan";
    scan.mesh = file;
    scan.units = Units::mm;
    validate(load_scan(scan).mesh);
  });
  return 0;
}
