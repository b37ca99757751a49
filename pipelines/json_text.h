// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace facewright {

/// JSON as text; what is no UTF-8 in it, such as a path of an old file system, gets the sign for unknown characters.
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, nlohmann::detail::error_handler_t::replace);
}

}  // namespace facewright
