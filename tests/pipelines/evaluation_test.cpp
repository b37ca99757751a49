// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "libmodel/building/build_model.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/svg_plot.h"
#include "tests/libmodel/building/planted.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// Opening and closing tags match, and nothing else is between < and >.
bool well_formed(const std::string& xml) {
  std::vector<std::string> open;
  for (size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at + 1)) {
    const size_t end = xml.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag.find('<') != std::string::npos) return false;
    if (tag.front() == '/') {
      if (open.empty() || open.back() != tag.substr(1)) return false;
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(tag.substr(0, tag.find(' ')));
    }
  }
  for (size_t at = xml.find('&'); at != std::string::npos; at = xml.find('&', at + 1))
    if (xml.find(';', at) > at + 6) return false;
  return open.empty();
}

TEST(SvgPlot, IsWellFormedWhateverTheNumbersAndWordsAre) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  Plot plot{"<a> & \"b\"", "modes\n", "mm", {}};
  EXPECT_TRUE(well_formed(svg_plot(plot)));
  EXPECT_THAT(svg_plot(plot), HasSubstr("nothing to measure"));
  plot.curves = {{"one < two", {0}, {0}, {}},
                 {"NaN", {0, 1, 2}, {nan, infinity, 1}, {0.1, 0.1, nan}},
                 {"empty", {}, {}, {}},
                 {"tiny", {0, 1e-9}, {1e-300, 2e-300}, {1, 1}}};
  const std::string svg = svg_plot(plot);
  EXPECT_TRUE(well_formed(svg));
  EXPECT_THAT(svg, AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf")), HasSubstr("one &lt; two")));
}

TEST(SvgPlot, HasEveryCurveItsBandAndTicksThatCoverIt) {
  const Plot plot{"t", "modes", "mm", {{"a", {0, 1, 2}, {3, 2, 1}, {0.5, 0.5, 0.5}}, {"b", {0, 2}, {1, 1}, {}}}};
  const std::string svg = svg_plot(plot);
  size_t lines = 0, bands = 0;
  for (size_t at = svg.find("<polyline"); at != std::string::npos; at = svg.find("<polyline", at + 1)) ++lines;
  for (size_t at = svg.find("<polygon"); at != std::string::npos; at = svg.find("<polygon", at + 1)) ++bands;
  EXPECT_EQ(lines, 2u);
  EXPECT_EQ(bands, 1u);
  for (const double highest : {1e-7, 0.3, 1.0, 3.5, 7.99, 8.01, 99.0, 12345.0}) {
    const std::vector<double> ticks = axis_ticks(highest);
    EXPECT_EQ(ticks.front(), 0);
    EXPECT_GE(ticks.back(), highest * (1 - 1e-9));
    EXPECT_TRUE(ticks.size() >= 4 && ticks.size() <= 10) << highest << ": " << ticks.size();
  }
}

// Spheres that differ by `modes` smooth waves of 2 mm; each in a frame of its own.
void write_spheres(const std::filesystem::path& folder, int count, int modes, double noise = 0, bool coloured = false) {
  const Mesh sphere = icosphere(2, 80);
  for (int i = 0; i < count; ++i) {
    Random random = Random::stream(3, static_cast<std::uint64_t>(i));
    Mesh mesh = sphere;
    for (int k = 1; k <= modes; ++k) {
      const double c = 2 * random.normal();
      for (Eigen::Index v = 0; v < mesh.V.rows(); ++v)
        mesh.V.row(v) += c * std::sin(0.03 * k * sphere.V(v, k % 3) + k) * sphere.V.row(v).normalized();
    }
    mesh.V += random_points(random, mesh.V.rows(), noise);
    if (coloured) mesh.colours = Colours::Constant(mesh.V.rows(), 3, random.uniform(0.2, 0.8));
    Similarity motion;
    motion.R = random_rotation(random);
    mesh.V = motion.apply(mesh.V);
    write_ply(folder / ("p" + std::to_string(i) + ".ply"), mesh);
  }
}

