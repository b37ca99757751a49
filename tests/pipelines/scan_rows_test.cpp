// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/scan_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;

// Eleven scans as the stages before leave them: the third and seventh could not be registered, the fifth was pruned.
class ScanTableTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 11; ++i) {
      const std::string id = std::string("p") + static_cast<char>('a' + i);
      ScanOutcome o;
      o.id = id;
      o.registered = i != 2 && i != 6;
      o.reason = o.registered ? "" : "no face in " + id;
      summary.scans.push_back(o);
      if (o.registered) leave_files(id, 0.1 * (1 + i));
    }
    stage.pruned["pe"] = "too far out";
    const auto kept = static_cast<Eigen::Index>(stage.scans.ids.size());
    stage.scans.shapes.resize(kept, 3 * model.vertex_count());
    for (Eigen::Index s = 0; s < kept; ++s) {
      const Vertices V = (1 + 0.02 * static_cast<double>(s)) * model.mean().V;
      stage.scans.shapes.row(s) = Eigen::Map<const Eigen::RowVectorXd>(V.data(), V.size());
    }
  }

  void leave_files(const std::string& id, double mean_mm) {
    const nlohmann::json report = {
        {"origins", {{"matched", 90}, {"mirrored", 6}, {"interpolated", 3}, {"free", 1}}},
        {"surface_mm", {{"mean", mean_mm}, {"p95", 2 * mean_mm}}},
        {"landmarks",
         {{"residual_mean_mm", 1.0}, {"residual_max_mm", 2.0}, {"rejected", nlohmann::json::array({"chin"})}}},
        {"folded_edges", {{"count", 0}}}};
    for (const auto& file : {tree.scan_report(id), tree.scan_picture(id), tree.error_picture(id)})
      std::filesystem::create_directories(file.parent_path());
    write_file(tree.scan_report(id), report.dump());
    Image image(64, 48, 3);
    for (size_t k = 0; k < image.data.size(); ++k) image.data[k] = static_cast<std::uint8_t>((7 * k) % 251);
    write_jpeg(tree.scan_picture(id), image, 85);
    write_png(tree.error_picture(id), image);
    if (id != "pe") stage.scans.ids.push_back(id);
  }

  ScanTable table(int threads, int most_pictures = 200) const {
    return scan_table(model, stage, summary, tree, threads, most_pictures);
  }

  TemporaryDirectory folder;
  OutputTree tree{folder.path()};
  MorphableModel model = toy_model(2);
  ModelStageResult stage;
  BuildPipelineSummary summary;
};

size_t count(const std::string& text, const std::string& what) {
  size_t n = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST_F(ScanTableTest, BytesDoNotDependOnThreads) {
  const std::string one = table(1).html;
  for (const int threads : {2, 3, 8}) EXPECT_EQ(table(threads).html, one) << threads << " threads";
}

TEST_F(ScanTableTest, LeftOutThenPrunedThenTheOthersInOrderOfId) {
  const std::string html = table(3).html;
  size_t last = 0;
  for (const char* id : {"pc", "pg", "pe", "pa", "pb", "pd", "pf", "ph", "pi", "pj", "pk"}) {
    const size_t at = html.find("data-value=\"" + std::string(id) + "\"");
    ASSERT_NE(at, std::string::npos) << id;
    EXPECT_GT(at, last) << id;
    last = at;
  }
  EXPECT_THAT(html, HasSubstr("left out: no face in pg"));
  EXPECT_THAT(html, HasSubstr("too far out\nlandmark chin was rejected"));
}

TEST_F(ScanTableTest, MedianIsOfTheRegisteredScansAlone) {
  EXPECT_NEAR(table(2).median_surface_mm, 0.6, 1e-12);  // 0.1 0.2 0.4 0.5 [0.6] 0.8 0.9 1.0 1.1: the middle of nine
  summary.scans.clear();
  EXPECT_EQ(table(2).median_surface_mm, 0);
}

TEST_F(ScanTableTest, PicturesBeyondTheLimitAreLinked) {
  // Three pictures a registered scan, of the pruned one two: it is no part of the model, and has no portrait.
  EXPECT_EQ(count(table(2).html, "<img"), 3u * 8 + 2);
  const std::string few = table(2, 4).html;
  EXPECT_EQ(count(few, "<img"), 3u * 3 + 2);
  EXPECT_EQ(count(few, ">picture</a>"), 2u * 5);
}

TEST_F(ScanTableTest, AReportThatIsGoneIsNamed) {
  std::filesystem::remove(tree.scan_report("pf"));
  try {
    table(4);
    FAIL() << "expected IoError";
  } catch (const IoError& e) {
    EXPECT_THAT(e.what(), HasSubstr("pf.json"));
  }
}

}  // namespace
}  // namespace facewright
