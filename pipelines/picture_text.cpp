// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/picture_text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

namespace facewright {
namespace {

struct Glyph {
  char letter;
  std::array<unsigned char, 7> rows;  // bit 4 = leftmost dot
};

constexpr Glyph kGlyphs[] = {
    {'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},    {'2', {14, 17, 1, 6, 8, 16, 31}},
    {'3', {30, 1, 1, 14, 1, 1, 30}},     {'4', {2, 6, 10, 18, 31, 2, 2}},   {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 8, 8, 8}},     {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 15, 1, 2, 12}},   {'+', {0, 4, 4, 31, 4, 4, 0}},     {'-', {0, 0, 0, 31, 0, 0, 0}},
    {'.', {0, 0, 0, 0, 0, 12, 12}},      {',', {0, 0, 0, 0, 12, 4, 8}},     {':', {0, 12, 12, 0, 12, 12, 0}},
    {'%', {24, 25, 2, 4, 8, 19, 3}},     {'/', {1, 1, 2, 4, 8, 16, 16}},    {'(', {2, 4, 8, 8, 8, 4, 2}},
    {')', {8, 4, 2, 2, 2, 4, 8}},        {'a', {0, 0, 14, 1, 15, 17, 15}},  {'b', {16, 16, 30, 17, 17, 17, 30}},
    {'c', {0, 0, 14, 17, 16, 17, 14}},   {'d', {1, 1, 15, 17, 17, 17, 15}}, {'e', {0, 0, 14, 17, 31, 16, 14}},
    {'f', {6, 9, 8, 28, 8, 8, 8}},       {'g', {0, 0, 15, 17, 15, 1, 14}},  {'h', {16, 16, 30, 17, 17, 17, 17}},
    {'i', {4, 0, 12, 4, 4, 4, 14}},      {'j', {2, 0, 6, 2, 2, 18, 12}},    {'k', {16, 16, 18, 20, 24, 20, 18}},
    {'l', {12, 4, 4, 4, 4, 4, 14}},      {'m', {0, 0, 26, 21, 21, 21, 21}}, {'n', {0, 0, 30, 17, 17, 17, 17}},
    {'o', {0, 0, 14, 17, 17, 17, 14}},   {'p', {0, 0, 30, 17, 30, 16, 16}}, {'q', {0, 0, 15, 17, 15, 1, 1}},
    {'r', {0, 0, 22, 25, 16, 16, 16}},   {'s', {0, 0, 15, 16, 14, 1, 30}},  {'t', {8, 8, 28, 8, 8, 9, 6}},
    {'u', {0, 0, 17, 17, 17, 17, 15}},   {'v', {0, 0, 17, 17, 17, 10, 4}},  {'w', {0, 0, 17, 21, 21, 21, 10}},
    {'x', {0, 0, 17, 10, 4, 10, 17}},    {'y', {0, 0, 17, 17, 15, 1, 14}},  {'z', {0, 0, 31, 2, 4, 8, 31}},
};
constexpr int kAdvance = 6;  // dots from letter to letter

void fill(Image& image, int left, int top, int size, const Rgb& colour) {
  for (int y = std::max(top, 0); y < std::min(top + size, image.height); ++y)
    for (int x = std::max(left, 0); x < std::min(left + size, image.width); ++x)
      std::copy(colour.begin(), colour.end(), image.pixel(x, y));
}

}  // namespace

void draw_text(Image& image, const Eigen::Vector2i& at, const std::string& text, const Rgb& colour, int dot) {
  int left = at[0];
  for (const char c : text) {
    const char letter = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const Glyph& g : kGlyphs)
      if (g.letter == letter)
        for (int row = 0; row < 7; ++row)
          for (int column = 0; column < 5; ++column)
            if (g.rows[static_cast<size_t>(row)] >> (4 - column) & 1)
              fill(image, left + dot * column, at[1] + dot * row, dot, colour);
    left += dot * kAdvance;
  }
}

int text_width(const std::string& text, int dot) { return dot * kAdvance * static_cast<int>(text.size()); }

}  // namespace facewright
