// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "libmodel/core/landmarks.h"

namespace facewright {

/// Image landmarks that follow the outline of the face rather than a point of it, in ibug's order.
struct ContourLandmarks {
  std::vector<std::string> right;  ///< of the subject, from the ear to the chin
  std::vector<std::string> left;   ///< from the chin to the ear
};

/// Which vertex of a model a landmark of some annotation scheme belongs to: by a table name -> (name of a model
/// landmark, or vertex index), or by the name itself.
class LandmarkMapper {
 public:
  using Target = std::variant<std::string, int>;

  /// Names mean themselves.
  LandmarkMapper() = default;
  explicit LandmarkMapper(std::map<std::string, Target> table, ContourLandmarks contour = {})
      : table_(std::move(table)), contour_(std::move(contour)), identity_(false) {}

  bool is_identity() const { return identity_; }
  /// Empty if the scheme does not say; then ibug's 1..17 are meant.
  const ContourLandmarks& contour() const { return contour_; }
  /// The vertex of the model's landmark set, or nothing if the name is not mapped.
  std::optional<int> vertex(const std::string& name, const LandmarkSet& model_landmarks) const;

 private:
  std::map<std::string, Target> table_;
  ContourLandmarks contour_;
  bool identity_ = true;
};

/// Reads a landmark mapping: lines `name = vertex` or `name = "model landmark"`, comments after #. They may stand alone
/// or, as eos has them, in a section [landmark_mappings]; a section [contour_landmarks] may list `right = [...]` and
/// `left = [...]`. Other sections are passed over. Throws IoError with the line.
LandmarkMapper read_landmark_mapping(const std::filesystem::path& path);

}  // namespace facewright
