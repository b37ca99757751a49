// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_page.h"

#include <algorithm>
#include <numbers>

#include "libmodel/io/markup.h"
#include "pipelines/viewer/page.h"
#include "pipelines/viewer/viewer_data.h"

namespace facewright {
namespace {

constexpr int kLargest = 1200;  // pixels of a picture on the page
constexpr double kDegrees = 180 / std::numbers::pi;

Image small(Image image) {
  while (std::max(image.width, image.height) > kLargest) image = halved(image);
  return image;
}

std::string pictures(const FitPage& page) {
  std::string html = "<div class=pictures>\n";
  for (const auto& [caption, picture] : page.pictures)
    if (!picture.empty())
      html += "<figure>" + html_image(small(picture), caption, picture.channels == 4 ? 0 : 85) + "<figcaption>" +
              markup_text(caption) + "</figcaption></figure>\n";
  return html + "</div>\n";
}

// A line per image.
std::string pose_table(const FitPage& page) {
  std::string html =
      "<div class=wide><table class=sortable><thead><tr><th scope=col>image</th><th scope=col>yaw</th><th "
      "scope=col>pitch</th><th scope=col>roll</th><th scope=col>pixels per mm</th><th scope=col>landmark error, "
      "px</th><th scope=col>% of the outer eye distance</th><th scope=col>iterations</th><th "
      "scope=col>stopped</th></tr></thead><tbody>\n";
  for (size_t i = 0; i < page.fits.size(); ++i) {
    const FitNumbers& f = page.fits[i];
    html += "<tr><th scope=row>" + markup_text(page.names[i]) + "</th>";
    for (const double angle : {f.pose.yaw, f.pose.pitch, f.pose.roll})
      html += "<td>" + html_number(kDegrees * angle, 1) + "°</td>";
    html += "<td>" + html_number(f.pixels_per_mm) + "</td><td>" + html_number(f.rms_px) + "</td><td>" +
            html_number(f.rms_percent) + "</td><td>" + std::to_string(f.iterations) + "</td><td class=text>" +
            markup_text(to_string(f.stop)) + "</td></tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

std::string coefficient_table(const FitNumbers& f) {
  std::string html =
      "<details><summary>Coefficients</summary><table><thead><tr><th scope=col>mode</th><th scope=col>standard "
      "deviations</th><th scope=col>uncertainty</th></tr></thead><tbody>\n";
  for (Eigen::Index k = 0; k < f.shape_coefficients.size(); ++k)
    html += "<tr><td>shape " + std::to_string(k + 1) + "</td><td>" + html_number(f.shape_coefficients[k]) +
            "</td><td>" + (k < f.shape_stddevs.size() ? html_number(f.shape_stddevs[k]) : "") + "</td></tr>\n";
  for (Eigen::Index k = 0; k < f.expression_coefficients.size(); ++k)
    html += "<tr><td>expression " + std::to_string(k + 1) + "</td><td>" + html_number(f.expression_coefficients[k]) +
            "</td><td></td></tr>\n";
  for (const auto& [name, weight] : f.blendshape_weights)
    html += "<tr><td>" + markup_text(name) + "</td><td>" + html_number(weight) + "</td><td></td></tr>\n";
  return html + "</tbody></table></details>\n";
}

}  // namespace

std::string fit_page(const FittedFace& face, const FitPage& content) {
  Page page;
  page.title = content.title;
  page.body = viewer_html() + "<h2>Pictures</h2>\n" + pictures(content) + "<h2>The fit</h2>\n" + pose_table(content) +
              (content.fits.empty() ? "" : coefficient_table(content.fits.front()));
  if (has_viewer()) {
    Mesh mesh = face.mesh;
    page.texture = face.completed.texture;
    if (!page.texture.empty()) mesh.colours.resize(0, 3);  // the texture carries them
    page.data = mesh_viewer_data(mesh);
  }
  return page_html(page);
}

}  // namespace facewright
