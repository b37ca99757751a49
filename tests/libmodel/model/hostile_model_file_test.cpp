// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "hdf5_edits.h"
#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/model/check_model.h"
#include "libmodel/model/model_file.h"
#include "tests/libmodel/interop/face_sheet.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// A good file, spoiled in one place: the message must name the file, the dataset and what was expected.
struct HostileModelFile : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / (std::string("facewright_hostile_model_") +
                                                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
  fs::path file = folder / "model.h5";
  std::string good = serialise_model(MorphableModel(testing::random_parts(21)));
  ~HostileModelFile() override { fs::remove_all(folder); }

  void refuses(const std::string& dataset, const std::string& what, const std::function<void()>& spoil) {
    write_file(file, good);
    spoil();
    EXPECT_THAT([&] { load_model(file); },
                ThrowsMessage<IoError>(AllOf(HasSubstr(file.string()), HasSubstr(dataset), HasSubstr(what))))
        << dataset;
  }
};

TEST_F(HostileModelFile, ANaNOrInfinityAnywhereIsRefusedByName) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const std::string part : {"/shape", "/color", "/expression"})
      for (const std::string set : {"/model/mean", "/model/pcaBasis", "/model/pcaVariance"})
        for (const double where : {0.0, 0.4, 1.0})
          refuses(part + set, set == "/model/pcaBasis" ? "column" : "NaN or infinity at entry", [&] {
            testing::edit_floats(file, part + set, [&](auto& v) {
              v[static_cast<size_t>(where * static_cast<double>(v.size() - 1))] = bad;
            });
          });
    for (const std::string set : {"uv", "blendshapes/displacements"})
      refuses("", "NaN or infinity",
              [&] { testing::edit_floats(file, "/metadata/ext/" + set, [&](auto& v) { v[v.size() / 2] = bad; }); });
  }
  refuses("/shape/model/mean", "NaN",
          [&] { testing::edit_floats(file, "/shape/model/mean", [](auto& v) { v.assign(v.size(), std::nan("")); }); });
}

TEST_F(HostileModelFile, LinksAndNumbersInOtherFilesAreFoundWhenItIsTried) {
  const auto refuses_to_try = [&](const std::string& what, const std::function<void(hid_t)>& spoil) {
    write_file(file, good);
    EXPECT_NO_THROW(try_model_file(file));
    testing::edit_file(file, spoil);
    EXPECT_THAT([&] { try_model_file(file); },
                ThrowsMessage<IoError>(AllOf(HasSubstr(file.string()), HasSubstr(what))));
  };
  write_file(folder / "other.h5", good);
  refuses_to_try("leads to another file", [](hid_t h5) {
    H5Lcreate_external("other.h5", "/shape", h5, "/shape/elsewhere", H5P_DEFAULT, H5P_DEFAULT);
  });
  refuses_to_try("keeps its numbers in another file", [&](hid_t h5) {
    const hsize_t n = 4;
    const hid_t space = H5Screate_simple(1, &n, nullptr), create = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(create, (folder / "other.h5").c_str(), 0, n * sizeof(float));
    H5Dclose(H5Dcreate2(h5, "/outside", H5T_IEEE_F32LE, space, H5P_DEFAULT, create, H5P_DEFAULT));
    H5Pclose(create), H5Sclose(space);
  });
}

// HDF5 1.10 crashes on some of these: that ends the copy of the process which tries them.
TEST_F(HostileModelFile, DamagedFilesAreTriedAndReadOrRefused) {
  Random random(5);
  int refused = 0;
  for (int trial = 0; trial < 150; ++trial) {
    std::string bad = good;
    for (int k = 1 + random.index(6); k > 0; --k)
      bad[static_cast<size_t>(random.index(static_cast<int>(bad.size())))] = static_cast<char>(random.index(256));
    write_file(file, bad);
    try {
      try_model_file(file);
      load_model(file);
    } catch (const IoError& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr(file.string()));
    }
  }
  EXPECT_GT(refused, 30);
}

TEST_F(HostileModelFile, StatisticsThatAreNoneAreRefused) {
  const std::string basis = "/shape/model/pcaBasis", variances = "/color/model/pcaVariance";
  refuses(basis, "orthonormal", [&] {
    testing::edit_floats(file, basis, [](auto& v) {
      for (double& x : v) x *= 1.01;
    });
  });
  refuses(basis, "orthonormal", [&] {  // a column twice
    testing::edit_floats(file, basis, [](auto& v) {
      for (size_t i = 0; i < v.size(); i += 5) v[i + 1] = v[i];
    });
  });
  refuses(basis, "orthonormal", [&] { testing::edit_floats(file, basis, [](auto& v) { v.assign(v.size(), 0); }); });
  refuses(variances, "descending",
          [&] { testing::edit_floats(file, variances, [](auto& v) { std::swap(v[1], v[2]); }); });
  refuses(variances, "descending", [&] { testing::edit_floats(file, variances, [](auto& v) { v[0] = -v[0]; }); });
}

