// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "libmodel/core/progress.h"
#include "libmodel/core/registered_set.h"
#include "libmodel/core/similarity.h"

namespace facewright {

/// Aligned samples in a folder, for sets that do not fit into memory, and for models that scans are added to and
/// removed from without registering the others again. Rows are float32 differences from a fixed `origin`; beside them
/// lie their inner products about the origin in double, of which adding S' samples computes only S' rows.
///
/// Every change is whole or not at all, even when the machine stops: rows and products are only appended, and the
/// index, replaced atomically, says which of them count. One process at a time may have a store open. Everything
/// throws IoError for a file that is missing, truncated, of another version, damaged, or in use.
class SampleStore {
 public:
  /// An empty store of rows of `origin`'s size, in a folder that is created and must hold no store yet.
  static SampleStore create(const std::filesystem::path& folder, const Eigen::RowVectorXd& origin);
  static SampleStore open(const std::filesystem::path& folder);
  SampleStore(SampleStore&&) noexcept;
  SampleStore& operator=(SampleStore&&) noexcept;
  ~SampleStore();

  Eigen::Index sample_count() const;
  Eigen::Index cols() const;
  const Eigen::RowVectorXd& origin() const;
  const std::vector<std::string>& ids() const;             ///< in the order of the rows
  const Similarity& mean_from_scan(Eigen::Index i) const;  ///< how the scan was moved to become the row

  /// Samples (S' x cols) under ids that are new, unique, and without line breaks (InvalidInput, also for NaN).
  /// `mean_from_scans` (S') or empty.
  void append(const std::vector<std::string>& ids, const SampleMatrix& samples,
              const std::vector<Similarity>& mean_from_scans = {});
  /// Throws InvalidInput if one is not there. The space is reclaimed by `rewrite`.
  void remove(const std::vector<std::string>& ids);

  /// Part of the rows, less the origin.
  SampleMatrix centred_block(Eigen::Index row, Eigen::Index rows, Eigen::Index col, Eigen::Index cols) const;
  /// One sample as it was appended, to float32.
  Eigen::RowVectorXd sample(Eigen::Index i) const;
  Eigen::RowVectorXd mean(int threads = 0) const;

  /// Inner products about the origin (S x S), symmetric; computes what is missing, keeps it on disk tile by tile (an
  /// interrupted run resumes) and loads it. O(S' S cols) for S' new samples, 16 MB besides the result.
  Eigen::MatrixXd gram(int threads = 0, const Progress& progress = {});

  /// All rows anew, each through `change` (empty: as they are), in files that replace the old ones at once. Products
  /// are kept only without a change.
  void rewrite(const std::function<Similarity(Eigen::Index, Eigen::RowVectorXd&)>& change = {});

 private:
  struct Files;
  explicit SampleStore(std::unique_ptr<Files> files);
  std::unique_ptr<Files> files_;
};

}  // namespace facewright
