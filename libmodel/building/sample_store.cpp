// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/sample_store.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <utility>

#include "libmodel/building/column_blocks.h"
#include "libmodel/building/inner_products.h"
#include "libmodel/building/sample_file.h"
#include "libmodel/building/sample_index.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"

namespace facewright {
namespace {

constexpr Eigen::Index kGramRows = 1024;  // new rows whose products are computed and written together
constexpr Eigen::Index kOtherRows = 256;  // rows they are multiplied with in one task
constexpr Eigen::Index kGramColumns = 1024;
constexpr char kRowsMagic[16] = "FACEWRIGHT ROWS";  // then the number of columns, 8 bytes; the origin; the rows
constexpr std::uint64_t kRowsHeader = 24;

std::string rows_name(int generation) { return "rows-" + std::to_string(generation) + ".bin"; }
std::string products_name(int generation) { return "products-" + std::to_string(generation) + ".bin"; }

// The lower triangle of the products, row by row.
std::uint64_t products_offset(Eigen::Index slot) {
  return static_cast<std::uint64_t>(slot) * static_cast<std::uint64_t>(slot + 1) / 2 * sizeof(double);
}

}  // namespace

struct SampleStore::Files {
  std::filesystem::path folder;
  Eigen::RowVectorXd origin;
  SampleIndex index;
  std::vector<std::string> ids;
  SampleFile lock, rows, products;

  std::uint64_t row_offset(Eigen::Index slot) const {
    return kRowsHeader + static_cast<std::uint64_t>(origin.size()) * (8 + 4 * static_cast<std::uint64_t>(slot));
  }

  void take_lock() {
    lock = SampleFile(folder / "lock", SampleFile::Mode::create);
    if (!lock.lock_alone()) throw IoError(folder.string(), "is in use by another program");
  }

  void create_data(int generation) {
    index.generation = generation;
    rows = SampleFile(folder / rows_name(generation), SampleFile::Mode::create);
    const std::uint64_t cols = static_cast<std::uint64_t>(origin.size());
    rows.write(kRowsMagic, 16, 0);
    rows.write(&cols, 8, 16);
    rows.write(origin.data(), 8 * cols, kRowsHeader);
    products = SampleFile(folder / products_name(generation), SampleFile::Mode::create);
  }

  void open_data() {
    rows = SampleFile(folder / rows_name(index.generation), SampleFile::Mode::read_write);
    products = SampleFile(folder / products_name(index.generation), SampleFile::Mode::read_write);
    char magic[16];
    std::uint64_t cols = 0;
    rows.read(magic, 16, 0);
    rows.read(&cols, 8, 16);
    if (std::memcmp(magic, kRowsMagic, 16) != 0) throw IoError(rows.path(), "is no file of samples");
    if (cols != static_cast<std::uint64_t>(index.cols))
      throw IoError(rows.path(),
                    "has " + std::to_string(cols) + " columns, the index says " + std::to_string(index.cols));
    origin.resize(index.cols);
    rows.read(origin.data(), 8 * cols, kRowsHeader);
    if (!origin.allFinite()) throw IoError(rows.path(), "holds NaN or infinity");
    if (rows.size() < row_offset(index.slots) || products.size() < products_offset(index.product_rows))
      throw IoError(folder.string(), "holds less than its index says: truncated?");
  }

  void commit() {
    replace_file(folder / "index.txt", to_text(index));
    ids.clear();
    for (const IndexedSample& sample : index.samples) ids.push_back(sample.id);
  }

  void read_floats(Eigen::Index slot, Eigen::Index col, Eigen::Index cols, float* values) const {
    rows.read(values, 4 * static_cast<std::uint64_t>(cols), row_offset(slot) + 4 * static_cast<std::uint64_t>(col));
  }

  // Products of the slots [first, last) with all before them and each other, appended.
  void extend_products(Eigen::Index first, Eigen::Index last, int threads) {
    SampleMatrix sums = SampleMatrix::Zero(last - first, last);
    const int tasks = static_cast<int>((last + kOtherRows - 1) / kOtherRows);
    for (Eigen::Index col = 0; col < index.cols; col += kGramColumns) {
      const Eigen::Index cols = std::min(kGramColumns, index.cols - col);
      const PackedRows A = packed(PackedRows::Side::left, first, last - first, col, cols);
      parallel_for(tasks, threads, [&](int task) {
        const Eigen::Index other = task * kOtherRows, count = std::min(kOtherRows, last - other);
        const Eigen::Index skip = std::max<Eigen::Index>(0, other - first) / 4 * 4;  // above the diagonal
        add_inner_products(A, skip, packed(PackedRows::Side::right, other, count, col, cols),
                           sums.block(skip, other, last - first - skip, count));
      });
    }
    for (Eigen::Index slot = first; slot < last; ++slot)
      products.write(sums.row(slot - first).data(), 8 * static_cast<std::uint64_t>(slot + 1), products_offset(slot));
    products.sync();
    index.product_rows = last;
    commit();
  }

