// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hdf5_edits.h"
#include "libmodel/core/errors.h"
#include "libmodel/model/check_model.h"
#include "libmodel/model/model_file.h"
#include "model_fixtures.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

struct ModelLevels : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / (std::string("facewright_model_levels_") +
                                                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
  fs::path file = folder / "model.h5";
  ModelLevels() { save_model(file, MorphableModel(testing::random_parts(41))); }
  ~ModelLevels() override { fs::remove_all(folder); }
};

TEST_F(ModelLevels, CoarseGroupsHoldAnOrthonormalBasisAndTheWayToTheSharedOne) {
  const MorphableModel model = load_model(file);
  for (int l = 0; l < 2; ++l)
    for (const auto& [part, shared] :
         {std::pair("shape", model.shape()), {"color", model.colour()}, {"expression", model.expression().value()}}) {
      const auto own = stored_statistics(file, "/level" + std::to_string(l), part);
      ASSERT_TRUE(own.has_value()) << part;
      const Eigen::Index k = own->model.mode_count(), n = 3 * model.vertex_count(l);
      EXPECT_EQ(k, shared.mode_count());
      EXPECT_LT((own->model.basis.transpose() * own->model.basis - Eigen::MatrixXd::Identity(k, k)).norm(), 1e-5);
      EXPECT_LT((own->own_from_shared * own->own_from_shared.transpose() - Eigen::MatrixXd::Identity(k, k)).norm(),
                1e-14);
      const Eigen::MatrixXd W = shared.rescaled_basis().topRows(n);
      EXPECT_LT((own->model.rescaled_basis() * own->own_from_shared - W).norm(), 1e-6 * W.norm());
    }
  EXPECT_FALSE(stored_statistics(file, "/level2", "shape").has_value()) << "the finest level's are the shared ones";
}

TEST_F(ModelLevels, LoadAsRowsOfTheFinestBitByBit) {
  const MorphableModel model = load_model(file);
  for (int l = 0; l < 3; ++l) {
    const MorphableModel level = load_model(file, "level" + std::to_string(l) + "/"), cut = model.level(l);
    EXPECT_EQ(level.shape().basis, cut.shape().basis);
    EXPECT_EQ(level.shape().variances, cut.shape().variances);
    EXPECT_EQ(level.shape().orthonormal, l == 2);
    EXPECT_EQ(level.colour().basis, cut.colour().basis);
    EXPECT_EQ(level.expression()->basis, cut.expression()->basis);
    ASSERT_EQ(level.blendshapes().size(), 2u);
    EXPECT_EQ(level.blendshapes()[1].name, "smile");
    EXPECT_EQ(level.blendshapes()[1].displacement, cut.blendshapes()[1].displacement);
  }
}

// As when somebody copies /level0 into a file of its own.
TEST_F(ModelLevels, ALevelOnItsOwnHasItsOwnBasis) {
  for (const char* path : {"/shape", "/color", "/expression", "/levels"}) testing::replace_dataset(file, path);
  const MorphableModel level = load_model(file, "/level0");
  EXPECT_TRUE(level.shape().orthonormal);
  EXPECT_EQ(level.shape().basis, stored_statistics(file, "/level0", "shape")->model.basis);
}

TEST_F(ModelLevels, TheCheckFindsAnOwnBasisThatIsNotTheSharedOne) {
  const auto fails = [&] {
    std::vector<std::string> failed;
    for (const ModelCheck& check : check_model_file(file))
      if (!check.holds) failed.push_back(check.property);
    return failed;
  };
  EXPECT_TRUE(fails().empty());
  testing::edit_floats(file, "/level0/metadata/ext/shared_from_own/shape", [](auto& v) {
    for (double& x : v) x = -x;
  });
  EXPECT_EQ(fails(), std::vector<std::string>{"level0 own shape basis is the shared one in other coefficients"});
}

// What version 2 files hold, and `export-model --basis shared`.
TEST_F(ModelLevels, RowsThatWereCutOffMayBeStoredAsTheyAre) {
  const MorphableModel level = load_model(file, "/level1");
  save_model(folder / "cut.h5", level);
  const MorphableModel back = load_model(folder / "cut.h5");
  EXPECT_FALSE(back.shape().orthonormal);
  EXPECT_EQ(back.shape().basis, level.shape().basis);
  testing::replace_string(folder / "cut.h5", "/metadata/ext/format", "facewright-model 2");
  EXPECT_EQ(load_model(folder / "cut.h5").shape().basis, level.shape().basis);
}

}  // namespace
}  // namespace facewright
