// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include "libmodel/io/atomic_file.h"
#include "libmodel/io/csv.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/text_builder.h"
#include "pipelines/evaluation.h"
#include "pipelines/json_text.h"
#include "pipelines/svg_plot.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

// One measured curve of one set, with the words that go with it.
struct Measure {
  std::string quantity;  // generalisation, specificity
  std::string name;      // shape-vertices, shape-surface-to-truth, colour-vertices, ...
  std::string unit;
  std::string title, y_label;
  const MetricCurve* curve;
};

const char* words_of(const std::string& kind) {
  if (kind == "landmarks") return "mean distance of landmarks, mm";
  if (kind == "surface") return "mean distance to the surface, mm";
  return "mean distance of corresponding vertices, mm";
}

void add(const DistanceCurves& curves, const std::string& quantity, const std::string& what, const std::string& suffix,
         const std::string& title, std::vector<Measure>& list) {
  const bool colour = what == "colour";
  for (const auto& [kind, curve] :
       {std::pair{"vertices", &curves.vertices}, {"surface", &curves.surface}, {"landmarks", &curves.landmarks}})
    if (!curve->empty())
      list.push_back({quantity, what + "-" + kind + suffix, colour ? "rgb" : "mm", title,
                      colour ? "mean distance of corresponding vertices, linear RGB" : words_of(kind), curve});
}

void add_model(const EvaluatedModel& model, const std::string& what, std::vector<Measure>& list) {
  const std::string of = " (" + what + ")";
  add(model.generalisation.own, "generalisation", what, "", "Generalisation" + of + ": to the left-out scan", list);
  add(model.generalisation.target, "generalisation", what, "-to-truth",
      "Generalisation" + of + ": to the truth of the left-out scan", list);
  add(model.specificity.nearest, "specificity", what, "", "Specificity" + of + ": random face to the nearest scan",
      list);
}

std::vector<Measure> measures(const EvaluatedSet& set) {
  std::vector<Measure> list;
  add_model(set.shape, "shape", list);
  if (set.colour) add_model(*set.colour, "colour", list);
  return list;
}

// The curve of another set that belongs beside this one: of the same name, or, for distances to the truth, its own.
const MetricCurve* counterpart(const Measure& m, const EvaluatedSet& other) {
  std::string wanted = m.name;
  if (const auto truth = wanted.find("-to-truth"); truth != std::string::npos) wanted.resize(truth);
  const MetricCurve* found = nullptr;
  for (const Measure& o : measures(other))
    if (o.quantity == m.quantity && o.name == wanted) found = o.curve;
  return found;
}

std::vector<double> to_vector(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

Json curve_json(const MetricCurve& curve) {
  Json j = {
      {"modes", curve.modes}, {"value", to_vector(curve.value)}, {"standard_error", to_vector(curve.standard_error)}};
  return j;
}

Json items_json(const MetricCurve& curve) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < curve.items.rows(); ++i) rows.push_back(to_vector(curve.items.row(i).transpose()));
  return rows;
}

Json compactness_json(const CompactnessResult& c) {
  Json j = curve_json(c.variance);
  j["share"] = to_vector(c.share);
  j["total_variance"] = c.total_variance;
  j["variances"] = to_vector(c.variances);
  return j;
}

Json set_json(const EvaluatedSet& set) {
  Json j = {{"name", set.name},
            {"scans", set.ids.size()},
            {"vertices", set.vertices},
            {"landmarks", set.landmarks},
            {"area_mm2", set.area},
            {"folds", set.shape.generalisation.fold_count},
            {"fewest_training", set.shape.generalisation.fewest_training},
            {"ids", set.ids},
            {"differences", set.differences}};
  j["compactness"]["shape"] = compactness_json(set.shape.compactness);
  if (set.colour) j["compactness"]["colour"] = compactness_json(set.colour->compactness);
  for (const Measure& m : measures(set)) {
    Json& entry = j[m.quantity][m.name];
    entry = curve_json(*m.curve);
    entry["unit"] = m.unit;
    if (m.quantity == "generalisation") entry["per_scan"] = items_json(*m.curve);
  }
  return j;
}

Json options_json(const EvaluationOptions& o) {
  const MetricsOptions& m = o.metrics;
  const char* alignment = m.alignment == FoldAlignment::none       ? "none"
                          : m.alignment == FoldAlignment::per_fold ? "per-fold"
                                                                   : "shared";
  return {{"modes", m.modes},
          {"folds", m.folds == 0 ? Json("loo") : Json(m.folds)},
          {"alignment", alignment},
          {"scaling", m.scaling == Scaling::free ? "free" : "fixed"},
          {"samples", m.samples},
          {"surface_samples", m.surface_samples},
          {"surface_vertices", m.surface_vertices},
          {"seed", m.seed},
          {"level", o.set.level},
          {"rim_weight", o.set.rim_weight}};
}