  PackedRows packed(PackedRows::Side side, Eigen::Index slot, Eigen::Index count, Eigen::Index col,
                    Eigen::Index cols) const {
    PackedRows block(side, count, cols);
    Eigen::RowVectorXf values(cols);
    for (Eigen::Index i = 0; i < count; ++i) {
      read_floats(slot + i, col, cols, values.data());
      block.set_row(i, values.data());
    }
    return block;
  }
};

SampleStore::SampleStore(std::unique_ptr<Files> files) : files_(std::move(files)) {}
SampleStore::SampleStore(SampleStore&&) noexcept = default;
SampleStore& SampleStore::operator=(SampleStore&&) noexcept = default;
SampleStore::~SampleStore() = default;

SampleStore SampleStore::create(const std::filesystem::path& folder, const Eigen::RowVectorXd& origin) {
  if (origin.size() == 0 || !origin.allFinite()) throw InvalidInput("sample store: the origin is empty or not finite");
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw IoError(folder.string(), "cannot be created: " + error.message());
  auto files = std::make_unique<Files>();
  files->folder = folder;
  files->take_lock();
  if (std::filesystem::exists(folder / "index.txt")) throw IoError(folder.string(), "holds a sample store already");
  files->origin = origin;
  files->index.cols = origin.size();
  files->create_data(0);
  files->rows.sync();
  files->commit();
  return SampleStore(std::move(files));
}

SampleStore SampleStore::open(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "index.txt")) throw IoError(folder.string(), "holds no sample store");
  auto files = std::make_unique<Files>();
  files->folder = folder;
  files->take_lock();
  files->index = read_index(folder / "index.txt");
  files->open_data();
  for (const IndexedSample& sample : files->index.samples) files->ids.push_back(sample.id);
  return SampleStore(std::move(files));
}

Eigen::Index SampleStore::sample_count() const { return static_cast<Eigen::Index>(files_->index.samples.size()); }
Eigen::Index SampleStore::cols() const { return files_->index.cols; }
const Eigen::RowVectorXd& SampleStore::origin() const { return files_->origin; }
const std::vector<std::string>& SampleStore::ids() const { return files_->ids; }
const Similarity& SampleStore::mean_from_scan(Eigen::Index i) const {
  return files_->index.samples.at(static_cast<size_t>(i)).mean_from_scan;
}

void SampleStore::append(const std::vector<std::string>& ids, const SampleMatrix& samples,
                         const std::vector<Similarity>& mean_from_scans) {
  const auto expect = [](bool ok, const std::string& what) {
    if (!ok) throw InvalidInput("sample store: " + what);
  };
  expect(samples.rows() == static_cast<Eigen::Index>(ids.size()) && (ids.empty() || samples.cols() == cols()),
         std::to_string(samples.rows()) + " samples of " + std::to_string(samples.cols()) + " values under " +
             std::to_string(ids.size()) + " ids do not fit a store of " + std::to_string(cols()) + " columns");
  expect(mean_from_scans.empty() || mean_from_scans.size() == ids.size(), "there is not one transform per sample");
  std::set<std::string> known(files_->ids.begin(), files_->ids.end());
  for (size_t i = 0; i < ids.size(); ++i) {
    expect(!ids[i].empty() && ids[i].find_first_of("\n\r") == std::string::npos, "an id is empty or has a line break");
    expect(known.insert(ids[i]).second, "there is a sample '" + ids[i] + "' already");
    expect(samples.row(static_cast<Eigen::Index>(i)).allFinite(), "sample '" + ids[i] + "' holds NaN or infinity");
  }
  Eigen::RowVectorXf row;
  for (size_t i = 0; i < ids.size(); ++i) {
    const Eigen::Index slot = files_->index.slots + static_cast<Eigen::Index>(i);
    row = (samples.row(static_cast<Eigen::Index>(i)) - files_->origin).cast<float>();
    files_->rows.write(row.data(), 4 * static_cast<std::uint64_t>(cols()), files_->row_offset(slot));
  }
  files_->rows.sync();
  for (size_t i = 0; i < ids.size(); ++i)
    files_->index.samples.push_back(
        {files_->index.slots++, ids[i], mean_from_scans.empty() ? Similarity{} : mean_from_scans[i]});
  files_->commit();
}