TEST_F(HostileModelFile, IndicesOutOfRangeAreRefused) {
  for (const int bad : {-1, 40, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
    refuses("/shape/representer/cells", "at vertex " + std::to_string(bad),
            [&] { testing::edit_integers(file, "/shape/representer/cells", [&](auto& v) { v[7] = bad; }); });
    refuses("/level0/shape/representer/cells", "at vertex " + std::to_string(bad),
            [&] { testing::edit_integers(file, "/level0/shape/representer/cells", [&](auto& v) { v.back() = bad; }); });
    refuses("", "symmetry",
            [&] { testing::edit_integers(file, "/metadata/ext/mirror", [&](auto& v) { v[3] = bad; }); });
    refuses("", "parents",
            [&] { testing::edit_integers(file, "/metadata/ext/parents", [&](auto& v) { v[0] = bad; }); });
    refuses("", "base triangle", [&] {
      const std::vector<int> F = {0, 1, bad};
      testing::replace_dataset(file, "/level2/metadata/ext/base_faces", H5T_STD_I32LE, {1, 3}, H5T_NATIVE_INT,
                               F.data());
    });
    refuses("", "landmark '9'", [&] {
      testing::replace_string(file, "/metadata/ext/landmark_vertices", "{\"9\": " + std::to_string(bad) + "}");
    });
    refuses("", "region 'lips'", [&] {
      testing::replace_string(file, "/metadata/ext/regions", "{\"lips\": [1, " + std::to_string(bad) + "]}");
    });
  }
}

TEST_F(HostileModelFile, OtherVersionsUnitsAxesAndWindingAreRefusedWithACure) {
  const std::string ext = "/metadata/ext/";
  refuses(ext + "format", "Update Facewright",
          [&] { testing::replace_string(file, ext + "format", "facewright-model 4"); });
  refuses(ext + "format", "this version reads", [&] { testing::replace_string(file, ext + "format", ""); });
  refuses(ext + "length_unit", "expected 'mm'", [&] { testing::replace_string(file, ext + "length_unit", "m"); });
  refuses(ext + "axes", "expected '+x", [&] { testing::replace_string(file, ext + "axes", "z up"); });
  refuses("/shape/version", "readable are 0.8, 0.9",
          [&] { testing::edit_integers(file, "/shape/version/minorVersion", [](auto& v) { v[0] = 7; }); });
  refuses("/level1/shape/representer/cells", "opposite ways", [&] {
    testing::edit_integers(file, "/level1/shape/representer/cells", [](auto& v) { std::swap(v[2], v[2 + 18]); });
  });
  good = serialise_model(MorphableModel(testing::face_sheet_parts(3)));
  refuses("/shape/representer/cells", "clockwise", [&] {
    testing::edit_integers(file, "/shape/representer/cells", [](auto& v) {
      std::swap_ranges(v.begin(), v.begin() + static_cast<long>(v.size() / 3),
                       v.begin() + static_cast<long>(v.size() / 3));
    });
  });
}

TEST_F(HostileModelFile, MissingAndMisshapenDatasetsAreRefusedByName) {
  for (const std::string path : {"/shape/model/pcaBasis", "/shape/model/pcaVariance", "/shape/representer/cells",
                                 "/color/model/pcaVariance", "/level1/shape/model/mean"})
    refuses(path, "is missing", [&] { testing::replace_dataset(file, path); });
  const std::vector<float> zeros(1000, 0.f);
  const auto misshapen = [&](const std::string& path, const std::vector<hsize_t>& shape, const std::string& what) {
    refuses(path, what,
            [&] { testing::replace_dataset(file, path, H5T_IEEE_F32LE, shape, H5T_NATIVE_FLOAT, zeros.data()); });
  };
  misshapen("/shape/model/pcaBasis", {119, 5}, "expected 120 x 5");
  misshapen("/shape/model/pcaBasis", {120, 4}, "expected 120 x 5");
  misshapen("/shape/model/pcaBasis", {5, 4, 3}, "5 x 4 x 3");
  misshapen("/shape/model/mean", {10, 12}, "expected a vector");
  misshapen("/shape/model/mean", {121}, "three per vertex");
  misshapen("/color/model/pcaVariance", {4, 2}, "expected a vector");
  misshapen("/metadata/ext/uv", {40, 3}, "expected 2");
  misshapen("/metadata/ext/blendshapes/displacements", {2, 119}, "expected 2 x 120");
  misshapen("/levels", {3, 3}, "two columns");
}

TEST_F(HostileModelFile, IsRefusedWhereverItIsCutShort) {
  for (size_t length = 0; length < good.size(); length += 1 + good.size() / 211) {
    write_file(file, good.substr(0, length));
    EXPECT_THROW(load_model(file), IoError) << length << " of " << good.size();
    EXPECT_THROW(stored_levels(file), IoError) << length;
  }
  write_file(file, good.substr(0, good.size() - 1));
  EXPECT_THROW(load_model(file), IoError);
}

// Any byte may be anything: the file is read or refused, nothing else.
TEST_F(HostileModelFile, MangledBytesAreReadOrRefused) {
  Random random(22);
  int refused = 0;
  for (int trial = 0; trial < 120; ++trial) {
    std::string bytes = good;
    for (int k = 1 + random.index(8); k > 0; --k)
      bytes[static_cast<size_t>(random.index(static_cast<int>(bytes.size())))] = static_cast<char>(random.index(256));
    write_file(file, bytes);
    try {
      load_model(file);
      check_model_file(file);
    } catch (const IoError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace facewright
