// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Models of other programs: eos and its blendshapes, scm, NumPy archives (raw, and arrays whose checksums are right),
// FLAME's, glTF, ICT's folder of meshes.
#include <array>

#include "libmodel/interop/eos_companions.h"
#include "libmodel/interop/import_model.h"
#include "libmodel/interop/zip_archive.h"
#include "libmodel/io/atomic_file.h"
#include "tests/fuzz/fuzz_target.h"

using namespace facewright;

namespace {

constexpr std::array kFormats = {"eos", "scm", "npz", "flame", "glb"};
constexpr size_t kArrays = 5, kArraysOfFlame = 6, kIct = 7, kBlendshapes = 8, kContours = 9, kEdges = 10, kMarks = 11,
                 kAnything = 12, kCount = 13;

// Name, a zero byte, four bytes of length, the array; and again.
std::string archive(std::string_view bytes) {
  ZipWriter zip;
  while (true) {
    const size_t zero = bytes.find('\0');
    if (zero == bytes.npos || bytes.size() < zero + 5) return zip.finish();
    const std::string name(bytes.substr(0, std::min<size_t>(zero, 40)));
    size_t length = 0;
    for (size_t k = 0; k < 4; ++k)
      length |= static_cast<size_t>(static_cast<unsigned char>(bytes[zero + 1 + k])) << (8 * k);
    bytes.remove_prefix(zero + 5);
    zip.add(name + ".npy", std::string(bytes.substr(0, length)));
    bytes.remove_prefix(std::min(length, bytes.size()));
  }
}

void import(const std::filesystem::path& file, const std::string& format) {
  fuzz::read_or_refuse([&] { import_model(file, {.format = format}); });
  fuzz::read_or_refuse(
      [&] { import_model(file, {.format = format, .units = "mm", .winding = "keep", .axes = "x y z"}); });
}

void import_folder(const fuzz::Folder& folder, std::string_view bytes) {
  const fuzz::TwoFiles meshes(bytes);
  std::filesystem::create_directories(folder / "ict");
  folder.put("ict/generic_neutral_mesh.obj", meshes.first);
  folder.put("ict/identity000.obj", meshes.second);
  import(folder / "ict", "ict");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  static const fuzz::Folder folder;
  const fuzz::Input input(data, size, kCount);
  if (input.format == kIct) {
    import_folder(folder, input.bytes);
    return 0;
  }
  const bool packed = input.format == kArrays || input.format == kArraysOfFlame;
  const auto file = folder.put("model.bin", packed ? std::string_view(archive(input.bytes)) : input.bytes);
  if (input.format < kFormats.size()) import(file, kFormats[input.format]);
  if (packed) import(file, input.format == kArrays ? "npz" : "flame");
  if (input.format == kBlendshapes) fuzz::read_or_refuse([&] { read_eos_blendshapes(file); });
  if (input.format == kContours) fuzz::read_or_refuse([&] { read_eos_contours(file); });
  if (input.format == kEdges) fuzz::read_or_refuse([&] { read_eos_edge_topology(file); });
  if (input.format == kMarks) fuzz::read_or_refuse([&] { read_eos_contour_landmarks(file); });
  if (input.format == kAnything) {
    const auto own = folder.put("sniffed", input.bytes);
    fuzz::read_or_refuse([&] { sniff_model_format(own); });
  }
  return 0;
}
