// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/viewer/page.h"

#include <cctype>
#include <cstdio>

#include "libmodel/io/image_files.h"
#include "libmodel/io/markup.h"
#include "pipelines/viewer/assets.h"
#include "pipelines/viewer/base64.h"

namespace facewright {
namespace {

std::string asset(const char* name) { return std::string(viewer_asset(name).value_or("")); }

std::string data_address(const Image& image, int quality) {
  return quality > 0 ? "data:image/jpeg;base64," + base64(jpeg_bytes(image, quality))
                     : "data:image/png;base64," + base64(png_bytes(image));
}

}  // namespace

bool has_viewer() { return viewer_asset("viewer.js").has_value(); }

std::string viewer_html() {
  return has_viewer() ? asset("viewer.html")
                      : "<p class=faint>This program was built without three.js (pipelines/fetch-packages gets it), so "
                        "there is no view to turn here.</p>\n";
}

std::string html_number(double value, int digits) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string html_link(const std::string& name) {
  std::string out;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 127 || std::isalnum(byte) || c == '-' || c == '_' || c == '.')
      out += c;
    else
      out += std::string("%") + "0123456789ABCDEF"[byte >> 4] + "0123456789ABCDEF"[byte & 15];
  }
  return out;
}

std::string html_image(const Image& image, const std::string& alternative, int quality, int width) {
  const int shown = width > 0 ? width : image.width;
  return "<img loading=lazy decoding=async width=" + std::to_string(shown) +
         " height=" + std::to_string(image.height * shown / std::max(1, image.width)) + " alt=\"" +
         markup_text(alternative) + "\" src=\"" + data_address(image, quality) + "\">";
}

Image halved(const Image& image) {
  Image half(image.width / 2, image.height / 2, image.channels);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x)
      for (int k = 0; k < image.channels; ++k) {
        const bool alpha = image.channels == 4 && k == 3;
        double sum = 0;
        for (int j = 0; j < 4; ++j) {
          const std::uint8_t value = image.pixel(2 * x + j % 2, 2 * y + j / 2)[k];
          sum += alpha ? value / 255.0 : linear_from_srgb8(value);
        }
        half.pixel(x, y)[k] = alpha ? static_cast<std::uint8_t>(255 * sum / 4 + 0.5) : srgb8_from_linear(sum / 4);
      }
  return half;
}

std::string page_html(const Page& page) {
  const bool viewer = has_viewer() && !page.data.empty();
  std::string html =
      "<!DOCTYPE html>\n<html lang=en>\n<head>\n<meta charset=utf-8>\n"
      "<meta name=viewport content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=Content-Security-Policy content=\"default-src 'none'; img-src data: blob:; style-src "
      "'unsafe-inline'; script-src 'unsafe-inline'\">\n<title>" +
      markup_text(page.title) + "</title>\n<link rel=icon href=\"data:,\">\n<style>\n" + asset("style.css") +
      "</style>\n</head>\n<body>\n<header><h1>" + markup_text(page.title) + "</h1>" + page.navigation +
      "<button type=button id=theme hidden></button></header>\n<main>\n" + page.body + "</main>\n";
  if (viewer && !page.texture.empty())
    html += "<img id=face-texture hidden alt=\"\" src=\"" + data_address(page.texture, 0) + "\">\n";
  if (viewer) html += "<script type=\"text/plain\" id=face-data>" + page.data + "</script>\n";
  if (has_viewer()) html += "<script>\n" + asset("viewer.js") + "</script>\n";
  return html + "</body>\n</html>\n";
}

}  // namespace facewright