// Calls back for every measure of the first set and each other set that has it.
void for_each_ratio(const Evaluation& e,
                    const std::function<void(const Measure&, const EvaluatedSet&, const MetricCurve&)>& use) {
  for (size_t s = 1; s < e.sets.size(); ++s)
    for (const Measure& m : measures(e.sets.front())) {
      const MetricCurve* other = counterpart(m, e.sets[s]);
      if (other != nullptr && other->items.rows() == m.curve->items.rows()) use(m, e.sets[s], ratio(*m.curve, *other));
    }
}

Json evaluation_json(const Evaluation& e) {
  Json j = {{"format", "facewright-evaluation 1"}, {"options", options_json(e.options)}, {"sets", Json::array()}};
  for (const EvaluatedSet& set : e.sets) j["sets"].push_back(set_json(set));
  j["ratios"] = Json::array();
  for_each_ratio(e, [&](const Measure& m, const EvaluatedSet& other, const MetricCurve& r) {
    Json entry = {{"of", e.sets.front().name}, {"to", other.name}, {"quantity", m.quantity}, {"measure", m.name}};
    entry.update(curve_json(r));
    j["ratios"].push_back(std::move(entry));
  });
  return j;
}

std::string csv_numbers(std::initializer_list<double> numbers) {
  std::string out;
  for (const double x : numbers) {
    out += ',';
    append_number(out, x);
  }
  return out;
}

std::string distance_csv(const Evaluation& e, const std::string& quantity) {
  std::string out = "set,measure,unit,modes,value,standard_error\n";
  for (const EvaluatedSet& set : e.sets)
    for (const Measure& m : measures(set))
      for (size_t i = 0; i < m.curve->modes.size() && m.quantity == quantity; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        out += csv_field(set.name) + "," + m.name + "," + m.unit + "," + std::to_string(m.curve->modes[i]) +
               csv_numbers({m.curve->value[k], m.curve->standard_error[k]}) + "\n";
      }
  return out;
}

std::string compactness_csv(const Evaluation& e) {
  std::string out = "set,measure,unit,modes,value,standard_error,share\n";
  const auto rows = [&](const EvaluatedSet& set, const CompactnessResult& c, const char* measure) {
    for (size_t i = 0; i < c.variance.modes.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      out += csv_field(set.name) + "," + measure + "," + std::to_string(c.variance.modes[i]) +
             csv_numbers({c.variance.value[k], c.variance.standard_error[k], c.share[k]}) + "\n";
    }
  };
  for (const EvaluatedSet& set : e.sets) {
    rows(set, set.shape.compactness, "shape,mm^2");
    if (set.colour) rows(set, set.colour->compactness, "colour,rgb^2");
  }
  return out;
}

PlotCurve plot_curve(const std::string& name, const MetricCurve& curve, double factor = 1) {
  return {name,
          {curve.modes.begin(), curve.modes.end()},
          to_vector(factor * curve.value),
          to_vector(factor * curve.standard_error)};
}

void plot_compactness(const std::filesystem::path& folder, const Evaluation& e, const std::string& what,
                      const std::string& unit, const CompactnessResult* (*of)(const EvaluatedSet&)) {
  Plot variance{"Compactness (" + what + ")", "modes", "variance explained per vertex, " + unit, {}};
  Plot share{"Compactness (" + what + ")", "modes", "share of the total variance, %", {}};
  for (const EvaluatedSet& set : e.sets)
    if (const CompactnessResult* c = of(set)) {
      variance.curves.push_back(plot_curve(set.name, c->variance, 1.0 / set.vertices));
      share.curves.push_back({set.name, variance.curves.back().x, to_vector(100 * c->share), {}});
    }
  if (variance.curves.empty()) return;
  write_file(folder / ("compactness-" + what + ".svg"), svg_plot(variance));
  write_file(folder / ("compactness-" + what + "-share.svg"), svg_plot(share));
}

void plot_measures(const std::filesystem::path& folder, const Evaluation& e) {
  for (const Measure& m : measures(e.sets.front())) {
    Plot plot{m.title, "modes", m.y_label, {plot_curve(e.sets.front().name, *m.curve)}};
    for (size_t s = 1; s < e.sets.size(); ++s)
      if (const MetricCurve* other = counterpart(m, e.sets[s]))
        plot.curves.push_back(plot_curve(e.sets[s].name, *other));
    write_file(folder / (m.quantity + "-" + m.name + ".svg"), svg_plot(plot));
  }
}

