// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/svg_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "libmodel/io/markup.h"

namespace facewright {
namespace {

// Colours that people with any colour vision tell apart (Okabe and Ito).
constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};
constexpr int kLeft = 74, kRight = 20, kTop = 40, kBottom = 52, kLegendLine = 18;  // pixels
constexpr size_t kMostMarkers = 30;

std::string number(double value, int digits = 2) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string tick_label(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

double error_at(const PlotCurve& c, size_t i) {
  return i < c.error.size() && std::isfinite(c.error[i]) ? std::abs(c.error[i]) : 0;
}

std::vector<size_t> finite_points(const PlotCurve& c) {
  std::vector<size_t> list;
  for (size_t i = 0; i < std::min(c.x.size(), c.y.size()); ++i)
    if (std::isfinite(c.x[i]) && std::isfinite(c.y[i])) list.push_back(i);
  return list;
}

class Chart {
 public:
  explicit Chart(const Plot& plot) : plot_(plot) {
    double x_max = 0, y_max = 0;
    for (const PlotCurve& c : plot.curves)
      for (const size_t i : finite_points(c)) {
        x_max = std::max(x_max, c.x[i]);
        y_max = std::max(y_max, c.y[i] + error_at(c, i));
        empty_ = false;
      }
    x_ticks_ = axis_ticks(x_max);
    y_ticks_ = axis_ticks(y_max);
    x_end_ = std::max(x_max * 1.02, 1e-300);
    if (x_max <= 0) x_end_ = 1;
    legend_ = kLegendLine * static_cast<int>(plot.curves.size());
    height_ = plot.height + legend_;
  }

  std::string document() {
    const std::string w = std::to_string(plot_.width), h = std::to_string(height_);
    out_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "\" height=\"" + h + "\" viewBox=\"0 0 " + w +
           " " + h + "\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"" + w + "\" height=\"" + h +
           "\" fill=\"white\"/>\n";
    text(plot_.width / 2.0, 22, plot_.title, "middle", " font-size=\"15\" font-weight=\"bold\"");
    legend();
    axes();
    for (size_t i = 0; i < plot_.curves.size(); ++i) curve(plot_.curves[i], colour(i));
    if (empty_) text(plot_.width / 2.0, (top() + bottom()) / 2, "nothing to measure", "middle", " fill=\"#777\"");
    return out_ + "</svg>\n";
  }

 private:
  static std::string colour(size_t i) { return kColours[i % std::size(kColours)]; }
  double top() const { return kTop + legend_; }
  double bottom() const { return height_ - kBottom; }
  double at_x(double x) const { return kLeft + x / x_end_ * (plot_.width - kLeft - kRight); }
  double at_y(double y) const { return bottom() - y / y_ticks_.back() * (bottom() - top()); }
  std::string at(double x, double y) const { return number(at_x(x)) + "," + number(at_y(y)); }

  void text(double x, double y, const std::string& words, const char* anchor, const std::string& more = "") {
    out_ += "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\"" + more + ">" +
            markup_text(words) + "</text>\n";
  }
  void line(double x1, double y1, double x2, double y2, const std::string& stroke) {
    out_ += "<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" + number(y2) +
            "\" stroke=\"" + stroke + "\"/>\n";
  }

  void legend() {
    for (size_t i = 0; i < plot_.curves.size(); ++i) {
      const double y = kTop + kLegendLine * static_cast<double>(i);
      out_ += "<line x1=\"" + std::to_string(kLeft + 8) + "\" y1=\"" + number(y) + "\" x2=\"" +
              std::to_string(kLeft + 36) + "\" y2=\"" + number(y) + "\" stroke=\"" + colour(i) +
              "\" stroke-width=\"2.5\"/>\n";
      text(kLeft + 44, y + 4.5, plot_.curves[i].name, "start");
    }
  }

  void axes() {
    const double right = plot_.width - kRight;
    for (const double y : y_ticks_) {
      line(kLeft, at_y(y), right, at_y(y), y == 0 ? "#444" : "#ddd");
      text(kLeft - 8, at_y(y) + 4.5, tick_label(y), "end");
    }
    for (const double x : x_ticks_) {
      if (x > x_end_) continue;
      line(at_x(x), bottom(), at_x(x), bottom() + 5, "#444");
      text(at_x(x), bottom() + 19, tick_label(x), "middle");
    }
    line(kLeft, top(), kLeft, bottom(), "#444");
    text((kLeft + right) / 2, height_ - 12, plot_.x_label, "middle");
    const std::string middle = number((top() + bottom()) / 2);
    text(18, (top() + bottom()) / 2, plot_.y_label, "middle", " transform=\"rotate(-90 18 " + middle + ")\"");
  }

  void curve(const PlotCurve& c, const std::string& stroke) {
    const std::vector<size_t> points = finite_points(c);
    if (points.empty()) return;
    if (!c.error.empty()) {
      std::string band;
      for (const size_t i : points) band += at(c.x[i], c.y[i] + error_at(c, i)) + " ";
      for (auto i = points.rbegin(); i != points.rend(); ++i)
        band += at(c.x[*i], std::max(0.0, c.y[*i] - error_at(c, *i))) + " ";
      out_ += "<polygon points=\"" + band + "\" fill=\"" + stroke + "\" fill-opacity=\"0.3\"/>\n";
    }
    std::string path;
    for (const size_t i : points) path += at(c.x[i], c.y[i]) + " ";
    out_ += "<polyline points=\"" + path + "\" fill=\"none\" stroke=\"" + stroke + "\" stroke-width=\"2\"/>\n";
    if (points.size() > kMostMarkers) return;
    for (const size_t i : points)
      out_ += "<circle cx=\"" + number(at_x(c.x[i])) + "\" cy=\"" + number(at_y(c.y[i])) + "\" r=\"3\" fill=\"" +
              stroke + "\"/>\n";
  }

  const Plot& plot_;
  std::vector<double> x_ticks_, y_ticks_;
  double x_end_ = 1;
  int legend_ = 0, height_ = 0;
  bool empty_ = true;
  std::string out_;
};

}  // namespace

std::vector<double> axis_ticks(double highest) {
  if (!(highest > 0) || !std::isfinite(highest)) return {0, 1};
  double step = std::pow(10, std::floor(std::log10(highest / 4)));
  for (const double factor : {2.0, 2.5, 2.0})
    if (highest / step > 8) step *= factor;
  std::vector<double> ticks;
  for (int i = 0; i == 0 || ticks.back() < highest * (1 - 1e-12); ++i) ticks.push_back(i * step);
  return ticks;
}

std::string svg_plot(const Plot& plot) { return Chart(plot).document(); }

}  // namespace facewright
