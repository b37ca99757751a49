// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Files as other programs write them, made here from one of ours by changing what they do otherwise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "hdf5_edits.h"
#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/hdf5_archive.h"
#include "libmodel/model/model_file.h"
#include "model_fixtures.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

struct StatismoDialects : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / (std::string("facewright_dialects_") +
                                                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
  fs::path file = folder / "model.h5";
  MorphableModelParts parts = testing::random_parts(31);
  ~StatismoDialects() override { fs::remove_all(folder); }

  // The model in the layout of the Basel Face Model, with nothing of ours.
  template <class Change>
  MorphableModel read(Change change) {
    Hdf5Writer h5;
    const auto statistics = [&](const std::string& at, const PcaModel& pca) {
      h5.vector(at + "/model/mean", pca.mean.cast<float>());
      h5.matrix(at + "/model/pcaBasis", RowMatrixXf(pca.basis.cast<float>()));
      h5.vector(at + "/model/pcaVariance", pca.variances.cast<float>());
      h5.matrix(at + "/representer/cells", RowMatrixXi(parts.levels.back().F.transpose()));
      h5.scalar(at + "/version/majorVersion", 0);
      h5.scalar(at + "/version/minorVersion", 9);
    };
    statistics("/shape", parts.shape);
    statistics("/color", parts.colour);
    statistics("/expression", *parts.expression);
    write_file(file, h5.bytes());
    change();
    return load_model(file);
  }
  void expect_same(const MorphableModel& model) const {
    for (const auto& [a, b] : {std::pair(parts.shape, model.shape()),
                               {parts.colour, model.colour()},
                               {*parts.expression, model.expression().value()}}) {
      EXPECT_LT((a.mean - b.mean).norm(), 1e-6 * a.mean.norm());
      EXPECT_LT((a.rescaled_basis() - b.rescaled_basis()).norm(), 1e-5 * a.rescaled_basis().norm());
      EXPECT_LT((a.basis - b.basis).norm(), 1e-5);
    }
    EXPECT_EQ(model.faces(), parts.levels.back().F);
  }
};

TEST_F(StatismoDialects, TheBaselFaceModelsLayout) {
  expect_same(read([] {}));
}

