// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>

#include "libmodel/core/image.h"

namespace facewright {

/// Whether the program was built with three.js; without it pages have their text and pictures, but no viewer.
bool has_viewer();

/// A page in one file that asks for nothing from elsewhere.
struct Page {
  std::string title;       ///< text
  std::string navigation;  ///< HTML in the page's head, or empty
  std::string body;        ///< HTML
  std::string data;        ///< of the viewer (viewer_data.h), or empty
  Image texture;           ///< of the mesh in `data`, or empty
};
std::string page_html(const Page& page);

/// Where the body wants the viewer: its frame, or a sentence that says why there is none.
std::string viewer_html();

/// With so many digits behind the point.
std::string html_number(double value, int digits = 2);
/// A file's name as part of a link.
std::string html_link(const std::string& name);

/// An `<img>` element that carries its picture: JPEG of `quality` 1..100, or PNG for 0. `width` is the one it is shown
/// with, 0 = its own.
std::string html_image(const Image& image, const std::string& alternative, int quality = 85, int width = 0);

/// Half the size, pixels averaged in linear light; odd last rows and columns are dropped.
Image halved(const Image& image);

}  // namespace facewright
