// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/viewer/viewer_data.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "libmodel/core/errors.h"
#include "pipelines/viewer/base64.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little, "the page reads little-endian numbers");

// Collects named arrays behind a header that lists them.
class Payload {
 public:
  Json header;

  template <class Number>
  void add(const std::string& name, const std::vector<Number>& numbers) {
    constexpr const char* type = std::is_same_v<Number, float>          ? "f4"
                                 : std::is_same_v<Number, std::int32_t> ? "i4"
                                 : std::is_same_v<Number, std::int16_t> ? "i2"
                                                                        : "i1";
    header["arrays"][name] = {{"type", type}, {"offset", bytes_.size()}, {"count", numbers.size()}};
    const size_t size = numbers.size() * sizeof(Number);
    bytes_.append(reinterpret_cast<const char*>(numbers.data()), size);
    bytes_.append((4 - size % 4) % 4, '\0');
  }

  std::string text() const {
    std::string json = header.dump();
    json.append((4 - json.size() % 4) % 4, ' ');
    const auto length = static_cast<std::uint32_t>(json.size());
    std::string all(reinterpret_cast<const char*>(&length), sizeof length);
    return base64(gzip(all + json + bytes_));
  }

 private:
  static std::string gzip(const std::string& bytes) {
    z_stream stream{};
    constexpr int kGzip = 16;  // on top of the window's bits: a gzip header instead of zlib's; no time in it
    if (deflateInit2(&stream, 6, Z_DEFLATED, 15 + kGzip, 9, Z_DEFAULT_STRATEGY) != Z_OK)
      throw InvalidInput("viewer: the data cannot be packed");
    std::string packed(deflateBound(&stream, bytes.size()), '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    const int result = deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    if (result != Z_STREAM_END) throw InvalidInput("viewer: the data cannot be packed");
    return packed;
  }

  std::string bytes_;
};

template <class Derived>
std::vector<float> floats(const Eigen::DenseBase<Derived>& values) {  // in the order of rows
  std::vector<float> out;
  out.reserve(static_cast<size_t>(values.size()));
  for (Eigen::Index i = 0; i < values.rows(); ++i)
    for (Eigen::Index k = 0; k < values.cols(); ++k) out.push_back(static_cast<float>(values(i, k)));
  return out;
}

std::vector<std::int32_t> indices(const Faces& F) { return {F.data(), F.data() + F.size()}; }

// Appends a vector as whole numbers of steps, and the step.
template <class Number>
void quantise(const Eigen::VectorXd& entries, std::vector<Number>& numbers, std::vector<float>& steps) {
  const double largest = entries.size() > 0 ? entries.cwiseAbs().maxCoeff() : 0;
  const double step = largest / std::numeric_limits<Number>::max();
  steps.push_back(static_cast<float>(step));
  for (Eigen::Index i = 0; i < entries.size(); ++i)
    numbers.push_back(step > 0 ? static_cast<Number>(std::lround(entries[i] / step)) : Number{0});
}

template <class Number>
void add_modes(Payload& payload, const std::string& name, const PcaModel& pca, int most) {
  const Eigen::Index count = std::min<Eigen::Index>(std::max(0, most), pca.mode_count());
  std::vector<Number> numbers;
  std::vector<float> steps;
  Json names = Json::array(), shares = Json::array();
  const double total = pca.variances.sum();
  for (Eigen::Index k = 0; k < count; ++k) {
    quantise(std::sqrt(pca.variances[k]) * pca.basis.col(k), numbers, steps);
    names.push_back("mode " + std::to_string(k + 1));
    shares.push_back(total > 0 ? std::round(1e4 * pca.variances[k] / total) / 1e4 : 0);
  }
  payload.header["families"][name] = {{"names", names}, {"share", shares}, {"of", pca.mode_count()}};
  if (count == 0) return;
  payload.add(name + "_modes", numbers);
  payload.add(name + "_steps", steps);
}

void add_blendshapes(Payload& payload, const std::vector<Blendshape>& blendshapes) {
  if (blendshapes.empty()) return;
  std::vector<std::int16_t> numbers;
  std::vector<float> steps;
  Json names = Json::array();
  for (const Blendshape& b : blendshapes) {
    quantise(b.displacement, numbers, steps);
    names.push_back(b.name);
  }
  payload.header["families"]["blendshape"] = {{"names", names}};
  payload.add("blendshape_modes", numbers);
  payload.add("blendshape_steps", steps);
}

void add_level(Payload& payload, const MorphableModel& model, int l, const std::vector<std::string>& names) {
  const std::string number = std::to_string(l);
  const Faces& F = model.faces(l);
  payload.header["levels"].push_back({{"vertices", model.vertex_count(l)}, {"triangles", F.rows()}});
  payload.add("faces_" + number, indices(F));
  if (names.empty()) return;
  const LandmarkSet marks = model.landmarks(l);
  std::vector<std::int32_t> corners;
  std::vector<float> weights;
  for (const std::string& name : names) {
    const MeshLandmark& mark = marks.at(name);
    for (int k = 0; k < 3; ++k) {
      corners.push_back(mark.vertex >= 0 ? mark.vertex : F(mark.point.triangle, k));
      weights.push_back(mark.vertex >= 0 ? (k == 0 ? 1.0f : 0.0f) : static_cast<float>(mark.point.barycentric[k]));
    }
  }
  payload.add("marks_" + number, corners);
  payload.add("mark_weights_" + number, weights);
}

}  // namespace

std::string model_viewer_data(const MorphableModel& model, const ViewerDataOptions& options) {
  if (model.empty()) throw InvalidInput("viewer: the model is empty");
  Payload payload;
  payload.header = {{"kind", "model"}, {"levels", Json::array()}, {"families", Json::object()}};
  std::vector<std::string> names;
  for (const auto& entry : model.landmarks()) names.push_back(entry.first);
  payload.header["landmarks"] = names;
  Eigen::VectorXd mean = model.shape().mean;
  if (model.expression()) mean += model.expression()->mean;
  payload.add("shape_mean", floats(mean));
  add_modes<std::int16_t>(payload, "shape", model.shape(), options.shape_modes);
  if (model.expression()) add_modes<std::int16_t>(payload, "expression", *model.expression(), options.expression_modes);
  add_blendshapes(payload, model.blendshapes());
  if (model.has_colour()) {
    payload.add("colour_mean", floats(model.colour().mean));
    add_modes<std::int8_t>(payload, "colour", model.colour(), options.colour_modes);
  }
  if (model.uv().rows() > 0) payload.add("uv", floats(model.uv()));
  for (int l = 0; l < model.level_count(); ++l) add_level(payload, model, l, names);
  return payload.text();
}

std::string mesh_viewer_data(const Mesh& mesh) {
  validate(mesh);
  if (mesh.uv_faces.rows() > 0) throw InvalidInput("viewer: expected one texture coordinate per vertex");
  Payload payload;
  payload.header = {{"kind", "mesh"}, {"levels", {{{"vertices", mesh.V.rows()}, {"triangles", mesh.F.rows()}}}}};
  payload.header["families"] = {{"shape", {{"names", Json::array()}}}};
  payload.add("shape_mean", floats(mesh.V));
  if (mesh.has_colours()) {
    payload.header["families"]["colour"] = {{"names", Json::array()}};
    payload.add("colour_mean", floats(mesh.colours));
  }
  if (mesh.has_uv()) payload.add("uv", floats(mesh.uv));
  payload.add("faces_0", indices(mesh.F));
  return payload.text();
}

}  // namespace facewright