TEST_F(StatismoDialects, PartsWhereTheCatalogueSaysWithDoubleSlashes) {
  expect_same(read([&] {
    const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    H5Gclose(H5Gcreate2(h5, "/models", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    H5Lmove(h5, "/shape", h5, "/models/face", H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(h5);
    testing::replace_string(file, "/catalog/MorphableModel.shape/modelPath", "//models//face");
  }));
}

TEST_F(StatismoDialects, VersionsOfShapeOneOrAtTheRootAloneOrNowhere) {
  const int zero = 0, nine = 9;
  expect_same(read([&] {
    testing::replace_dataset(file, "/shape/version/majorVersion", H5T_STD_I32LE, {1}, H5T_NATIVE_INT, &zero);
    testing::replace_dataset(file, "/shape/version/minorVersion", H5T_STD_I32LE, {1}, H5T_NATIVE_INT, &nine);
  }));
  expect_same(read([&] {
    for (const char* part : {"/shape/version", "/color/version", "/expression/version"})
      testing::replace_dataset(file, part);
    testing::replace_dataset(file, "/version/majorVersion", H5T_STD_I32LE, {}, H5T_NATIVE_INT, &zero);
    testing::replace_dataset(file, "/version/minorVersion", H5T_STD_I32LE, {}, H5T_NATIVE_INT, &nine);
  }));
  expect_same(read([&] {  // the length of the columns tells
    for (const char* part : {"/shape/version", "/color/version", "/expression/version"})
      testing::replace_dataset(file, part);
  }));
}

TEST_F(StatismoDialects, Version08ScalesTheColumns) {
  MorphableModelParts as_given = parts;
  parts.shape.basis = parts.shape.rescaled_basis();
  const MorphableModel model =
      read([&] { testing::edit_integers(file, "/shape/version/minorVersion", [](auto& v) { v[0] = 8; }); });
  parts = as_given;
  expect_same(model);
}

TEST_F(StatismoDialects, Float64AndUnsignedCells) {
  const RowMatrixXd basis = parts.shape.basis;
  const RowMatrixXi cells = parts.levels.back().F.transpose();
  const MorphableModel model = read([&] {
    testing::replace_dataset(file, "/shape/model/pcaBasis", H5T_IEEE_F64LE, {120, 5}, H5T_NATIVE_DOUBLE, basis.data());
    testing::replace_dataset(file, "/shape/representer/cells", H5T_STD_U32LE, {3, 38}, H5T_NATIVE_INT, cells.data());
  });
  expect_same(model);
  EXPECT_EQ(model.shape().basis, parts.shape.basis) << "nothing is rounded";
}

TEST_F(StatismoDialects, BigEndianAndCompressedNumbers) {
  const RowMatrixXf basis = parts.shape.basis.cast<float>();
  expect_same(read([&] {
    testing::replace_dataset(file, "/shape/model/pcaBasis", H5T_IEEE_F32BE, {120, 5}, H5T_NATIVE_FLOAT, basis.data());
  }));
}

TEST_F(StatismoDialects, TheOlderRepresenter) {
  const RowMatrixXi triangles = parts.levels.back().F;
  const RowMatrixXf points = as_vertices(parts.shape.mean).cast<float>();
  expect_same(read([&] {
    const std::string mesh = "/shape/representer/reference-mesh";
    testing::replace_dataset(file, "/shape/representer/cells");
    testing::replace_dataset(file, mesh + "/triangle-list", H5T_STD_I32LE, {38, 3}, H5T_NATIVE_INT, triangles.data());
    testing::replace_dataset(file, mesh + "/vertex-coordinates", H5T_IEEE_F32LE, {40, 3}, H5T_NATIVE_FLOAT,
                             points.data());
  }));
}

TEST_F(StatismoDialects, AMeshAsVtkFileIsRefusedWithACure) {
  const char blob[] = "# vtk DataFile Version 3.0";
  EXPECT_THAT(
      [&] {
        read([&] {
          testing::replace_dataset(file, "/shape/representer/cells");
          testing::replace_dataset(file, "/shape/representer/reference", H5T_STD_I8LE, {sizeof blob}, H5T_NATIVE_CHAR,
                                   blob);
        });
      },
      ::testing::ThrowsMessage<IoError>(::testing::HasSubstr("save it again")));
}

TEST_F(StatismoDialects, PartsAreOptional) {
  const MorphableModel no_colour = read([&] { testing::replace_dataset(file, "/color"); });
  EXPECT_FALSE(no_colour.has_colour());
  EXPECT_TRUE(no_colour.expression());
  const MorphableModel no_expression = read([&] { testing::replace_dataset(file, "/expression"); });
  EXPECT_TRUE(no_expression.has_colour());
  EXPECT_FALSE(no_expression.expression());
}

TEST_F(StatismoDialects, LandmarksAsTextOrAsJsonOfShapeOne) {
  const auto place = [&](int v) {
    std::string text;
    for (int k = 0; k < 3; ++k) text += " " + std::to_string(parts.shape.mean[3 * v + k]);
    return text;
  };
  const MorphableModel model = read([&] {
    testing::replace_string(file, "/metadata/landmarks/text",
                            "tip 1" + place(7) + "\r\nhidden 0 1 2 3\n\nchin 1" + place(11) + "\n");
  });
  EXPECT_EQ(model.landmarks().at("tip").vertex, 7);
  EXPECT_EQ(model.landmarks().at("chin").vertex, 11);
  EXPECT_EQ(model.landmarks().size(), 2u) << "an invisible one is none";
  EXPECT_THAT([&] { read([&] { testing::replace_string(file, "/metadata/landmarks/text", "tip 1 2 x 3\n"); }); },
              ::testing::ThrowsMessage<IoError>(::testing::HasSubstr("line 1")));
}

TEST_F(StatismoDialects, LengthsInMetresBecomeMillimetres) {
  const float metre = 1, millimetre = 0.001f;
  const auto with_unit = [&](const float& unit) {
    return read([&] {
      testing::replace_dataset(file, "/shape/representer/length-unit", H5T_IEEE_F32LE, {}, H5T_NATIVE_FLOAT, &unit);
    });
  };
  expect_same(with_unit(millimetre));
  const MorphableModel model = with_unit(metre);
  EXPECT_LT((model.shape().mean - 1000 * parts.shape.mean).norm(), 1e-3 * parts.shape.mean.norm());
  EXPECT_NEAR(model.shape().variances[0] / parts.shape.variances[0], 1e6, 1);
  EXPECT_NEAR(model.colour().variances[0] / parts.colour.variances[0], 1, 1e-6) << "colours have no length";
  EXPECT_THROW(with_unit(-1.f), IoError);
}

// {"datasets": {ID: {"alias": [PATH], "type", "shape", "value"}}}, values in nested lists.
struct Hdf5Json {
  std::string datasets;
  void add(const std::string& path, const std::string& kind, const std::string& shape, const std::string& value) {
    datasets += (datasets.empty() ? "" : ",") + ("\"id" + std::to_string(datasets.size()) + "\":{\"alias\":[\"") +
                path + "\"],\"type\":{\"class\":\"" + kind + "\"},\"shape\":" + shape + ",\"value\":" + value + "}";
  }
  template <class Matrix>
  void numbers(const std::string& path, const std::string& kind, const Matrix& m) {
    std::ostringstream dims, list;
    list.precision(17);
    const bool vector = m.cols() == 1;
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      list << (i ? "," : "[") << (vector ? "" : "[");
      for (Eigen::Index k = 0; k < m.cols(); ++k) list << (k ? "," : "") << m(i, k);
      list << (vector ? "" : "]");
    }
    dims << R"({"class":"H5S_SIMPLE","dims":[)" << m.rows();
    if (!vector) dims << "," << m.cols();
    dims << "]}";
    add(path, kind, dims.str(), list.str() + "]");
  }
  std::string text() const { return R"({"apiVersion":"1.1.1","root":"r","groups":{},"datasets":{)" + datasets + "}}"; }
};

TEST_F(StatismoDialects, Hdf5AsJsonIsToldByItsFirstByte) {
  Hdf5Json json;
  for (const auto& [name, pca] :
       {std::pair("/shape", parts.shape), {"/color", parts.colour}, {"/expression", *parts.expression}}) {
    const std::string at = name;
    json.numbers(at + "/model/mean", "H5T_FLOAT", pca.mean);
    json.numbers(at + "/model/pcaBasis", "H5T_FLOAT", pca.basis);
    json.numbers(at + "/model/pcaVariance", "H5T_FLOAT", pca.variances);
    json.add(at + "/version/majorVersion", "H5T_INTEGER", R"({"class":"H5S_SCALAR"})", "0");
    json.add(at + "/version/minorVersion", "H5T_INTEGER", R"({"class":"H5S_SCALAR"})", "9");
  }
  json.numbers("/shape/representer/cells", "H5T_INTEGER", parts.levels.back().F.transpose().eval());
  json.add("/metadata/landmarks/json", "H5T_STRING", R"({"class":"H5S_SCALAR"})",
           R"("[{\"id\":\"a\",\"coordinates\":[)" + std::to_string(parts.shape.mean[0]) + "," +
               std::to_string(parts.shape.mean[1]) + "," + std::to_string(parts.shape.mean[2]) + R"(]}]")");
  const fs::path path = folder / "model.h5.json";
  write_file(path, json.text());
  const MorphableModel model = load_model(path);
  expect_same(model);
  EXPECT_EQ(model.landmarks().at("a").vertex, 0);
  const auto refuses = [&](const std::string& text) {
    write_file(path, text);
    EXPECT_THROW(load_model(path), IoError) << text.substr(0, 60);
  };
  const std::string good = json.text();
  for (size_t length = 1; length < good.size(); length += 1 + good.size() / 23) refuses(good.substr(0, length));
  refuses("{}");
  refuses(R"({"datasets": 3})");
  refuses(R"({"datasets": {"a": {}}})");
  Hdf5Json wrong = json;
  wrong.add("/shape", "H5T_FLOAT", R"({"class":"H5S_SCALAR"})", "1");
  refuses(wrong.text());
  wrong = {};
  wrong.add("/shape/model/mean", "H5T_FLOAT", R"({"class":"H5S_SIMPLE","dims":[5]})", "[1,2,3]");
  refuses(wrong.text());
  constexpr size_t kDeep = 1'000'000;  // lists in lists
  wrong = {};
  wrong.add("/shape/model/mean", "H5T_FLOAT", R"({"class":"H5S_SCALAR"})",
            std::string(kDeep, '[') + "1" + std::string(kDeep, ']'));
  refuses(wrong.text());
}

}  // namespace
}  // namespace facewright
