// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <array>
#include <nlohmann/json.hpp>

#include "libmodel/core/errors.h"
#include "libmodel/model/hdf5_archive.h"
#include "libmodel/model/model_file.h"

namespace facewright {
namespace {

using nlohmann::json;

json parse_json(const Hdf5Reader& h5, const std::string& path) {
  const json value = json::parse(h5.string(path), nullptr, /*allow_exceptions=*/false);
  if (value.is_discarded()) h5.fail(path, "is not JSON");
  return value;
}

// What `take` makes of the JSON text at `path`; JSON of another kind than `take` expects is an error of the file.
template <class Take>
auto from_json(const Hdf5Reader& h5, const std::string& path, Take take) {
  try {
    return take(parse_json(h5, path));
  } catch (const json::exception& error) {
    h5.fail(path, std::string("has an unexpected content: ") + error.what());
  }
}

template <class T>
T from_json(const Hdf5Reader& h5, const std::string& path) {
  return from_json(h5, path, [](const json& value) { return value.get<T>(); });
}

int one_integer(const Hdf5Reader& h5, const std::string& path) {
  const RowMatrixXi value = h5.integers(path);
  if (value.size() != 1) h5.fail(path, "holds " + std::to_string(value.size()) + " numbers; expected one");
  return value(0, 0);
}

int minor_version(const Hdf5Reader& h5, const std::string& group) {
  for (const std::string& at : {group + "/version", std::string("/version")})
    if (h5.has(at + "/minorVersion")) {
      const int major = one_integer(h5, at + "/majorVersion"), minor = one_integer(h5, at + "/minorVersion");
      if (major != 0 || minor < 8)
        h5.fail(at, "is " + std::to_string(major) + "." + std::to_string(minor) + "; readable are 0.8 and 0.9");
      return minor;
    }
  return 8;
}

Eigen::VectorXd column(const Hdf5Reader& h5, const std::string& path) {
  const RowMatrixXd m = h5.matrix(path);
  if (m.cols() != 1 && m.rows() != 1) h5.fail(path, "is a matrix; expected a vector");
  return Eigen::Map<const Eigen::VectorXd>(m.data(), m.size());
}

PcaModel read_statistics(const Hdf5Reader& h5, const std::string& group) {
  const std::string at = group + "/model";
  PcaModel pca;
  pca.mean = column(h5, at + "/mean");
  pca.variances = column(h5, at + "/pcaVariance");
  pca.basis = h5.matrix(at + "/pcaBasis");
  if (pca.basis.rows() != pca.mean.size() || pca.basis.cols() != pca.variances.size())
    h5.fail(at + "/pcaBasis", "is " + std::to_string(pca.basis.rows()) + " x " + std::to_string(pca.basis.cols()) +
                                  "; expected " + std::to_string(pca.mean.size()) + " x " +
                                  std::to_string(pca.variances.size()) + " from mean and pcaVariance");
  Eigen::Index modes = pca.mode_count();
  while (modes > 0 && pca.variances[modes - 1] == 0) --modes;
  pca = pca.truncated(modes);
  if (minor_version(h5, group) == 8)  // 0.8 stored basis * diag(sqrt(variances))
    pca.basis = (pca.basis * pca.variances.cwiseSqrt().cwiseInverse().asDiagonal()).eval();
  try {
    validate(pca);
  } catch (const InvalidInput& error) {
    h5.fail(at, std::string("is not a model: ") + error.what());
  }
  return pca;
}

Faces read_triangles(const Hdf5Reader& h5, const std::string& path) {
  const RowMatrixXi table = h5.integers(path);
  if (table.cols() != 3) h5.fail(path, "has " + std::to_string(table.cols()) + " columns; expected 3");
  return table;
}

Faces read_cells(const Hdf5Reader& h5, const std::string& shape_group) {
  const std::string legacy = shape_group + "/representer/reference-mesh/triangle-list";
  if (h5.has(legacy)) return read_triangles(h5, legacy);
  const std::string path = shape_group + "/representer/cells";
  const RowMatrixXi cells = h5.integers(path);
  if (cells.rows() != 3) h5.fail(path, "has " + std::to_string(cells.rows()) + " rows; expected 3");
  return cells.transpose();
}

int nearest_vertex(const PcaModel& shape, const Eigen::Vector3d& x) {
  Eigen::Index v = 0;
  (as_vertices(shape.mean).rowwise() - x.transpose()).rowwise().squaredNorm().minCoeff(&v);
  return static_cast<int>(v);
}

LandmarkSet read_landmarks_of(const Hdf5Reader& h5, const std::string& metadata, const PcaModel& shape) {
  LandmarkSet marks;
  const std::string vertices = metadata + "/ext/landmark_vertices", coordinates = metadata + "/landmarks/json";
  if (h5.has(vertices)) {
    for (const auto& [name, v] : from_json<std::map<std::string, int>>(h5, vertices)) marks[name].vertex = v;
  } else if (h5.has(coordinates)) {
    if (shape.empty()) h5.fail(coordinates, "names landmarks of a mean without vertices");
    marks = from_json(h5, coordinates, [&](const json& list) {
      LandmarkSet found;
      for (const json& entry : list) {
        const auto x = entry.at("coordinates").get<std::array<double, 3>>();
        found[entry.at("id").get<std::string>()].vertex = nearest_vertex(shape, {x[0], x[1], x[2]});
      }
      return found;
    });
  }
  return marks;
}

// The places that are no vertices; the others follow from their vertex.
std::map<std::string, SurfacePoint, LandmarkNameOrder> read_landmark_points(const Hdf5Reader& h5,
                                                                            const std::string& ext) {
  std::map<std::string, SurfacePoint, LandmarkNameOrder> points;
  const std::string path = ext + "/landmark_points";
  if (!h5.has(path)) return points;
  return from_json(h5, path, [&](const json& table) {
    for (const auto& [name, entry] : table.items()) {
      const auto b = entry.at("barycentric").get<std::array<double, 3>>();
      if (entry.value("vertex", -1) < 0) points[name] = {entry.value("triangle", -1), {b[0], b[1], b[2]}};
    }
    return points;
  });
}

void check_format(const Hdf5Reader& h5, const std::string& ext) {
  if (!h5.has(ext + "/format")) return;
  const std::string format = h5.string(ext + "/format");
  if (format != "facewright-model 1" && format != "facewright-model 2")
    h5.fail(ext + "/format", "is '" + format +
                                 "'; this version reads 'facewright-model 1' and 2. Was it written by a "
                                 "newer one?");
}

void read_extension(const Hdf5Reader& h5, const std::string& at, MorphableModelParts& parts) {
  if (h5.has(at + "/uv")) {
    const RowMatrixXd uv = h5.matrix(at + "/uv");
    if (uv.cols() != 2) h5.fail(at + "/uv", "does not have two columns");
    parts.uv = uv;
  }
  if (h5.has(at + "/mirror")) {
    const RowMatrixXi mirror = h5.integers(at + "/mirror");
    parts.mirror.assign(mirror.data(), mirror.data() + mirror.size());
  }
  if (h5.has(at + "/parents")) {
    const Faces table = read_triangles(h5, at + "/parents");
    for (Eigen::Index i = 0; i < table.rows(); ++i) parts.parents.push_back({table(i, 0), table(i, 1), table(i, 2)});
  }
  if (h5.has(at + "/base_faces")) parts.base_faces = read_triangles(h5, at + "/base_faces");
  parts.levels.back().landmark_points = read_landmark_points(h5, at);
  if (h5.has(at + "/regions")) parts.regions = from_json<decltype(parts.regions)>(h5, at + "/regions");
  if (h5.has(at + "/provenance")) parts.provenance = from_json<decltype(parts.provenance)>(h5, at + "/provenance");
  if (h5.has(at + "/basis") && h5.string(at + "/basis") != "orthonormal") {
    parts.shape.orthonormal = parts.colour.orthonormal = false;
    if (parts.expression) parts.expression->orthonormal = false;
  }
}

// The coarser levels: their triangles, and the proof that their vertices lead the finest level's.
void read_coarse_levels(const Hdf5Reader& h5, MorphableModelParts& parts) {
  const RowMatrixXi table = h5.integers("/levels");
  if (table.cols() != 2) h5.fail("/levels", "does not have two columns");
  std::vector<ModelLevel> levels;
  for (Eigen::Index l = 0; l + 1 < table.rows(); ++l) {
    const std::string shape = "/level" + std::to_string(l) + "/shape";
    const Eigen::VectorXd mean = column(h5, shape + "/model/mean");
    if (mean.size() % 3 != 0) h5.fail(shape + "/model/mean", "does not hold three numbers per vertex");
    if (mean.size() > parts.shape.mean.size() || mean != parts.shape.mean.head(mean.size()))
      h5.fail(shape + "/model/mean", "is not the leading part of the finest level's: the levels do not nest");
    levels.push_back({static_cast<int>(mean.size() / 3), read_cells(h5, shape),
                      read_landmark_points(h5, "/level" + std::to_string(l) + "/metadata/ext")});
  }
  parts.levels.insert(parts.levels.begin(), levels.begin(), levels.end());
}

std::string normalised(std::string group) {
  while (!group.empty() && group.back() == '/') group.pop_back();
  if (!group.empty() && group.front() != '/') group.insert(group.begin(), '/');
  return group;
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
  if (table.cols() != 4) h5.fail(at, "does not have four columns");
  for (Eigen::Index i = 0; i < table.rows(); ++i) edges.push_back({table(i, 0), table(i, 1), table(i, 2), table(i, 3)});
  return edges;
}

MorphableModel load_model(const std::filesystem::path& path, const std::string& group) {
  const Hdf5Reader h5(path);
  const std::string at = normalised(group);
  const std::string shape = h5.has(at + "/shape/model/mean") ? at + "/shape" : at;
  check_format(h5, at + "/metadata/ext");
  MorphableModelParts parts;
  parts.shape = read_statistics(h5, shape);
  if (h5.has(at + "/color/model/mean")) parts.colour = read_statistics(h5, at + "/color");
  if (h5.has(at + "/expression/model/mean")) parts.expression = read_statistics(h5, at + "/expression");
  parts.levels = {{static_cast<int>(parts.shape.vertex_count()), read_cells(h5, shape)}};
  parts.landmarks = read_landmarks_of(h5, at + "/metadata", parts.shape);
  read_extension(h5, at + "/metadata/ext", parts);
  if (at.empty() && h5.has("/levels")) read_coarse_levels(h5, parts);
  try {
    const Faces& coarsest = parts.levels.front().F;
    parts.landmarks = landmarks_on_vertices(parts.landmarks, coarsest, coarsest);
    return MorphableModel(std::move(parts));
  } catch (const InvalidInput& error) {
    throw IoError(path.string(), error.what());
  }
}

}  // namespace facewright