void write_reconstructions(const std::filesystem::path& folder, const Evaluation& e) {
  const SampleMatrix& kept = e.sets.front().shape.generalisation.kept;
  if (kept.rows() == 0) return;
  EvaluationSetOptions again = e.options.set;  // for the triangles, and the poses, which alignment has changed
  again.colours = false;
  const MetricsInput shapes = read_evaluation_set(again).shapes;
  const Eigen::Index N = shapes.samples.cols() / 3;
  for (Eigen::Index i = 0; i < kept.rows(); ++i) {
    const Eigen::Map<const Vertices> r(kept.row(i).data(), N, 3), x(shapes.samples.row(i).data(), N, 3);
    Mesh mesh;
    mesh.F = shapes.F;
    mesh.V = fit_similarity(r, x, shapes.alignment_weights, e.options.metrics.scaling).apply(r);
    write_ply(folder / "reconstructions" / (e.sets.front().ids[static_cast<size_t>(i)] + ".ply"), mesh);
  }
}

std::string value_at(const MetricCurve& curve, int modes, const char* format) {
  const auto found = std::find(curve.modes.begin(), curve.modes.end(), modes);
  if (found == curve.modes.end()) return "-";
  const auto k = static_cast<Eigen::Index>(found - curve.modes.begin());
  char text[64];
  std::snprintf(text, sizeof text, format, curve.value[k], curve.standard_error[k]);
  return text;
}

std::string padded(const std::string& text, size_t width) {
  return text.size() < width ? text + std::string(width - text.size(), ' ') : text + " ";
}

// Few enough to read: 0, 1, 2, 5, 10, 20, .. and the last.
std::vector<int> shown_modes(const MetricCurve& curve) {
  if (curve.modes.size() <= 10) return curve.modes;
  std::vector<int> list;
  for (const int m : curve.modes)
    if (m == curve.modes.back() || m <= 2 || m == 5 || m == 10 || m == 15 || m == 20 || m == 30 || m == 50 || m == 100)
      list.push_back(m);
  return list.size() > 10 ? std::vector<int>(list.end() - 10, list.end()) : list;
}

std::string row(const std::string& label, const MetricCurve& curve, const std::vector<int>& modes, const char* format) {
  std::string out = padded("  " + label, 32);
  for (const int m : modes) out += padded(value_at(curve, m, format), 15);
  return out + "\n";
}

}  // namespace

std::string describe_evaluation(const Evaluation& e) {
  std::string out;
  for (const EvaluatedSet& set : e.sets) {
    out += set.name + ": " + std::to_string(set.ids.size()) + " scans, " + std::to_string(set.vertices) + " vertices\n";
    for (const std::string& d : set.differences) out += "  NOT COMPARABLE: " + d + "\n";
  }
  for (const Measure& m : measures(e.sets.front())) {
    const std::vector<int> modes = shown_modes(*m.curve);
    out += padded(m.quantity + ", " + m.name, 32) + "[" + m.unit + ", +- standard error]\n" + padded("  modes", 32);
    for (const int k : modes) out += padded(std::to_string(k), 15);
    out += "\n" + row(e.sets.front().name, *m.curve, modes, "%.4f+-%.4f");
    for (size_t s = 1; s < e.sets.size(); ++s)
      if (const MetricCurve* other = counterpart(m, e.sets[s])) {
        out += row(e.sets[s].name, *other, modes, "%.4f+-%.4f");
        if (other->items.rows() == m.curve->items.rows())
          out += row("ratio to " + e.sets[s].name, ratio(*m.curve, *other), modes, "%.3f+-%.3f");
      }
  }
  return out;
}

void write_evaluation(const std::filesystem::path& folder, const Evaluation& e) {
  plot_compactness(folder, e, "shape", "mm^2", [](const EvaluatedSet& s) { return &s.shape.compactness; });
  plot_compactness(folder, e, "colour", "RGB^2", [](const EvaluatedSet& s) {
    return s.colour ? &s.colour->compactness : static_cast<const CompactnessResult*>(nullptr);
  });
  plot_measures(folder, e);
  write_reconstructions(folder, e);
  write_file(folder / "compactness.csv", compactness_csv(e));
  write_file(folder / "generalisation.csv", distance_csv(e, "generalisation"));
  write_file(folder / "specificity.csv", distance_csv(e, "specificity"));
  write_file(folder / "evaluation.json", json_text(evaluation_json(e), 1) + "\n");  // last: the rest is whole
}

}  // namespace facewright
