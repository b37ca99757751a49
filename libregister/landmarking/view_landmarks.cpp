// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/view_landmarks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "libregister/landmarking/geometric_median.h"

namespace facewright {
namespace {

constexpr double kRadians = std::numbers::pi / 180;

FaceBox moved(const FaceBox& box, double right, double down, double scale) {
  const Eigen::Vector2d middle = box.corner + box.size / 2 + Eigen::Vector2d(right, down).cwiseProduct(box.size);
  return {middle - scale * box.size / 2, scale * box.size};
}

std::vector<FaceBox> boxes_around(const FaceBox& box, const std::vector<double>& scales) {
  std::vector<FaceBox> boxes;
  for (const double scale : scales) {
    boxes.push_back(moved(box, 0, 0, scale));
    for (const double shift : {-0.04, 0.04}) {
      boxes.push_back(moved(box, shift, 0, scale));
      boxes.push_back(moved(box, 0, shift, scale));
    }
  }
  return boxes;
}

Image flipped(const Image& image) {
  Image mirror(image.width, image.height, image.channels);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      std::copy_n(image.pixel(x, y), image.channels, mirror.pixel(image.width - 1 - x, y));
  return mirror;
}

ImageLandmarks mean_of(const std::vector<ImageLandmarks>& answers) {
  ImageLandmarks mean;
  for (const ImageLandmarks& one : answers)
    for (const auto& [name, point] : one) mean[name].position += point.position / static_cast<double>(answers.size());
  return mean;
}

ImageLandmarks predict(const FaceDetector& detector, const Image& image, const FaceBox& box, Care care) {
  if (care == Care::quick) return mean_of(detector.predict(image, boxes_around(box, {1.0})));
  const std::vector<double> scales = {0.94, 1.0, 1.06};
  ImageLandmarks mean = mean_of(detector.predict(image, boxes_around(box, scales)));
  const double last = image.width - 1;
  const FaceBox other{{last - box.corner.x() - box.size.x(), box.corner.y()}, box.size};
  for (const auto& [name, point] : mean_of(detector.predict(flipped(image), boxes_around(other, scales)))) {
    Eigen::Vector2d& p = mean[mirrored_landmark(name)].position;
    p = (p + Eigen::Vector2d(last - point.position.x(), point.position.y())) / 2;
  }
  return mean;
}

Landmarks put_on_surface(const ImageLandmarks& found, const FaceView& view, const Mesh& mesh) {
  Landmarks places;
  for (const auto& [name, point] : found)
    if (const auto x = back_project(view, mesh, point.position)) places[name].position = *x;
  return places;
}

}  // namespace

std::vector<ViewAngle> default_view_angles() {
  std::vector<ViewAngle> angles;
  for (const double yaw : {0.0, -15.0, 15.0, -30.0, 30.0}) angles.push_back({yaw * kRadians, 0});
  for (const double pitch : {-12.0, 12.0}) angles.push_back({0, pitch * kRadians});
  return angles;
}

std::vector<ViewCalibration> calibrate_views(FaceDetector& detector, const Mesh& reference, const Landmarks& marks,
                                             const std::vector<ViewAngle>& angles, const FaceViewOptions& options) {
  std::vector<ViewCalibration> calibrations;
  FaceBox front;
  for (const ViewAngle& angle : angles) {
    const FaceView view = look_at(reference, nullptr, {}, angle, options);
    const std::vector<DetectedFace> faces = detector.detect(view.image, {1024, false});
    ViewCalibration calibration{angle, front, {}};
    if (!faces.empty()) calibration.box = {faces[0].corner, faces[0].size};
    if (faces.empty() && calibrations.empty()) return {};
    if (calibrations.empty()) front = calibration.box;
    calibration.places =
        put_on_surface(predict(detector, view.image, calibration.box, Care::thorough), view, reference);
    std::erase_if(calibration.places, [&](const auto& place) {
      constexpr double kFarthest = 15;  // mm: farther off it is a mistake and no convention
      const auto mark = marks.find(place.first);
      return mark == marks.end() || (mark->second.position - place.second.position).norm() > kFarthest;
    });
    if (calibration.places.size() >= 20) calibrations.push_back(std::move(calibration));
  }
  return calibrations;
}

FrontCheck check_front(FaceDetector& detector, const FaceView& front, const ViewCalibration& calibration) {
  FrontCheck check;
  const FaceBox& box = calibration.box;
  for (const DetectedFace& face : detector.detect(front.image, {1024, false})) {
    const double offset = (face.corner + face.size / 2 - box.corner - box.size / 2).norm() / box.size.x();
    if (check.seen && offset >= check.offset) continue;
    check = {true, face.score, offset, face.size.x() / box.size.x()};
  }
  return check;
}

Landmarks landmarks_in_view(const FaceDetector& detector, const FaceView& view, const Mesh& mesh,
                            const ViewCalibration& calibration, const Landmarks& marks,
                            const Similarity& scan_from_head, Care care) {
  Landmarks seen = put_on_surface(predict(detector, view.image, calibration.box, care), view, mesh);
  std::erase_if(seen, [&](const auto& p) { return !calibration.places.contains(p.first); });
  for (auto& [name, point] : seen) {
    const Eigen::Vector3d offset = marks.at(name).position - calibration.places.at(name).position;
    point.position += scan_from_head.s * (scan_from_head.R * offset);
  }
  return seen;
}

Landmarks fuse_views(const std::vector<Landmarks>& views, double floor) {
  struct Places {
    std::vector<Eigen::Vector3d> points;
    double stated = 0;  // sum of deviations
  };
  std::map<std::string, Places> places;
  for (const Landmarks& view : views)
    for (const auto& [name, point] : view) {
      places[name].points.push_back(point.position);
      places[name].stated += std::max(floor, point.stddev);
    }
  Landmarks fused;
  for (const auto& [name, seen] : places) {
    const Eigen::Vector3d middle = geometric_median(seen.points);
    double squares = 0;
    for (const Eigen::Vector3d& p : seen.points) squares += (p - middle).squaredNorm();
    const double n = static_cast<double>(seen.points.size()), alike = seen.stated / n;
    const double spread = seen.points.size() > 1 ? std::sqrt(squares / (n - 1)) : 2 * alike;
    fused[name] = {middle, std::hypot(alike, spread / std::sqrt(n))};
  }
  return fused;
}

}  // namespace facewright
