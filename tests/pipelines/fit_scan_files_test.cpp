// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/fit_images/fit_scan_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
#include "tests/libmodel/fitting/toy_model.h"
#include "tests/support/matchers.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const Similarity place{1, rotation({0.3, -0.2, 0.1}), {30, -40, 90}};

class FitScanFilesTest : public ::testing::Test {
 protected:
  FitScanFilesTest() {
    Random random(3);
    truth_ = model_.shape().draw_coefficients(random);
    write_scan(1);
    save_model(folder_ / "model.h5", model_);
  }

  // face.ply and face.json, `unit` millimetres to a unit.
  void write_scan(double unit) {
    Mesh scan = model_.instance(truth_);
    scan.V = place.apply(scan.V) / unit;
    write_ply(folder_ / "face.ply", scan);
    Landmarks marks;
    for (const char* name : {"9", "28", "31", "37", "46", "49", "55"})
      marks[name].position = scan.V.row(model_.landmarks().at(name).vertex).transpose();
    write_landmarks(folder_ / "face.json", marks);
  }

  FitScanFilesOptions options() {
    FitScanFilesOptions o;
    o.model = folder_ / "model.h5";
    o.scan = folder_ / "face.ply";
    o.output = folder_ / "out";
    return o;
  }

  // Mean distance of the fitted face from the truth, mm.
  double error(const std::string& name = "face.ply") {
    return (read_mesh(folder_ / "out" / name).V - place.apply(model_.instance(truth_).V)).rowwise().norm().mean();
  }

  int files() {
    return fs::exists(folder_ / "out") ? static_cast<int>(std::distance(fs::directory_iterator(folder_ / "out"), {}))
                                       : 0;
  }

  TemporaryDirectory folder_;
  MorphableModel model_ = toy_model();
  Eigen::VectorXd truth_;
};

TEST_F(FitScanFilesTest, WritesTheFaceInTheScansFrameWithItsFigures) {
  const FitScanFilesSummary summary = fit_scan_files(options());
  EXPECT_EQ(summary.stem, "face");
  EXPECT_LT(error(), 0.5);  // the deviations take the scan for a noisy one
  const auto json = nlohmann::json::parse(read_file(folder_ / "out/face.json"));
  EXPECT_EQ(json["shape_coefficients"].size(), static_cast<size_t>(model_.shape().mode_count()));
  EXPECT_EQ(json["shape_stddevs"].size(), json["shape_coefficients"].size());
  EXPECT_EQ(json["landmark_residuals"].size(), 7u);
  EXPECT_EQ(json["mm_per_unit"], 1);
  const std::string csv = read_file(folder_ / "out/face_distances.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), model_.vertex_count() + 1);
  EXPECT_TRUE(fs::exists(folder_ / "out/face_error.png"));
  EXPECT_FALSE(fs::exists(folder_ / "out/face_refined.ply"));
}

TEST_F(FitScanFilesTest, UnitsAreFoundAndResultsAreMillimetres) {
  for (const double unit : {10.0, 1000.0}) {
    write_scan(unit);
    EXPECT_EQ(fit_scan_files(options()).mm_per_unit, unit);
    EXPECT_LT(error(), 0.5);
    FitScanFilesOptions stated = options();
    stated.mm_per_unit = unit;
    EXPECT_EQ(fit_scan_files(stated).units_reason, "as stated");
    stated.mm_per_unit = 1;
    EXPECT_THAT([&] { fit_scan_files(stated); }, ThrowsMessage<InvalidInput>(HasSubstr("--units")));
    EXPECT_EQ(files(), 0);
  }
  write_scan(25.4);
  EXPECT_THAT([&] { fit_scan_files(options()); }, ThrowsMessage<InvalidInput>(HasSubstr("neither mm, cm nor m")));
}

TEST_F(FitScanFilesTest, LandmarksAloneAreEnough) {
  FitScanFilesOptions o = options();
  o.scan.clear();
  o.landmarks = folder_ / "face.json";
  const FitScanFilesSummary summary = fit_scan_files(o);
  EXPECT_TRUE(summary.points);
  EXPECT_LT(summary.landmark_rms_mm, 1);
  EXPECT_TRUE(fs::exists(folder_ / "out/face.ply"));
  EXPECT_FALSE(fs::exists(folder_ / "out/face_error.png"));
}

TEST_F(FitScanFilesTest, RefinementIsAResultOfItsOwn) {
  fit_scan_files(options());
  const std::string plain = read_file(folder_ / "out/face.ply");
  FitScanFilesOptions o = options();
  o.refine = true;
  const FitScanFilesSummary summary = fit_scan_files(o);
  EXPECT_EQ(read_file(folder_ / "out/face.ply"), plain);
  EXPECT_TRUE(fs::exists(folder_ / "out/face_refined_error.png"));
  EXPECT_LT(summary.refined->summary.median_mm, summary.scan->summary.median_mm);
  fit_scan_files(options());
  EXPECT_FALSE(fs::exists(folder_ / "out/face_refined.ply"));  // of an earlier run
}

TEST_F(FitScanFilesTest, ErrorsNameTheFileAndLeaveNothing) {
  fit_scan_files(options());
  const auto fails_with = [&](const FitScanFilesOptions& o, const char* words) {
    EXPECT_THAT([&] { fit_scan_files(o); }, ThrowsMessage<std::exception>(HasSubstr(words)));
  };
  write_file(folder_ / "face.json", R"({"9": [1, 2, 3], "28": [1, 2, 4]})");
  fails_with(options(), "face.json");
  EXPECT_EQ(files(), 0);
  fs::remove(folder_ / "face.json");
  fails_with(options(), "--landmarks");
  write_scan(1);
  write_file(folder_ / "face.ply", "no mesh");
  fails_with(options(), "face.ply");
  write_scan(1);
  FitScanFilesOptions o = options();
  o.output = folder_.path();
  fails_with(o, "overwrite");
  o = options();
  o.fit.level = 5;
  fails_with(o, "level");
  o = options();
  o.scan.clear();
  o.landmarks = folder_ / "face.json";
  o.refine = true;
  fails_with(o, "refine");
}

TEST_F(FitScanFilesTest, ModelsWithoutColourAndTextureCoordinatesAreEnough) {
  MorphableModelParts parts = model_.parts();
  parts.uv.resize(0, 2);
  parts.colour = {};
  save_model(folder_ / "model.h5", MorphableModel(parts));
  fit_scan_files(options());
  EXPECT_LT(error(), 0.5);
}

TEST_F(FitScanFilesTest, BytesDoNotDependOnThreads) {
  FitScanFilesOptions o = options();
  o.refine = true;
  o.fit.threads = o.refinement.threads = 1;
  fit_scan_files(o);
  o.fit.threads = o.refinement.threads = 3;
  o.output = folder_ / "out3";
  fit_scan_files(o);
  for (const auto& entry : fs::directory_iterator(folder_ / "out"))
    EXPECT_EQ(read_file(entry.path()), read_file(folder_ / "out3" / entry.path().filename())) << entry.path();
}

}  // namespace
}  // namespace facewright
