// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Landmark files of every format, mappings of their names, and the manifest of a set of scans.
#include <array>

#include "libmodel/io/landmark_files.h"
#include "libmodel/io/landmark_names.h"
#include "libmodel/io/manifest.h"
#include "libmodel/model/landmark_mapper.h"
#include "tests/fuzz/fuzz_target.h"

using namespace facewright;

namespace {

constexpr std::array kLandmarks = {"l.json",  "l.pts",  "l.pp",  "l.mrk.json", "l.fcsv",
                                   "l.ljson", "l.tlms", "l.csv", "l.bnd",      "l.lm3"};
constexpr std::array kTables = {"names.json", "names.csv", "names.toml", "mapping.txt", "manifest.csv"};

// Whatever was read can be written, and reads back as the same.
void read_landmark_file(const std::filesystem::path& file, const std::filesystem::path& copy) {
  fuzz::read_or_refuse([&] {
    const Landmarks landmarks = read_landmarks(file);
    write_landmarks(copy, landmarks);
    const Landmarks again = read_landmarks(copy);
    fuzz::require(landmarks.size() == again.size(), "landmarks are lost when written");
  });
  fuzz::read_or_refuse([&] { read_image_landmarks(file); });
}

void read_table(size_t which, const std::filesystem::path& file) {
  if (which < 3) fuzz::read_or_refuse([&] { read_landmark_names(file); });
  if (which == 3) fuzz::read_or_refuse([&] { read_landmark_mapping(file); });
  if (which == 4) fuzz::read_or_refuse([&] { read_manifest(file); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  static const fuzz::Folder folder;
  static const auto scan = folder.put("a.ply", "ply\n");
  const fuzz::Input input(data, size, kLandmarks.size() + kTables.size());
  if (input.format < kLandmarks.size())
    read_landmark_file(folder.put(kLandmarks[input.format], input.bytes), folder / "copy.json");
  else
    read_table(input.format - kLandmarks.size(), folder.put(kTables[input.format - kLandmarks.size()], input.bytes));
  return 0;
}