class EvaluateModel : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  static CommandResult run(const std::string& arguments) {
    return run_command(std::string(FACEWRIGHT_BIN_DIR) + "/evaluate-model " + arguments);
  }
  json evaluation(const std::string& name) const { return json::parse(read_file(path(name + "/evaluation.json"))); }
  TemporaryDirectory folder_;
};

TEST_F(EvaluateModel, MeasuresMeshesOfKnownRankAndLeavesTablesAndPlots) {
  write_spheres(path("s"), 8, 2, 0, true);
  write_file(path("s/landmark_vertices.json"), "{\"1\": 0, \"2\": 17}");
  const CommandResult r = run(path("s") + " --registered --samples 40 -o " + path("e"));
  ASSERT_EQ(r.exit_code, 0) << r.output;
  EXPECT_THAT(r.output, HasSubstr("8 scans, 162 vertices"));
  const json set = evaluation("e")["sets"][0];
  const json g = set["generalisation"]["shape-vertices"];
  EXPECT_EQ(g["modes"].size(), 7u);
  EXPECT_GT(g["value"][0].get<double>(), 0.5);
  EXPECT_LT(g["value"][3].get<double>(), 0.05);  // two modes, and what alignment bends
  EXPECT_EQ(g["per_scan"].size(), 8u);
  EXPECT_EQ(set["landmarks"], 2);
  EXPECT_LT(set["generalisation"]["colour-vertices"]["value"][1].get<double>(), 0.01);  // bytes of sRGB
  for (const char* file : {"compactness.csv", "generalisation.csv", "specificity.csv", "evaluate-model.toml"})
    EXPECT_GT(read_file(path("e") + "/" + file).size(), 20u) << file;
  int plots = 0;
  for (const auto& entry : std::filesystem::directory_iterator(path("e")))
    if (entry.path().extension() == ".svg") {
      ++plots;
      EXPECT_TRUE(well_formed(read_file(entry.path()))) << entry.path();
    }
  EXPECT_EQ(plots, 12);  // share and variance, 3 distances of 2 quantities of shape; the first of each of colour
}

TEST_F(EvaluateModel, ComparesSetsHoldsThemAgainstTheTruthAndRepeatsItsBytes) {
  write_spheres(path("clean"), 6, 3);
  write_spheres(path("noisy"), 6, 3, 0.3);
  const std::string arguments = path("noisy") + " --registered --name noisy --truth " + path("clean") +
                                " --samples 20 " + "--compare clean=" + path("clean") +
                                " --folds 3 --keep-reconstructions 1 -q -o ";
  ASSERT_EQ(run(arguments + path("a") + " -j 1").exit_code, 0);
  ASSERT_EQ(run(arguments + path("b") + " -j 3").exit_code, 0);
  EXPECT_EQ(read_file(path("a/evaluation.json")), read_file(path("b/evaluation.json")));
  EXPECT_EQ(read_mesh(path("a/reconstructions/p0.ply")).V.rows(), 162);
  const json e = evaluation("a");
  EXPECT_EQ(e["sets"][0]["folds"], 3);
  bool to_truth = false;
  for (const json& ratio : e["ratios"]) {
    EXPECT_EQ(ratio["to"], "clean");
    if (ratio["measure"] == "shape-vertices" && ratio["quantity"] == "generalisation") {
      EXPECT_GT(ratio["value"].back().get<double>(), 1);
    }
    to_truth = to_truth || ratio["measure"] == "shape-vertices-to-truth";
  }
  EXPECT_TRUE(to_truth);
}

