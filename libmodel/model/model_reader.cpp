// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/model_reader.h"

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/model/extension_reader.h"
#include "libmodel/model/hdf5_archive.h"
#include "libmodel/model/model_file.h"
#include "libmodel/model/representer_reader.h"
#include "libmodel/model/statistics_reader.h"

namespace facewright {
namespace {

std::string normalised(const std::string& group) {
  std::string path;
  for (const char c : "/" + group)
    if (c != '/' || !path.ends_with('/')) path += c;
  while (path.ends_with('/')) path.pop_back();
  return path;
}

// The statismo model that holds one part ("shape") of the morphable model at `at`: there, or where the catalogue says.
std::string part_path(const Hdf5Reader& h5, const std::string& at, const std::string& part) {
  if (const std::string usual = at + "/" + part; h5.has(usual + "/model/mean")) return usual;
  const std::string entry = at + "/catalog/MorphableModel." + part + "/modelPath";
  if (h5.has(entry))
    if (const std::string path = normalised(h5.string(entry)); h5.has(path + "/model/mean")) return path;
  return "";
}

// Statistics in millimetres.
PcaModel scaled(PcaModel pca, double scale) {
  if (scale == 1) return pca;
  pca.mean *= scale;
  pca.variances *= scale * scale;
  return pca;
}

// Reads the statistics of one level's parts.
class LevelStatistics {
 public:
  LevelStatistics(const Hdf5Reader& h5, const std::string& at, Loading loading) : h5_(h5), at_(at), loading_(loading) {
    const std::string ext = at + "/metadata/ext";
    ours_ = h5.has(ext + "/format");
    // A coarse level stores its own orthonormal basis: the shared one is the finest level's, cut by rows.
    shared_ = !at.empty() && h5.has(ext + "/shared_from_own") && h5.has("/shape/model/pcaBasis");
    orthonormal_ = !h5.has(ext + "/basis") || h5.string(ext + "/basis") == "orthonormal";
  }
  bool ours() const { return ours_; }

  PcaModel read(const std::string& own) const {
    if (!shared_) return read_statistics(h5_, own, {.orthonormal = orthonormal_});
    const Eigen::VectorXd mean = read_column(h5_, own + "/model/mean");
    const std::string root = own.substr(at_.size());
    PcaModel pca = read_statistics(h5_, root, {.values = mean.size(), .orthonormal = false});
    if (pca.mean != mean && loading_ == Loading::proven)
      h5_.fail(own + "/model/mean", "is not the leading part of " + root + "/model/mean: the levels do not nest");
    pca.mean = mean;
    return pca;
  }

 private:
  const Hdf5Reader& h5_;
  std::string at_;
  Loading loading_;
  bool ours_ = false, shared_ = false, orthonormal_ = true;
};

// The coarser levels: their triangles, and the proof that their vertices lead the finest level's.
void read_coarse_levels(const Hdf5Reader& h5, MorphableModelParts& parts) {
  const RowMatrixXi table = h5.integers("/levels");
  if (table.cols() != 2) h5.fail("/levels", "does not have two columns");
  std::vector<ModelLevel> levels;
  for (Eigen::Index l = 0; l + 1 < table.rows(); ++l) {
    const std::string level = "/level" + std::to_string(l), shape = level + "/shape";
    const Eigen::VectorXd mean = read_column(h5, shape + "/model/mean");
    if (mean.size() % 3 != 0) h5.fail(shape + "/model/mean", "does not hold three numbers per vertex");
    if (mean.size() > parts.shape.mean.size() || mean != parts.shape.mean.head(mean.size()))
      h5.fail(shape + "/model/mean", "is not the leading part of the finest level's: the levels do not nest");
    ModelLevel read{static_cast<int>(mean.size() / 3), read_cells(h5, shape, mean.size() / 3),
                    read_landmark_points(h5, level + "/metadata/ext")};
    check_winding(h5, shape, read.F, as_vertices(mean));
    levels.push_back(std::move(read));
  }
  parts.levels.insert(parts.levels.begin(), std::make_move_iterator(levels.begin()),
                      std::make_move_iterator(levels.end()));
}

MorphableModelParts read_parts(const Hdf5Reader& h5, const std::string& at, Loading loading) {
  check_format(h5, at + "/metadata/ext");
  const LevelStatistics statistics(h5, at, loading);
  const std::string found = part_path(h5, at, "shape"), shape = found.empty() ? at : found;
  const double scale = millimetres_per_unit(h5, shape);
  MorphableModelParts parts;
  parts.shape = scaled(statistics.read(shape), scale);
  if (const std::string path = part_path(h5, at, "color"); !path.empty()) parts.colour = statistics.read(path);
  if (const std::string path = part_path(h5, at, "expression"); !path.empty())
    parts.expression = scaled(statistics.read(path), scale);
  const Eigen::Index n = parts.shape.vertex_count();
  parts.levels = {{static_cast<int>(n), read_cells(h5, shape, n)}};
  if (statistics.ours() && loading == Loading::proven)
    check_winding(h5, shape, parts.levels.back().F, as_vertices(parts.shape.mean));
  parts.landmarks = read_landmarks_of(h5, at + "/metadata", parts.shape);
  read_extension(h5, at + "/metadata/ext", parts);
  if (at.empty() && h5.has("/levels")) read_coarse_levels(h5, parts);
  return parts;
}

}  // namespace

std::vector<int> stored_levels(const std::filesystem::path& path) {
  const Hdf5Reader h5(path);
  std::vector<int> counts;
  if (!h5.has("/levels")) return counts;
  const RowMatrixXi table = h5.integers("/levels");
  for (Eigen::Index l = 0; l < table.rows(); ++l) counts.push_back(table(l, 0));
  return counts;
}

std::vector<Edge> stored_edges(const std::filesystem::path& path, const std::string& group) {
  const Hdf5Reader h5(path);
  const std::string at = normalised(group) + "/metadata/ext/edges";
  std::vector<Edge> edges;
  if (!h5.has(at)) return edges;
  const RowMatrixXi table = h5.integers(at);
  if (table.cols() != 4) h5.fail(at, "has " + std::to_string(table.cols()) + " columns; expected 4");
  for (Eigen::Index i = 0; i < table.rows(); ++i) edges.push_back({table(i, 0), table(i, 1), table(i, 2), table(i, 3)});
  return edges;
}

std::optional<OrthonormalLevel> stored_statistics(const std::filesystem::path& path, const std::string& group,
                                                  const std::string& part) {
  const Hdf5Reader h5(path);
  const std::string at = normalised(group), map = at + "/metadata/ext/shared_from_own/" + part;
  if (!h5.has(map)) return std::nullopt;
  OrthonormalLevel level{read_statistics(h5, at + "/" + part), h5.matrix(map).transpose()};
  if (level.own_from_shared.rows() != level.model.mode_count() || !level.own_from_shared.allFinite())
    h5.fail(map, "does not have one column per mode, or holds NaN");
  return level;
}

MorphableModel load_model(const std::filesystem::path& path, const std::string& group) {
  return load_model(path, group, Loading::proven);
}

MorphableModel load_model(const std::filesystem::path& path, const std::string& group, Loading loading) {
  const Hdf5Reader h5(path);
  MorphableModelParts parts = read_parts(h5, normalised(group), loading);
  try {
    const Faces& coarsest = parts.levels.front().F;
    parts.landmarks = landmarks_on_vertices(parts.landmarks, coarsest, coarsest);
    return MorphableModel(std::move(parts), MorphableModel::ValidStatistics{});
  } catch (const InvalidInput& error) {
    throw IoError(path.string(), error.what());
  }
}

}  // namespace facewright
