// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "libmodel/core/landmarks.h"

namespace facewright {

/// Which vertex of a model a landmark of some annotation scheme belongs to: by a table name -> (name of a model
/// landmark, or vertex index), or by the name itself.
class LandmarkMapper {
 public:
  using Target = std::variant<std::string, int>;

  /// Names mean themselves.
  LandmarkMapper() = default;
  explicit LandmarkMapper(std::map<std::string, Target> table) : table_(std::move(table)), identity_(false) {}

  bool is_identity() const { return identity_; }
  /// The vertex of the model's landmark set, or nothing if the name is not mapped.
  std::optional<int> vertex(const std::string& name, const LandmarkSet& model_landmarks) const;

 private:
  std::map<std::string, Target> table_;
  bool identity_ = true;
};

/// Reads an eos landmark mapping: the lines `name = vertex` or `name = "model landmark"` of the section
/// [landmark_mappings]. Throws IoError with the line.
LandmarkMapper read_landmark_mapping(const std::filesystem::path& path);

}  // namespace facewright
