// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/build_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/markup.h"
#include "pipelines/evaluation.h"
#include "pipelines/model_pictures.h"
#include "pipelines/scan_rows.h"
#include "pipelines/viewer/page.h"
#include "pipelines/viewer/viewer_data.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kSampleSigma = 0.75;   // full draws of few scans leave the gamut of skin now and then
constexpr int kSpecificityFaces = 200;  // random faces: a fifth of evaluate-model's
constexpr int kMostFolds = 60;          // beyond so many scans, they are left out in so many groups
constexpr int kEachMode = 10;           // the first modes are measured one by one, later ones farther apart

std::string figure(const Image& image, const std::string& alternative, const std::string& caption, int quality = 88) {
  return "<figure>" + html_image(image, alternative, quality) + "<figcaption>" + caption + "</figcaption></figure>\n";
}

// Names and values of the page's first lines.
std::string numbers(const MorphableModel& model, const ModelStageResult& stage, const BuildPipelineSummary& summary,
                    double median_surface_mm) {
  std::string html = "<dl class=numbers>";
  const auto add = [&](const std::string& name, const std::string& value) {
    html += "<div><dt>" + name + "</dt><dd>" + value + "</dd></div>";
  };
  add("scans", std::to_string(summary.scans.size()));
  add("registered", std::to_string(summary.registered));
  add("left out", std::to_string(summary.failed));
  if (!stage.pruned.empty()) add("pruned as outliers", std::to_string(stage.pruned.size()));
  add("from the scans, median", html_number(median_surface_mm, 3) + " mm");
  add("shape modes", std::to_string(model.shape().mode_count()));
  add("colour modes", std::to_string(model.colour().mode_count()));
  if (model.expression()) add("expression modes", std::to_string(model.expression()->mode_count()));
  if (!model.blendshapes().empty()) add("blendshapes", std::to_string(model.blendshapes().size()));
  for (int l = 0; l < model.level_count(); ++l)
    add("vertices, level " + std::to_string(l), std::to_string(model.vertex_count(l)));
  double seconds = 0;
  for (const auto& [name, value] : summary.seconds) seconds += value;
  add("took", "<span class=seconds>" +
                  (seconds < 120 ? html_number(seconds, 0) + " s" : html_number(seconds / 60, 1) + " min") + "</span>");
  return html + "</dl>\n";
}

// One by one at first, then spread evenly over what is left.
std::vector<int> mode_counts(Eigen::Index scans) {
  const int most = static_cast<int>(std::max<Eigen::Index>(0, scans - 2));
  std::vector<int> modes;
  for (int m = 0; m <= std::min(most, kEachMode); ++m) modes.push_back(m);
  for (int i = 1; i <= kEachMode && most > kEachMode; ++i) {
    const int m = kEachMode + (most - kEachMode) * i / kEachMode;
    if (m > modes.back()) modes.push_back(m);
  }
  return modes;
}

// Plots of the model's quality on its coarsest level, from the scans it is made of; writes the figures behind them.
std::string quality(const MorphableModel& model, const RegisteredSet& scans, size_t of_scans,
                    const BuildPipelineOptions& options, const OutputTree& tree) {
  if (scans.scan_count() < 3) return "<p>Fewer than three scans: there is nothing to measure.</p>\n";
  Evaluation evaluation;
  evaluation.options.set.level = 0;
  MetricsOptions& metrics = evaluation.options.metrics;
  metrics.modes = mode_counts(scans.scan_count());
  metrics.folds = scans.scan_count() > kMostFolds ? kMostFolds : 0;
  metrics.scaling = options.scaling;
  metrics.samples = kSpecificityFaces;
  metrics.surface_samples = 0;
  metrics.surface_vertices = 0;
  metrics.seed = options.seed;
  metrics.threads = options.jobs;
  evaluation.options.set.threads = options.jobs;
  evaluation.sets.push_back(evaluate_set("model", evaluation_set(scans, model, 0, evaluation.options.set), metrics));
  const std::filesystem::path folder = tree.report() / "evaluation";
  write_evaluation(folder, evaluation);
  std::string html =
      "<p>Measured on " +
      (scans.ids.size() < of_scans ? "a draw of " + std::to_string(scans.ids.size()) + " of the " : "all ") +
      std::to_string(of_scans) + " scans, on the level of " + std::to_string(model.vertex_count(0)) +
      " vertices, bands are standard errors. Compactness is the variance that the leading modes explain; "
      "generalisation "
      "the error of a scan that was left out, rebuilt by a model of the others; specificity the distance of a random "
      "face to the nearest scan. <code>evaluate-model</code> measures the other levels, to surfaces too, and compares "
      "with other sets.</p>\n<div class=plots>\n";
  for (const char* plot : {"compactness-shape-share", "generalisation-shape-vertices", "specificity-shape-vertices",
                           "compactness-colour-share", "generalisation-colour-vertices", "specificity-colour-vertices"})
    if (const auto file = folder / (std::string(plot) + ".svg"); std::filesystem::exists(file))
      html += "<figure role=img aria-label=\"" + std::string(plot) + "\">" + read_file(file) + "</figure>\n";
  return html + "</div>\n";
}

