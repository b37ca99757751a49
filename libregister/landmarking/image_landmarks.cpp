// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/image_landmarks.h"

#include "libmodel/core/errors.h"

#ifdef FACEWRIGHT_HAS_DLIB
#include <dlib/image_processing.h>
#include <dlib/image_processing/frontal_face_detector.h>
#include <dlib/image_transforms.h>

#include <algorithm>
#include <cmath>
#endif

namespace facewright {

namespace fs = std::filesystem;

fs::path FaceDetector::default_predictor() { return "/usr/share/dlib/shape_predictor_68_face_landmarks.dat"; }

#ifdef FACEWRIGHT_HAS_DLIB

namespace {

using GreyImage = dlib::array2d<unsigned char>;

// Luma of BT.601, which is what dlib makes of colour images.
GreyImage grey(const Image& image) {
  GreyImage result(image.height, image.width);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* p = image.pixel(x, y);
      result[y][x] = image.channels < 3
                         ? p[0]
                         : static_cast<unsigned char>(std::lround(0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]));
    }
  return result;
}

ImageLandmarks landmarks_in(const dlib::shape_predictor& trees, const GreyImage& image, const dlib::drectangle& box) {
  const dlib::full_object_detection shape = trees(image, dlib::rectangle(box));
  ImageLandmarks landmarks;
  for (unsigned long k = 0; k < shape.num_parts(); ++k)
    landmarks[std::to_string(k + 1)].position = {static_cast<double>(shape.part(k).x()),
                                                 static_cast<double>(shape.part(k).y())};
  return landmarks;
}

}  // namespace

struct FaceDetector::Parts {
  dlib::frontal_face_detector detector;
  std::shared_ptr<const dlib::shape_predictor> predictor;
};

bool FaceDetector::available() { return true; }

FaceDetector::FaceDetector(const fs::path& predictor) : parts_(std::make_unique<Parts>()) {
  const fs::path file = predictor.empty() ? default_predictor() : predictor;
  if (!fs::is_regular_file(file))
    throw IoError(file.string(),
                  "the landmark predictor is not there; install Debian's package libdlib-data, name the file, or give "
                  "landmarks");
  try {
    dlib::shape_predictor trees;
    dlib::deserialize(file.string()) >> trees;
    if (trees.num_parts() != 68)
      throw IoError(file.string(), "predicts " + std::to_string(trees.num_parts()) + " landmarks; expected 68");
    parts_->predictor = std::make_shared<const dlib::shape_predictor>(std::move(trees));
  } catch (const dlib::serialization_error& error) {
    throw IoError(file.string(), std::string("is no landmark predictor of dlib: ") + error.what());
  }
  parts_->detector = dlib::get_frontal_face_detector();
}

std::vector<DetectedFace> FaceDetector::detect(const Image& image, const DetectFacesOptions& options) {
  if (image.empty()) throw InvalidInput("face detection: the image is empty");
  if (options.largest_side < 80) throw InvalidInput("face detection: largest_side must be at least 80 pixels");
  const GreyImage full = grey(image);
  GreyImage searched;
  double scale = std::min(1.0, static_cast<double>(options.largest_side) / std::max(image.width, image.height));
  const auto search = [&] {
    searched.set_size(std::lround(image.height * scale), std::lround(image.width * scale));
    dlib::resize_image(full, searched);
    std::vector<dlib::rect_detection> found;
    parts_->detector(searched, found, 0.0);
    return found;
  };
  std::vector<dlib::rect_detection> found = search();
  if (found.empty() && options.search_small) {
    scale *= 2;
    found = search();
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.detection_confidence > b.detection_confidence; });
  std::vector<DetectedFace> faces;
  for (const dlib::rect_detection& f : found) {
    // Pixel centres are whole numbers on both scales.
    const auto place = [&](double x) { return (x + 0.5) / scale - 0.5; };
    const dlib::drectangle box(place(static_cast<double>(f.rect.left())), place(static_cast<double>(f.rect.top())),
                               place(static_cast<double>(f.rect.right())), place(static_cast<double>(f.rect.bottom())));
    DetectedFace face;
    face.corner = {box.left(), box.top()};
    face.size = {box.width(), box.height()};
    face.score = f.detection_confidence;
    face.landmarks = landmarks_in(*parts_->predictor, full, box);
    faces.push_back(std::move(face));
  }
  return faces;
}

std::vector<ImageLandmarks> FaceDetector::predict(const Image& image, const std::vector<FaceBox>& boxes) const {
  if (image.empty()) throw InvalidInput("face landmarks: the image is empty");
  const GreyImage full = grey(image);
  std::vector<ImageLandmarks> found;
  for (const FaceBox& b : boxes) {
    const Eigen::Vector2d end = b.corner + b.size;
    found.push_back(landmarks_in(*parts_->predictor, full, {b.corner.x(), b.corner.y(), end.x(), end.y()}));
  }
  return found;
}

FaceDetector FaceDetector::copy() const { return FaceDetector(std::make_unique<Parts>(*parts_)); }

#else

struct FaceDetector::Parts {};

bool FaceDetector::available() { return false; }

FaceDetector::FaceDetector(const fs::path&) {
  throw InvalidInput(
      "face detection: this build has no dlib; give a landmark file, or install Debian's packages libdlib-dev and "
      "libdlib-data and build again");
}

std::vector<DetectedFace> FaceDetector::detect(const Image&, const DetectFacesOptions&) { return {}; }

std::vector<ImageLandmarks> FaceDetector::predict(const Image&, const std::vector<FaceBox>&) const { return {}; }

FaceDetector FaceDetector::copy() const { return FaceDetector(std::unique_ptr<Parts>{}); }

#endif

FaceDetector::FaceDetector(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
FaceDetector::~FaceDetector() = default;
FaceDetector::FaceDetector(FaceDetector&&) noexcept = default;
FaceDetector& FaceDetector::operator=(FaceDetector&&) noexcept = default;

}  // namespace facewright
