// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Internal: whole numbers of a JSON document from elsewhere.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace facewright {

/// A number as T, if it is a whole one in T's range: the library would cut off digits and wrap around. Throws an
/// exception of the library otherwise.
template <class T, class Json>
T whole_number(const Json& value) {
  using Limits = std::numeric_limits<T>;
  if (value.is_number_unsigned() && std::cmp_less_equal(value.template get<std::uint64_t>(), Limits::max()))
    return static_cast<T>(value.template get<std::uint64_t>());
  if (value.is_number_integer() && !value.is_number_unsigned() && std::in_range<T>(value.template get<std::int64_t>()))
    return static_cast<T>(value.template get<std::int64_t>());
  if (value.is_number_float()) {
    const double x = value.template get<double>();
    const bool fits = x >= static_cast<double>(Limits::min()) && x < std::ldexp(1.0, Limits::digits);
    if (fits && x == std::floor(x)) return static_cast<T>(x);
  }
  throw Json::out_of_range::create(406, "expected a whole number that counts something", &value);
}

template <class Json>
std::vector<int> whole_numbers(const Json& list) {
  if (!list.is_array()) throw Json::type_error::create(302, "expected a list of whole numbers", &list);
  std::vector<int> numbers;
  for (const auto& value : list) numbers.push_back(whole_number<int>(value));
  return numbers;
}

}  // namespace facewright