std::string pictures(const MorphableModel& model, const BuildPipelineOptions& options) {
  const int threads = options.jobs;
  std::string html = "<h2 id=modes>Mean and modes</h2>\n" +
                     figure(mean_picture(model, {.threads = threads}),
                            "The mean face from three sides, with colour and in clay", "The mean face.");
  const auto modes = [&](ModeFamily family, const char* what, const char* caption, Eigen::Index count) {
    if (count == 0) return;
    ModePictureOptions mode;
    mode.family = family;
    mode.faces.level = 0;
    mode.faces.threads = threads;
    html += figure(mode_picture(model, mode), what, caption, 82);
  };
  modes(ModeFamily::shape, "The leading shape modes at -3, 0 and +3 standard deviations from three sides",
        "The leading shape modes, each at -3, 0 and +3 standard deviations, from three sides.",
        model.shape().mode_count());
  modes(ModeFamily::colour, "The leading colour modes at -3, 0 and +3 standard deviations from three sides",
        "The leading colour modes in the same way, without light.", model.colour().mode_count());
  modes(ModeFamily::expression, "The leading expression modes", "The leading expression modes.",
        model.expression() ? model.expression()->mode_count() : 0);
  html += figure(deviation_picture(model, 0, {.threads = threads}), "How much each part of the face varies",
                 "Standard deviation of each vertex: where these people differ.");
  html += figure(sample_picture(model, 12, kSampleSigma, options.seed,
                                {.level = 1 % model.level_count(), .tile = 200, .threads = threads}),
                 "Twelve random faces", "People who do not exist: coefficients drawn with 0.75 standard deviations.");
  html += "<h2 id=levels>Levels and texture map</h2>\n" +
          figure(level_picture(model, {.tile = 420, .threads = threads}), "The levels as wireframes",
                 "A coarser level is the first vertices of the finer ones, with triangles of its own.");
  if (model.uv().rows() > 0)
    html += figure(texture_map_picture(model, {.level = 0, .tile = 512, .threads = threads}), "The texture map",
                   "The texture map (isomap): the mean's colours and the coarsest level's triangles.");
  return html;
}

// A table of names and counts, if there is one.
std::string counts(const Json& card, const char* key, const char* title, const char* unit) {
  if (!card.contains(key) || card[key].empty()) return "";
  std::string html = std::string("<div><h3>") + title + "</h3><table><thead><tr><th scope=col>" + title +
                     "</th><th scope=col>" + unit + "</th></tr></thead><tbody>";
  for (const auto& [name, count] : card[key].items())
    html += "<tr><td>" + markup_text(name) + "</td><td>" + count.dump() + "</td></tr>";
  return html + "</tbody></table></div>\n";
}

std::string model_card(const std::string& text) {
  const Json card = Json::parse(text);
  std::string html = "<h2 id=card>Model card</h2>\n<p>" + card["people"].dump() + " people, " + card["scans"].dump() +
                     " scans. Terms: " + markup_text(card["terms"].get<std::string>()) + ".";
  if (!card["manifest"].get<bool>()) html += " The scans came without a manifest: nothing is stated about the people.";
  html += "</p>\n<div class=card>" +
          (card["manifest"].get<bool>()
               ? counts(card, "groups", "group", "people") + counts(card, "ages", "age, years", "people") +
                     counts(card, "expressions", "expression", "scans")
               : "") +
          "</div>\n<p>Units " + markup_text(card["units"].get<std::string>()) + "; axes " +
          markup_text(card["axes"].get<std::string>()) + "; colours " +
          markup_text(card["colour_space"].get<std::string>()) + "; coefficients " +
          markup_text(card["coefficients"].get<std::string>()) + ".</p>\n";
  if (card.contains("filled_colours"))
    html += "<p>Colours filled in, because no camera saw them well: " +
            html_number(100 * card["filled_colours"]["share"].get<double>(), 1) + " %.</p>\n";
  return html + "<p>The whole card is in <a href=\"../model_card.md\">model_card.md</a>.</p>\n";
}

std::string timing(const BuildPipelineSummary& summary) {
  std::string html =
      "<h2 id=time>Where the time went</h2>\n<table><thead><tr><th scope=col>stage</th><th "
      "scope=col>seconds</th></tr></thead><tbody>";
  for (const auto& [name, value] : summary.seconds)
    html +=
        "<tr><td>" + markup_text(name) + "</td><td><span class=seconds>" + html_number(value, 1) + "</span></td></tr>";
  return html + "</tbody></table>\n";
}

}  // namespace

void write_build_report(const MorphableModel& model, const ModelStageResult& stage, const BuildPipelineSummary& summary,
                        const BuildPipelineOptions& options, const OutputTree& tree) {
  const ScanTable scans = scan_table(model, stage, summary, tree, options.jobs);
  Page page;
  page.title = "Face model";
  page.navigation =
      "<nav aria-label=Contents><a href=\"#face\">Face</a><a href=\"#scans\">Scans</a><a href=\"#modes\">Modes</a><a "
      "href=\"#levels\">Levels</a><a href=\"#quality\">Quality</a><a href=\"#card\">Model card</a></nav>";
  page.body = numbers(model, stage, summary, scans.median_surface_mm) + "<h2 id=face>The model</h2>\n" + viewer_html() +
              "<h2 id=scans>Scans</h2>\n<p>Left: the scan, and the landmarks used (blue; lines lead to where the "
              "registered face has them; red crosses were rejected). Middle: how far the registered face lies from the "
              "scan, blue inside, red outside, hatched where the scan shows nothing and the place was mirrored or "
              "interpolated. Headings sort; pictures lead to larger ones beside this page.</p>\n" +
              scans.html + pictures(model, options) + "<h2 id=quality>Quality</h2>\n" +
              quality(model, stage.scans, stage.built.scans.size(), options, tree) + model_card(stage.card_json) +
              timing(summary);
  page.data = has_viewer() ? model_viewer_data(model) : "";
  write_file(tree.report() / "index.html", page_html(page));
}

}  // namespace facewright
