// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/reference_file.h"

#include "libmodel/core/errors.h"
#include "libmodel/core/mesh.h"
#include "libmodel/io/atomic_file.h"

namespace facewright {
namespace {

constexpr std::string_view first_line = "# Facewright reference face\n";

}  // namespace

void save_reference_file(const std::filesystem::path& file, const ReferenceFace& face) {
  write_file(file, std::string(first_line) + format_reference(face));
}

ReferenceFace load_reference_file(const std::filesystem::path& file) {
  const std::string text = read_file(file);
  if (!text.starts_with(first_line))
    throw IoError(
        file.string(),
        "is no reference file (its first line is not \"# Facewright reference face\"); make one of a mesh with "
        "make-reference, or give build-model the landmarks of a mesh with --reference-landmarks");
  ReferenceFace face = parse_reference(text, file.string());
  validate(face.mesh);
  return face;
}

}  // namespace facewright
