// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// What the programs keep for themselves and read again: reference faces, the journal of a hierarchy, records of
// searches for landmarks, the text forms of CSV.
#include <nlohmann/json.hpp>

#include "libmodel/io/csv.h"
#include "libmodel/io/json_whole.h"
#include "libmodel/model/hdf5_json.h"
#include "libregister/subdivision/journal.h"
#include "pipelines/landmark_record.h"
#include "pipelines/reference_file.h"
#include "tests/fuzz/fuzz_target.h"

using namespace facewright;

namespace {

enum Format : size_t { reference, journal, record, csv, hdf5_json, count };

// Three by three vertices, 50 mm apart.
ReferenceFace small_base() {
  ReferenceFace face;
  face.mesh.V.resize(9, 3), face.mesh.F.resize(8, 3);
  for (int i = 0; i < 9; ++i) face.mesh.V.row(i) << 50.0 * (i % 3), 50.0 * (i / 3), 10.0 * (i == 4);
  for (int f = 0; f < 8; ++f) {
    const int v = 3 * (f / 4) + f / 2 % 2;
    face.mesh.F.row(f) << v + f % 2, v + 1 + 3 * (f % 2), v + 3;
  }
  return face;
}

// As pipelines/hierarchy_file reads them, with a small base.
void replay_journal(const std::string& text) {
  static const ReferenceFace face = small_base();
  const auto j = nlohmann::json::parse(text, nullptr, false);
  if (!j.is_object()) return;
  RefinementJournal steps{static_cast<int>(face.mesh.vertex_count()), {}};
  std::vector<int> counts;
  try {
    for (const auto& p : j.at("parents"))
      steps.parents.push_back(
          {whole_number<int>(p.at(0)), whole_number<int>(p.at(1)), p.size() > 2 ? whole_number<int>(p.at(2)) : -1});
    counts = whole_numbers(j.at("vertices"));
  } catch (const nlohmann::json::exception&) {
    return;
  }
  replay(steps, face.mesh, face.mirror, face.landmarks, counts);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  static const fuzz::Folder folder;
  const fuzz::Input input(data, size, Format::count);
  const std::string text(input.bytes);
  fuzz::read_or_refuse([&] {
    switch (input.format) {
      case Format::reference:
        load_reference_file(folder.put("face.txt", "# Facewright reference face\n" + text));
        return;
      case Format::journal:
        return replay_journal(text);
      case Format::record:
        folder.put("a.found", text);
        landmark_record(folder / "a.json");
        return;
      case Format::csv:
        parse_csv(text, "table");
        return;
      default:
        hdf5_from_json(text, "document");
    }
  });
  return 0;
}
