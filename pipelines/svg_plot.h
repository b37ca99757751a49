// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

namespace facewright {

struct PlotCurve {
  std::string name;           ///< for the legend
  std::vector<double> x, y;   ///< same length; points that are not finite are left out
  std::vector<double> error;  ///< half the height of a band about y, or empty
};

struct Plot {
  std::string title, x_label, y_label;  ///< labels with their units
  std::vector<PlotCurve> curves;
  int width = 640, height = 420;  ///< pixels
};

/// Ticks at 1, 2 or 5 times a power of ten that cover 0 .. highest in 4 to 8 steps; the last is >= highest.
std::vector<double> axis_ticks(double highest);

/// A line chart from zero as an SVG document: axes with ticks, a grid, curves with bands for their errors, markers
/// where points are few, a legend. Well-formed for any text and any numbers; without points an empty chart that says
/// so.
std::string svg_plot(const Plot& plot);

}  // namespace facewright
