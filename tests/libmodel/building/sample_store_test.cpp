// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/sample_store.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "libmodel/building/gram.h"
#include "libmodel/building/pca_out_of_core.h"
#include "libmodel/core/errors.h"
#include "planted.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using testing::random_motion;

std::vector<std::string> names(int first, int last) {
  std::vector<std::string> ids;
  for (int i = first; i < last; ++i) ids.push_back("scan " + std::to_string(i));
  return ids;
}

struct Planted : ::testing::Test {
  Planted() : planted(testing::planted_gaussian(random, 60, 900, 12)), folder(directory.path() / "store") {
    planted.samples = planted.samples.cast<float>().cast<double>();  // what a file of floats about 0 keeps exactly
  }
  SampleStore filled(int count) {
    SampleStore store = SampleStore::create(folder, Eigen::RowVectorXd::Zero(900));
    store.append(names(0, count), planted.samples.topRows(count));
    return store;
  }
  Random random{1};
  testing::PlantedGaussian planted;
  TemporaryDirectory directory;
  std::filesystem::path folder;
};

using SampleStoreTest = Planted;

TEST_F(SampleStoreTest, ReturnsWhatWasAppendedAfterReopening) {
  const Similarity motion = random_motion(random);
  {
    SampleStore store = filled(10);
    store.append({"the last one"}, planted.samples.row(10), {motion});
  }
  const SampleStore store = SampleStore::open(folder);
  ASSERT_EQ(store.sample_count(), 11);
  EXPECT_EQ(store.cols(), 900);
  EXPECT_EQ(store.ids()[10], "the last one");
  for (int i = 0; i < 11; ++i) EXPECT_EQ(store.sample(i), planted.samples.row(i));
  EXPECT_EQ(store.centred_block(3, 4, 700, 200), planted.samples.block(3, 700, 4, 200));
  EXPECT_EQ(store.mean_from_scan(10).R, motion.R);
  EXPECT_EQ(store.mean_from_scan(10).t, motion.t);
  EXPECT_LT((store.mean() - planted.samples.topRows(11).colwise().mean()).norm(), 1e-9);
}

TEST_F(SampleStoreTest, KeptProductsAreTheGramMatrixHoweverTheSamplesCameAndWent) {
  SampleStore store = filled(20);
  store.gram();
  store.append(names(20, 50), planted.samples.middleRows(20, 30));
  store.remove({"scan 3", "scan 33"});
  store.gram();
  store.append(names(50, 60), planted.samples.middleRows(50, 10));
  std::vector<int> kept;
  for (int i = 0; i < 60; ++i)
    if (i != 3 && i != 33) kept.push_back(i);
  const SampleMatrix samples = planted.samples(kept, Eigen::all);
  const Eigen::MatrixXd expected = gram_matrix(samples, Eigen::RowVectorXd::Zero(900));
  EXPECT_LT((store.gram() - expected).norm(), 1e-13 * expected.norm());
  const Eigen::MatrixXd before = store.gram();
  SampleStore afresh = SampleStore::create(directory.path() / "afresh", Eigen::RowVectorXd::Zero(900));
  afresh.append(names(0, 58), samples);
  EXPECT_EQ(afresh.gram(), before);  // to the byte
  store.rewrite();
  EXPECT_EQ(store.gram(), before);
  EXPECT_EQ(store.sample(3), planted.samples.row(4));
  store.append({"scan 3"}, planted.samples.row(3));  // free again
  EXPECT_EQ(store.gram().topLeftCorner(58, 58), before);
}

TEST_F(SampleStoreTest, ProductsOfManySamplesDoNotDependOnThreads) {
  const auto many = testing::planted_gaussian(random, 1300, 90, 10);
  const auto gram_by = [&](int threads) {
    SampleStore store = SampleStore::create(directory.path() / std::to_string(threads), many.mean);
    store.append(names(0, 1300), many.samples);
    return store.gram(threads);
  };
  const Eigen::MatrixXd G = gram_by(1), expected = gram_matrix(many.samples, many.mean);
  EXPECT_EQ(G, gram_by(4));
  EXPECT_LT((G - expected).norm(), 1e-6 * expected.norm());  // rows are float32
}

TEST_F(SampleStoreTest, PcaOnDiskIsThatInMemory) {
  SampleStore store = filled(60);
  for (const PcaSolver solver : {PcaSolver::gram, PcaSolver::lanczos, PcaSolver::randomised}) {
    PcaOptions options;
    options.solver = solver;
    const PcaResult memory = fit_pca(planted.samples, options), disk = fit_pca(store, options);
    ASSERT_EQ(disk.model.mode_count(), memory.model.mode_count());
    EXPECT_LT((disk.model.mean - memory.model.mean).norm(), 1e-9);
    EXPECT_LT((disk.model.basis - memory.model.basis).norm(), 1e-8);
    EXPECT_LT((disk.model.variances - memory.model.variances).norm(), 1e-9 * memory.model.variances[0]);
    EXPECT_LT((disk.scores - memory.scores).norm(), 1e-7);
    EXPECT_NEAR(disk.summary.total_variance / memory.summary.total_variance, 1, 1e-10);
  }
  store.remove(names(1, 60));
  EXPECT_EQ(fit_pca(store).model.mode_count(), 0);
  EXPECT_EQ(fit_pca(store).model.mean.transpose(), planted.samples.row(0));
  store.remove({"scan 0"});
  EXPECT_THROW(fit_pca(store), InvalidInput);
}