void SampleStore::remove(const std::vector<std::string>& ids) {
  const std::set<std::string> gone(ids.begin(), ids.end()), known(files_->ids.begin(), files_->ids.end());
  for (const std::string& id : gone)
    if (!known.contains(id)) throw InvalidInput("sample store: there is no sample '" + id + "'");
  std::erase_if(files_->index.samples, [&](const IndexedSample& sample) { return gone.contains(sample.id); });
  files_->commit();
}

SampleMatrix SampleStore::centred_block(Eigen::Index row, Eigen::Index rows, Eigen::Index col,
                                        Eigen::Index cols) const {
  SampleMatrix block(rows, cols);
  Eigen::RowVectorXf values(cols);
  for (Eigen::Index i = 0; i < rows; ++i) {
    files_->read_floats(files_->index.samples.at(static_cast<size_t>(row + i)).slot, col, cols, values.data());
    block.row(i) = values.cast<double>();
  }
  return block;
}

Eigen::RowVectorXd SampleStore::sample(Eigen::Index i) const { return centred_block(i, 1, 0, cols()) + files_->origin; }

Eigen::RowVectorXd SampleStore::mean(int threads) const {
  if (sample_count() == 0) return files_->origin;
  Eigen::RowVectorXd mean = files_->origin;
  parallel_for(column_block_count(cols()), threads, [&](int b) {
    const auto [col, width] = column_block(cols(), b);
    Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(width);
    for (Eigen::Index i = 0; i < sample_count(); ++i) sum += centred_block(i, 1, col, width);
    mean.segment(col, width) += sum / static_cast<double>(sample_count());
  });
  return mean;
}

Eigen::MatrixXd SampleStore::gram(int threads, const Progress& progress) {
  Files& files = *files_;
  while (files.index.product_rows < files.index.slots) {
    const Eigen::Index first = files.index.product_rows, last = std::min(first + kGramRows, files.index.slots);
    files.extend_products(first, last, threads);
    if (progress) progress({"inner products", static_cast<int>(last), static_cast<int>(files.index.slots), ""});
  }
  Eigen::MatrixXd G(sample_count(), sample_count());
  Eigen::VectorXd row(files.index.slots);
  for (Eigen::Index i = 0; i < G.rows(); ++i) {
    const Eigen::Index slot = files.index.samples[static_cast<size_t>(i)].slot;
    files.products.read(row.data(), 8 * static_cast<std::uint64_t>(slot + 1), products_offset(slot));
    for (Eigen::Index j = 0; j <= i; ++j)  // slots ascend
      G(j, i) = row[files.index.samples[static_cast<size_t>(j)].slot];
  }
  G.triangularView<Eigen::StrictlyLower>() = G.transpose();
  if (!G.allFinite()) throw IoError(files.products.path(), "holds NaN or infinity");
  return G;
}

void SampleStore::rewrite(const std::function<Similarity(Eigen::Index, Eigen::RowVectorXd&)>& change) {
  const bool keep_products = !change && files_->index.product_rows == files_->index.slots;
  const Eigen::MatrixXd G = keep_products ? gram() : Eigen::MatrixXd();
  auto files = std::make_unique<Files>();
  files->folder = files_->folder;
  files->origin = files_->origin;
  files->index.cols = cols();
  files->create_data(files_->index.generation + 1);
  Eigen::RowVectorXf values;
  for (Eigen::Index i = 0; i < sample_count(); ++i) {
    Eigen::RowVectorXd row = sample(i);
    const Similarity step = change ? change(i, row) : Similarity{};
    if (!row.allFinite()) throw InvalidInput("sample store: a changed row holds NaN or infinity");
    values = (row - files->origin).cast<float>();
    files->rows.write(values.data(), 4 * static_cast<std::uint64_t>(cols()), files->row_offset(i));
    files->index.samples.push_back({i, files_->ids[static_cast<size_t>(i)], step * mean_from_scan(i)});
    if (keep_products)
      files->products.write(G.col(i).data(), 8 * static_cast<std::uint64_t>(i + 1), products_offset(i));
  }
  files->rows.sync();
  files->products.sync();
  files->index.slots = sample_count();
  files->index.product_rows = keep_products ? sample_count() : 0;
  files->commit();
  const int old = files_->index.generation;
  files->lock = std::move(files_->lock);
  files_ = std::move(files);
  std::error_code ignored;
  std::filesystem::remove(files_->folder / rows_name(old), ignored);
  std::filesystem::remove(files_->folder / products_name(old), ignored);
}

}  // namespace facewright