TEST_F(EvaluateModel, ReadsABuildWithItsLevelsAndWhatWasSeen) {
  Random random(4);
  const MultiresTemplate reference = facewright::testing::grid_template(6);
  RegisteredSet set;
  set.shapes = Eigen::Map<const Eigen::RowVectorXd>(reference.V.data(), 108).replicate(5, 1);
  set.shapes += facewright::testing::random_matrix(random, 5, 108);
  save_model(path("m/model.h5"), build_model(set, reference).model);
  for (int i = 0; i < 5; ++i) {
    const std::string id = "p" + std::to_string(i);
    Mesh mesh{set.vertices(i), reference.levels.back().F, Colours::Constant(36, 3, 0.1 + 0.1 * i), {}, {}};
    if (i == 0) mesh.colours.row(7) << 1, 0, 0;  // not seen there: must not count
    write_ply(path("m/registered/" + id + ".ply"), mesh);
    std::string weights(36, '9');
    if (i == 0) weights[7] = '0';
    write_file(path("m/scans/" + id + ".colour"), weights);
  }
  ASSERT_EQ(run(path("m") + " --samples 10 -q -o " + path("fine")).exit_code, 0);
  const json set_json = evaluation("fine")["sets"][0];
  EXPECT_EQ(set_json["vertices"], 36);
  EXPECT_LT(set_json["generalisation"]["colour-vertices"]["value"][1].get<double>(), 0.01);
  const CommandResult r = run(path("m") + " --level 7 -o " + path("e"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("36"));
  for (const int plain : {4, 3, 2}) {  // scans without colours do not hide those of the others
    const std::string file = path("m/registered/p" + std::to_string(plain) + ".ply");
    Mesh mesh = read_mesh(file);
    mesh.colours.resize(0, 3);
    write_ply(file, mesh);
    ASSERT_EQ(run(path("m") + " --samples 10 -q -o " + path("mixed")).exit_code, 0) << plain;
    EXPECT_TRUE(evaluation("mixed")["sets"][0]["generalisation"].contains("colour-vertices")) << plain;
  }
  write_file(path("m/scans/p0.colour"), "99");
  EXPECT_THAT(run(path("m") + " -o " + path("e")).output, HasSubstr("p0.colour"));
}

TEST_F(EvaluateModel, SaysWhySetsAreNotComparable) {
  write_spheres(path("six"), 6, 2);
  write_spheres(path("five"), 5, 2);
  const CommandResult r = run(path("six") + " --compare five=" + path("five") + " --samples 5 -o " + path("e"));
  ASSERT_EQ(r.exit_code, 0) << r.output;
  EXPECT_THAT(r.output, HasSubstr("NOT COMPARABLE: scans: 5, of model 6"));
}

TEST_F(EvaluateModel, OneMeshIsEnoughForAnAnswer) {
  write_spheres(path("one"), 1, 2);
  const CommandResult r = run(path("one") + " --samples 5 -o " + path("e"));
  ASSERT_EQ(r.exit_code, 0) << r.output;
  EXPECT_TRUE(evaluation("e")["sets"][0]["generalisation"].is_null());
}

TEST_F(EvaluateModel, NamesTheFileThatDoesNotFit) {
  std::filesystem::create_directories(path("empty"));
  CommandResult r = run(path("empty") + " -o " + path("e"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, AllOf(HasSubstr("empty"), HasSubstr("no meshes")));
  EXPECT_FALSE(std::filesystem::exists(path("e/evaluation.json")));
  write_spheres(path("s"), 4, 2);
  write_ply(path("s/p2.ply"), icosphere(1, 80));
  r = run(path("s") + " -o " + path("e"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, AllOf(HasSubstr("p2.ply"), HasSubstr("42 vertices"), HasSubstr("162")));
  write_file(path("s/p2.ply"), "ply\nformat ascii 1.0\n");
  r = run(path("s") + " -o " + path("e"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("p2.ply"));
  write_spheres(path("s"), 4, 2);
  r = run(path("s") + " --truth " + path("empty") + " -o " + path("e"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("p0"));
  write_file(path("s/landmark_vertices.json"), "{\"1\": \"nose\"}");
  r = run(path("s") + " -o " + path("e"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("landmark_vertices.json"));
}

TEST_F(EvaluateModel, RefusesWrongUsage) {
  write_spheres(path("s"), 3, 1);
  for (const char* wrong :
       {" --folds 1", " --folds some", " --compare here", " --modes -3", " --alignment never", " --samples x"})
    EXPECT_EQ(run(path("s") + wrong + " -o " + path("e")).exit_code, 2) << wrong;
  EXPECT_EQ(run(path("nowhere") + " -o " + path("e")).exit_code, 2);
  const CommandResult r = run(path("s") + " --level 3448 -o " + path("e"));
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("model.h5"));
}

}  // namespace
}  // namespace facewright
