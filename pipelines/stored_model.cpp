// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/stored_model.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "pipelines/drawing.h"
#include "pipelines/registration_report.h"
#include "pipelines/scan_stage.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

// Bytes per vertex and scan: shape and colour, how far both were seen, and once more as aligned and filled. Measured:
// 143 (docs/results.md).
constexpr double kPerVertex = 150;
// Whatever the scans: the model's modes and pictures, programs and libraries. Measured at 29,587 vertices, with
// reserve.
constexpr double kFixed = 6e8;
constexpr double kPerPair = 24;  // bytes: inner products, centred, and their factorisation
constexpr int kFewest = 30;      // scans at hand: fewer teach nothing of unseen colours
constexpr int kMost = 500;       // scans at hand; our choice
constexpr int kBlock = 32;       // scans read at once

std::string in_gigabytes(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f GB", std::ceil(bytes / 1e8) / 10);
  return text;
}

double physical_memory() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
}

// Removed with all it holds, whatever happens.
struct ScratchFolder {
  explicit ScratchFolder(fs::path folder) : path(std::move(folder)) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  fs::path path;
};

// Reads the scans block by block.
template <typename Body>
void for_each_block(const std::vector<std::string>& ids, const MultiresTemplate& reference, const OutputTree& tree,
                    const Body& body) {
  for (size_t first = 0; first < ids.size(); first += kBlock) {
    const auto begin = ids.begin() + static_cast<std::ptrdiff_t>(first);
    body(read_registered_set({begin, begin + static_cast<std::ptrdiff_t>(std::min<size_t>(kBlock, ids.size() - first))},
                             reference, tree));
  }
}

// Puts all shapes into the store; returns the ids of scans with colours.
std::vector<std::string> store_shapes(const std::vector<std::string>& ids, const MultiresTemplate& reference,
                                      const OutputTree& tree, SampleStore* shapes) {
  std::vector<std::string> coloured;
  for_each_block(ids, reference, tree, [&](const RegisteredSet& set) {
    shapes->append(set.ids, set.shapes);
    for (size_t s = 0; s < set.ids.size(); ++s)
      if (set.colours.size() > 0 && set.colour_weights.row(static_cast<Eigen::Index>(s)).maxCoeff() > 0)
        coloured.push_back(set.ids[s]);
  });
  return coloured;
}

// Fills the colours of all from what some tell; returns what share of each was filled.
std::map<std::string, double> store_colours(const std::vector<std::string>& coloured, const UnseenFill& fill,
                                            const MultiresTemplate& reference, const OutputTree& tree, int threads,
                                            SampleStore* colours) {
  std::map<std::string, double> shares;
  for_each_block(coloured, reference, tree, [&](RegisteredSet set) {
    parallel_for(static_cast<int>(set.ids.size()), threads, [&](int s) {
      Eigen::RowVectorXd row = set.colours.row(s);
      fill.complete(row, set.colour_weights.row(s));
      set.colours.row(s) = row;
    });
    for (size_t s = 0; s < set.ids.size(); ++s)
      shares[set.ids[s]] = fill.filled_share(set.colour_weights.row(static_cast<Eigen::Index>(s)));
    colours->append(set.ids, set.colours);
  });
  return shares;
}

UnseenFill learn_colours(const std::vector<std::string>& ids, const MultiresTemplate& reference, const OutputTree& tree,
                         FillUnseenOptions options, int threads) {
  options.threads = threads;
  const RegisteredSet set = read_registered_set(ids, reference, tree);
  return UnseenFill(set.colours, set.colour_weights, reference.V, reference.levels.back().F, options);
}

// The summary of the fill, told of all the model is made of instead of those it was learnt from.
void tell_of_all(const std::vector<std::string>& ids, const std::map<std::string, double>& shares,
                 BuildModelResult* result) {
  FillUnseenSummary& fill = result->summary.fill;
  fill.sample_shares.clear();
  fill.filled_share = fill.worst_sample_share = 0;
  fill.worst_sample = -1;
  for (const int row : result->colour_scans) {
    const double share = shares.at(ids[static_cast<size_t>(row)]);
    if (share > fill.worst_sample_share) {
      fill.worst_sample_share = share;
      fill.worst_sample = static_cast<int>(fill.sample_shares.size());
    }
    fill.sample_shares.push_back(share);
    fill.filled_share += share / static_cast<double>(result->colour_scans.size());
  }
}

}  // namespace

GatherPlan plan_gathering(int scans, Eigen::Index vertices, double gigabytes) {
  const double per_scan = kPerVertex * static_cast<double>(vertices), limit = 1e9 * gigabytes;
  const double in_memory = kFixed + per_scan * scans, pairs = kPerPair * scans * static_cast<double>(scans);
  const double least = kFixed + pairs + per_scan * std::min(scans, kFewest);
  if (gigabytes <= 0) {
    if (in_memory <= physical_memory()) return {false, scans};
    throw InvalidInput("build: a model of " + std::to_string(scans) + " scans of " + std::to_string(vertices) +
                       " vertices takes some " + in_gigabytes(in_memory) + " of memory, this machine has " +
                       in_gigabytes(physical_memory()) + "; go on with --memory N --resume, N gigabytes, at least " +
                       in_gigabytes(least));
  }
  if (in_memory <= limit) return {false, scans};
  if (least > limit)
    throw InvalidInput("build: --memory is too little for " + std::to_string(scans) + " scans of " +
                       std::to_string(vertices) + " vertices; give at least " + in_gigabytes(least));
  return {true, std::min({scans, kMost, static_cast<int>((limit - kFixed - pairs) / per_scan)})};
}

int jobs_within(double gigabytes, std::uintmax_t bytes, int jobs) {
  constexpr double kPerJob = 2.5e8, kPerByte = 25;  // of the mesh's file
  const int most = jobs > 0 ? jobs : hardware_threads();
  if (gigabytes <= 0) return most;
  return std::clamp(static_cast<int>(1e9 * gigabytes / (kPerJob + kPerByte * static_cast<double>(bytes))), 1, most);
}

BuildModelResult build_stored_model(const std::vector<std::string>& ids, const MultiresTemplate& reference,
                                    const BuildModelOptions& options, const GatherPlan& plan, const OutputTree& tree) {
  if (options.gain_balance != GainBalance::none)
    throw InvalidInput("build: a gain balance needs all scans in memory at once; give more --memory, or none of it");
  const ScratchFolder scratch(tree.root / "gathering");
  SampleStore shapes = SampleStore::create(
      scratch.path / "shapes", Eigen::Map<const Eigen::RowVectorXd>(reference.V.data(), reference.V.size()));
  const std::vector<std::string> coloured = store_shapes(ids, reference, tree, &shapes);
  std::optional<SampleStore> colours;
  std::map<std::string, double> shares;
  FillUnseenSummary filled;
  if (!coloured.empty()) {
    const UnseenFill fill =
        learn_colours(draw_ids(coloured, plan.at_hand), reference, tree, options.fill, options.threads);
    colours = SampleStore::create(scratch.path / "colours", Eigen::RowVectorXd::Constant(reference.V.size(), 0.5));
    shares = store_colours(coloured, fill, reference, tree, options.threads, &*colours);
    filled = fill.summary();
  }
  const auto seen = [&](const std::string& id) { return read_matched(tree.scan_origins(id), reference.V.rows()); };
  BuildModelResult result = build_model(shapes, colours ? &*colours : nullptr, reference, options, seen);
  result.summary.fill = filled;
  tell_of_all(ids, shares, &result);
  return result;
}

}  // namespace facewright
