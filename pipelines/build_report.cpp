// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/build_report.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/render_mesh.h"

namespace facewright {
namespace {

constexpr int kTile = 240;  // pixels per picture on a sheet
constexpr int kMostThumbnails = 48;
constexpr double kSampleSigma = 0.75;  // full draws of few scans leave the gamut of skin now and then

Image portrait(const Mesh& mesh, double yaw_deg, bool grey = false) {
  RenderOptions options;
  options.width = options.height = kTile;
  options.use_colours = !grey;
  return render_mesh(mesh, frame_camera(mesh.V, kTile, kTile, yaw_deg * std::numbers::pi / 180), options);
}

// A registered scan lies in its own frame: turn it back for the picture.
Mesh registered_mesh(const MorphableModel& model, const RegisteredSet& set, Eigen::Index s) {
  Mesh mesh = model.mean();
  const Vertices V = set.vertices(s);
  mesh.V = fit_similarity(V, mesh.V, Scaling::fixed).apply(V);
  if (set.colours.rows() > 0) mesh.colours = Eigen::Map<const Colours>(set.colours.row(s).data(), V.rows(), 3);
  return mesh;
}

Image registered_sheet(const MorphableModel& model, const RegisteredSet& set) {
  std::vector<Image> tiles;
  for (Eigen::Index s = 0; s < std::min<Eigen::Index>(set.scan_count(), kMostThumbnails); ++s)
    tiles.push_back(portrait(registered_mesh(model, set, s), 20));
  return contact_sheet(tiles, 6);
}

Image mean_sheet(const MorphableModel& model) {
  std::vector<Image> tiles;
  for (const double yaw : {0.0, 35.0, 80.0}) tiles.push_back(portrait(model.mean(), yaw));
  for (const double yaw : {0.0, 35.0, 80.0}) tiles.push_back(portrait(model.mean(), yaw, true));
  return contact_sheet(tiles, 3);
}

Image mode_sheet(const MorphableModel& model) {
  std::vector<Image> tiles;
  const int modes = static_cast<int>(std::min<Eigen::Index>(5, model.shape().variances.size()));
  for (int k = 0; k < modes; ++k)
    for (const double sigma : {-3.0, -1.5, 0.0, 1.5, 3.0}) {
      Eigen::VectorXd c = Eigen::VectorXd::Zero(model.shape().variances.size());
      c[k] = sigma;
      tiles.push_back(portrait(model.instance(c), 30, true));
    }
  return contact_sheet(tiles, 5);
}

Image sample_sheet(const MorphableModel& model, std::uint64_t seed) {
  std::vector<Image> tiles;
  for (int i = 0; i < 12; ++i) {
    Random random = Random::stream(seed, static_cast<std::uint64_t>(i));
    tiles.push_back(portrait(model.sample(random, -1, kSampleSigma), 20));
  }
  return contact_sheet(tiles, 6);
}

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

// An id as part of a link.
std::string url(const std::string& text) {
  std::ostringstream out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 127 || std::isalnum(byte) || c == '-' || c == '_' || c == '.')
      out << c;
    else
      out << '%' << "0123456789ABCDEF"[byte >> 4] << "0123456789ABCDEF"[byte & 15];
  }
  return out.str();
}

void scan_row(const ScanOutcome& o, const OutputTree& tree, std::ostringstream& html) {
  if (!o.registered) {
    html << "<tr><td>" << escape(o.id) << "</td>"
         << "<td colspan=6 class=bad>left out: " << escape(o.reason) << "</td></tr>\n";
    return;
  }
  html << "<tr><td><a href='../scans/" << url(o.id) << ".png'>" << escape(o.id) << "</a></td>";
  const auto j = nlohmann::json::parse(read_file(tree.scan_report(o.id)));
  const auto& origins = j["origins"];
  html << "<td>" << origins["matched"] << "</td><td>" << origins["mirrored"] << "</td><td>" << origins["interpolated"]
       << "</td>";
  html.setf(std::ios::fixed);
  html.precision(3);
  html << "<td>" << j["surface_mm"]["mean"].get<double>() << "</td><td>"
       << j["landmarks"]["residual_mean_mm"].get<double>() << "</td><td>" << j["folded_edges"]["count"]
       << "</td></tr>\n";
}

std::string page(const MorphableModel& model, const BuildPipelineSummary& summary, const OutputTree& tree) {
  std::ostringstream html;
  html << "<!doctype html><html lang=en><meta charset=utf-8><title>Face model</title><style>"
          "body{font:16px/1.5 system-ui,sans-serif;max-width:1500px;margin:2em auto;padding:0 1em}img{max-width:100%}"
          "table{border-collapse:collapse}td,th{padding:.2em .8em;text-align:right;border-bottom:1px solid #ccc}"
          "td:first-child{text-align:left}.bad{color:#a00;text-align:left}</style>\n<h1>Face model</h1>\n<p>"
       << summary.registered << " of " << summary.scans.size() << " scans, " << model.shape().variances.size()
       << " shape and " << model.colour().variances.size() << " colour modes, levels of";
  for (const ModelLevel& l : model.levels()) html << " " << l.vertex_count << " (" << l.F.rows() << " triangles)";
  html << ".</p>\n<h2>The mean</h2><img src=mean.png alt='The mean face, with colour and in grey, from three sides'>\n"
          "<h2>Leading shape modes, -3 to +3 standard deviations</h2><img src=modes.png alt='Shape modes'>\n"
          "<h2>Random faces, drawn with 0.75 standard deviations</h2><img src=samples.png alt='Faces drawn from the "
          "model'>\n"
          "<h2>Registered scans</h2><img src=registered.png alt='Registered scans'>\n"
          "<h2>Scans</h2><p>Each leads to a picture of its distance from the "
          "scan.</p><table><tr><th>scan<th>matched<th>mirrored<th>interpolated<th>surface mm<th>landmarks "
          "mm<th>folds</tr>\n";
  for (const bool wanted : {false, true})  // failures first
    for (const ScanOutcome& o : summary.scans)
      if (o.registered == wanted) scan_row(o, tree, html);
  html << "</table></html>\n";
  return html.str();
}

}  // namespace

void write_build_report(const MorphableModel& model, const RegisteredSet& set, const BuildPipelineSummary& summary,
                        const BuildPipelineOptions& options, const OutputTree& tree) {
  std::filesystem::create_directories(tree.report());
  write_png(tree.report() / "registered.png", registered_sheet(model, set));
  write_png(tree.report() / "mean.png", mean_sheet(model));
  write_png(tree.report() / "modes.png", mode_sheet(model));
  write_png(tree.report() / "samples.png", sample_sheet(model, options.seed));
  write_file(tree.report() / "index.html", page(model, summary, tree));
}

}  // namespace facewright
