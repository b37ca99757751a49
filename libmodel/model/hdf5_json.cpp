// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/hdf5_json.h"

#include <nlohmann/json.hpp>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/io/json_depth.h"
#include "libmodel/io/json_whole.h"
#include "libmodel/model/hdf5_archive.h"

namespace facewright {
namespace {

using nlohmann::json;

// Numbers of nested lists, in order.
template <class T>
void flatten(const json& value, std::vector<T>& to) {
  if (!value.is_array()) {
    if constexpr (std::is_integral_v<T>)
      to.push_back(whole_number<T>(value));
    else
      to.push_back(value.get<T>());
    return;
  }
  for (const json& item : value) flatten(item, to);
}

template <class T>
auto table(const json& dataset, const std::string& name, const std::string& path) {
  std::vector<Eigen::Index> dims = {1, 1};
  const json& shape = dataset.at("shape");
  if (shape.contains("dims")) {
    dims.clear();
    for (const json& n : shape.at("dims")) dims.push_back(whole_number<std::int32_t>(n));
  }
  if (dims.size() == 1) dims.push_back(1);
  std::vector<T> values;
  flatten(dataset.at("value"), values);
  if (dims.size() != 2 || dims[0] < 0 || dims[1] < 0 || dims[0] > Eigen::Index{1} << 30 ||
      dims[1] > Eigen::Index{1} << 30 || static_cast<Eigen::Index>(values.size()) != dims[0] * dims[1])
    throw IoError(name, "'" + path + "' holds " + std::to_string(values.size()) +
                            " values, which do not fill the shape it states");
  using Matrix = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Matrix(Eigen::Map<const Matrix>(values.data(), dims[0], dims[1]));
}

void write_dataset(Hdf5Writer& h5, const json& dataset, const std::string& name, const std::string& path) {
  const std::string kind = dataset.at("type").at("class").get<std::string>();
  if (kind == "H5T_FLOAT") {
    h5.matrix(path, RowMatrixXd(table<double>(dataset, name, path)));
  } else if (kind == "H5T_INTEGER") {
    h5.matrix(path, RowMatrixXi(table<std::int32_t>(dataset, name, path)));
  } else if (kind == "H5T_STRING") {
    const json& value = dataset.at("value");
    const json& text = value.is_array() && value.size() == 1 ? value[0] : value;
    if (text.is_string()) h5.string(path, text.get<std::string>());  // lists of strings say nothing of a model
  }
}

}  // namespace

std::string hdf5_from_json(const std::string& text, const std::string& name) {
  if (json_depth(text) > kMostJsonDepth) throw IoError(name, "nests lists too deeply for a model; it is damaged");
  const json file = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (file.is_discarded()) throw IoError(name, "is neither HDF5 nor JSON, or is cut short; expected a model");
  try {
    Hdf5Writer h5;
    for (const auto& [id, dataset] : file.at("datasets").items())
      for (const json& alias : dataset.at("alias")) write_dataset(h5, dataset, name, alias.get<std::string>());
    return h5.bytes();
  } catch (const json::exception& error) {
    throw IoError(name, std::string("is no HDF5-JSON: ") + error.what());
  } catch (const SolverError& error) {  // paths that exclude one another
    throw IoError(name, error.what());
  }
}

}  // namespace facewright