TEST_F(SampleStoreTest, AddingAScanIsTheModelOfAllOfThem) {
  SampleStore store = filled(59);
  fit_pca(store);
  store.append({"one more"}, planted.samples.row(59));
  EXPECT_LT((fit_pca(store).model.basis - fit_pca(planted.samples).model.basis).norm(), 1e-8);
}

TEST_F(SampleStoreTest, AddedScansAreMovedToTheMeanAndRealigningIsProcrustes) {
  const MultiresTemplate t = testing::grid_template(9);
  const Eigen::VectorXd weights = Eigen::VectorXd::LinSpaced(81, 0.5, 2);
  const Eigen::RowVectorXd origin = Eigen::Map<const Eigen::RowVectorXd>(t.V.data(), t.V.size());
  SampleStore store = SampleStore::create(folder, origin);
  SampleMatrix scans(8, t.V.size());
  for (int i = 0; i < 8; ++i) {
    const Vertices face = t.V + 0.5 * testing::random_matrix(random, 81, 3);
    const Vertices scan = random_motion(random).apply(face);
    scans.row(i) = Eigen::Map<const Eigen::RowVectorXd>(scan.data(), scan.size());
    const Similarity moved = append_aligned(store, std::to_string(i), scan, weights);
    EXPECT_LT((moved.apply(scan) - t.V).rowwise().norm().maxCoeff(), 5);
    EXPECT_EQ(store.mean_from_scan(i).R, moved.R);
  }
  for (const Scaling scaling : {Scaling::fixed, Scaling::free}) {
    const ProcrustesOptions options{.scaling = scaling};
    const ProcrustesSummary summary = realign(store, weights, t.V, options);
    const ProcrustesResult expected = generalised_procrustes(scans, weights, t.V, options);
    EXPECT_TRUE(summary.converged);
    EXPECT_NEAR(summary.rms, expected.summary.rms, 1e-5);
    for (int i = 0; i < 8; ++i) {
      EXPECT_LT((store.sample(i) - expected.shapes.row(i)).cwiseAbs().maxCoeff(), 1e-5);
      EXPECT_NEAR(store.mean_from_scan(i).s, expected.mean_from_scans[static_cast<size_t>(i)].s, 1e-6);
    }
  }
}

TEST_F(SampleStoreTest, RefusesSamplesThatDoNotFit) {
  SampleStore store = filled(3);
  EXPECT_THROW(store.append({"scan 1"}, planted.samples.row(0)), InvalidInput);
  EXPECT_THROW(store.append({"a", "a"}, planted.samples.topRows(2)), InvalidInput);
  EXPECT_THROW(store.append({"a\nb"}, planted.samples.row(0)), InvalidInput);
  EXPECT_THROW(store.append({"a"}, planted.samples.topLeftCorner(1, 3)), InvalidInput);
  EXPECT_THROW(store.append({"a"}, SampleMatrix::Constant(1, 900, std::nan(""))), InvalidInput);
  EXPECT_THROW(store.remove({"scan 9"}), InvalidInput);
  EXPECT_EQ(store.sample_count(), 3);
}

TEST_F(SampleStoreTest, RefusesWhatIsMissingInUseOrDamaged) {
  EXPECT_THROW(SampleStore::open(folder), IoError);
  {
    SampleStore store = filled(5);
    store.gram();
    EXPECT_THROW(SampleStore::open(folder), IoError);
  }
  EXPECT_THROW(SampleStore::create(folder, Eigen::RowVectorXd::Zero(900)), IoError);
  std::string index;
  {
    std::ifstream in(folder / "index.txt");
    index.assign(std::istreambuf_iterator<char>(in), {});
  }
  const auto with_index = [&](const std::string& text) {
    std::ofstream(folder / "index.txt") << text;
    return SampleStore::open(folder).sample_count();
  };
  for (size_t cut = 0; cut < index.size() - 1; cut += 37)
    EXPECT_THROW(with_index(index.substr(0, cut)), IoError) << cut;
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{{"samples 1", "samples 2"},
                                                                                 {"cols 900", "cols 901"},
                                                                                 {"slots 5", "slots 6"},
                                                                                 {"product_rows 5", "product_rows 9"},
                                                                                 {"scan 3", "scan 1"},
                                                                                 {"\n2 ", "\n0 "},
                                                                                 {"\n2 ", "\n2x"}}) {
    std::string damaged = index;
    damaged.replace(damaged.find(from), from.size(), to);
    EXPECT_THROW(with_index(damaged), IoError) << to;
  }
  EXPECT_EQ(with_index(index), 5);
  std::filesystem::resize_file(folder / "rows-0.bin", 9000);
  EXPECT_THROW(with_index(index), IoError);
}

}  // namespace
}  // namespace facewright
