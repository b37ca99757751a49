// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/json_whole.h"

#include <gmock/gmock.h>

namespace facewright {
namespace {

using nlohmann::json;

TEST(WholeNumbers, AreTakenAsTheyAre) {
  EXPECT_EQ(whole_number<int>(json::parse("-3")), -3);
  EXPECT_EQ(whole_number<int>(json::parse("2147483647")), 2147483647);
  EXPECT_EQ(whole_number<int>(json::parse("-2147483648")), std::numeric_limits<int>::min());
  EXPECT_EQ(whole_number<size_t>(json::parse("18446744073709551615")), std::numeric_limits<size_t>::max());
  EXPECT_EQ(whole_number<int>(json::parse("4.0")), 4);
  EXPECT_EQ(whole_numbers(json::parse("[1, 2, 30]")), (std::vector<int>{1, 2, 30}));
}

TEST(WholeNumbers, WhatWouldWrapOrBeCutIsRefused) {
  for (const char* bad : {"2147483648", "-2147483649", "4294967296", "18446744073709551615", "1.5", "9e31", "-1e300",
                          "true", "null", "\"1\"", "[1]"})
    EXPECT_THROW(whole_number<int>(json::parse(bad)), json::exception) << bad;
  EXPECT_THROW(whole_number<size_t>(json::parse("-1")), json::exception);
  EXPECT_THROW(whole_number<size_t>(json::parse("18446744073709551616")), json::exception) << "a double";
  EXPECT_THROW(whole_numbers(json::parse("{\"a\": 1}")), json::exception);
}

}  // namespace
}  // namespace facewright
