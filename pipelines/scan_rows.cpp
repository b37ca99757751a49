// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/scan_rows.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/core/similarity.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/markup.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/render_mesh.h"
#include "pipelines/landmark_record.h"
#include "pipelines/viewer/page.h"

namespace facewright {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr int kPortrait = 220;  // pixels

std::string cell(double value, int digits = 2) { return "<td>" + html_number(value, digits) + "</td>"; }

std::string heading(const char* text, const char* title) {
  return std::string("<th scope=col title=\"") + title + "\"><button type=button>" + text + "</button></th>";
}

// A picture from OUT, in the page or linked; nothing if it is not there.
std::string picture(const fs::path& file, const std::string& folder, const std::string& alternative, bool embed,
                    int width) {
  if (!fs::exists(file)) return "";
  const std::string link = "../" + folder + "/" + html_link(file.filename().string());
  if (!embed) return "<a href=\"" + link + "\">picture</a>";
  Image image = read_image(file);
  if (5 * image.height < image.width) return "";           // words alone
  while (image.width >= 4 * width) image = halved(image);  // twice as fine as shown, for fine screens
  return "<a href=\"" + link + "\">" + html_image(image, alternative, 82, width) + "</a>";
}

// The registered face in its own colours, turned to the model's pose.
std::string portrait(const MorphableModel& model, const RegisteredSet& set, Eigen::Index s, const std::string& id) {
  Mesh mesh = model.mean();
  const Vertices V = set.vertices(s);
  mesh.V = fit_similarity(V, mesh.V, Scaling::fixed).apply(V);
  if (set.colours.rows() > 0) mesh.colours = Eigen::Map<const Colours>(set.colours.row(s).data(), V.rows(), 3);
  RenderOptions options;
  options.width = options.height = kPortrait;
  options.threads = 1;  // rows are made side by side
  return html_image(render_mesh(mesh, frame_camera(mesh.V, kPortrait, kPortrait, 20 * std::numbers::pi / 180), options),
                    "The registered face of " + id, 82, 110);
}

const char* landmark_source(const std::string& id, const OutputTree& tree) {
  const fs::path file = tree.landmarks(id);
  if (!fs::exists(file)) return "beside the scan";
  return is_by_hand(file) ? "by hand" : "found";
}

struct Row {
  std::string html;
  double surface_mm = 0;  // mean distance of a registered scan to its surface
};

std::string left_out_row(const std::string& id, const std::string& reason, const OutputTree& tree) {
  return "<tr><th scope=row data-value=\"" + markup_text(id) + "\">" + markup_text(id) + "</th><td>" +
         picture(tree.landmark_picture(id), "landmarks", "What was looked at for landmarks in " + id, true, 420) +
         "</td><td colspan=11 class=\"text bad\">left out: " + markup_text(reason) + "</td></tr>\n";
}

std::string notes(const Json& j, const std::string& id, const ModelStageResult& stage) {
  std::string text;
  const auto pruned = stage.pruned.find(id);
  if (pruned != stage.pruned.end()) text += pruned->second + "\n";
  if (j.contains("concern") && !j["concern"].get<std::string>().empty()) text += j["concern"].get<std::string>() + "\n";
  if (j.contains("warnings"))
    for (const auto& warning : j["warnings"]) text += warning.get<std::string>() + "\n";
  if (j.contains("landmarks"))
    for (const auto& name : j["landmarks"]["rejected"])
      text += "landmark " + name.get<std::string>() + " was rejected\n";
  return text;
}

Row registered_row(const MorphableModel& model, const ModelStageResult& stage, const std::string& id,
                   const OutputTree& tree, bool embed) {
  const Json j = Json::parse(read_file(tree.scan_report(id)));
  const Json &origins = j["origins"], &surface = j["surface_mm"], &marks = j["landmarks"];
  const double all = std::max(1.0, origins["matched"].get<double>() + origins["mirrored"].get<double>() +
                                       origins["interpolated"].get<double>() + origins["free"].get<double>());
  std::string html =
      "<tr><th scope=row data-value=\"" + markup_text(id) + "\">" + markup_text(id) + "</th><td>" +
      picture(tree.scan_picture(id), "pictures", "The scan " + id + " and its landmarks", embed, 230) + "</td><td>" +
      picture(tree.error_picture(id), "scans", "Distance of the registered face to the scan " + id, embed, 360) +
      "</td><td>";
  const auto& ids = stage.scans.ids;
  const auto at = std::find(ids.begin(), ids.end(), id);
  if (embed && at != ids.end()) html += portrait(model, stage.scans, at - ids.begin(), id);
  html += "</td>" + cell(surface["mean"], 3) + cell(surface["p95"], 3) + cell(marks["residual_mean_mm"]) +
          cell(marks["residual_max_mm"]);
  for (const char* kind : {"matched", "mirrored", "interpolated"})
    html += cell(100 * origins[kind].get<double>() / all, 1);
  const std::string text = notes(j, id, stage);
  html += cell(j["folded_edges"]["count"].get<double>(), 0) + "<td><span class=seconds>" +
          html_number(j.value("seconds", 0.0), 1) + "</span></td>" + "<td class=text>landmarks " +
          landmark_source(id, tree) + (text.empty() ? "" : "\n" + markup_text(text)) + "</td></tr>\n";
  return {std::move(html), surface["mean"].get<double>()};
}

// Those left out, those pruned, the others; each in order of id.
std::vector<const ScanOutcome*> in_order_of_rows(const BuildPipelineSummary& summary, const ModelStageResult& stage) {
  std::vector<const ScanOutcome*> order;
  for (const ScanOutcome& o : summary.scans) order.push_back(&o);
  std::stable_sort(order.begin(), order.end(), [&](const ScanOutcome* a, const ScanOutcome* b) {
    const auto rank = [&](const ScanOutcome* o) { return !o->registered ? 0 : stage.pruned.count(o->id) > 0 ? 1 : 2; };
    return rank(a) < rank(b);
  });
  return order;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

ScanTable scan_table(const MorphableModel& model, const ModelStageResult& stage, const BuildPipelineSummary& summary,
                     const OutputTree& tree, int threads, int most_pictures) {
  const std::vector<const ScanOutcome*> order = in_order_of_rows(summary, stage);
  const auto registered = std::find_if(order.begin(), order.end(), [](const ScanOutcome* o) { return o->registered; });
  const int first = static_cast<int>(registered - order.begin());
  std::vector<Row> rows(order.size());
  parallel_for(static_cast<int>(order.size()), threads, [&](int i) {
    const ScanOutcome& o = *order[static_cast<size_t>(i)];
    rows[static_cast<size_t>(i)] = i < first ? Row{left_out_row(o.id, o.reason, tree)}
                                             : registered_row(model, stage, o.id, tree, i - first < most_pictures);
  });
  ScanTable table;
  table.html =
      "<div class=wide><table class=sortable><thead><tr>" + heading("scan", "id of the scan") +
      "<th scope=col>scan and landmarks</th><th scope=col>distance to the scan</th><th scope=col>registered</th>" +
      heading("mean mm", "distance of matched vertices to the denoised scan, mean") +
      heading("95 % mm", "the same, 95 % are nearer") + heading("marks mm", "distance at the landmarks, mean") +
      heading("worst mm", "distance at the landmarks, largest") + heading("matched %", "vertices matched to the scan") +
      heading("mirrored %", "vertices whose place came from the other side of the face") +
      heading("interpol. %", "vertices whose place came from their neighbours") +
      heading("folds", "edges folded over") + heading("s", "seconds, of one thread") +
      "<th scope=col>notes</th></tr></thead><tbody>\n";
  std::vector<double> means;
  for (size_t i = 0; i < rows.size(); ++i) {
    table.html += rows[i].html;
    if (order[i]->registered) means.push_back(rows[i].surface_mm);
  }
  table.html += "</tbody></table></div>\n";
  table.median_surface_mm = median(std::move(means));
  return table;
}

}  // namespace facewright
