// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "libmodel/core/image.h"
#include "libmodel/core/landmarks.h"

namespace facewright {

/// A face found in an image.
struct DetectedFace {
  ImageLandmarks landmarks;      ///< ibug "1".."68", pixels
  Eigen::Vector2d corner, size;  ///< of the detector's square, pixels
  double score = 0;              ///< of the detector, larger is surer; 0 is its threshold
};

/// Where a face is looked for: a square of the detector's kind, from the brows to the chin.
struct FaceBox {
  Eigen::Vector2d corner = Eigen::Vector2d::Zero(), size = Eigen::Vector2d::Zero();  ///< pixels
};

struct DetectFacesOptions {
  int largest_side = 1024;   ///< pixels; larger images are searched for faces reduced to this, landmarks use all pixels
  bool search_small = true;  ///< look again at twice the size if nothing is found: faces down to 40 pixels
};

/// Finds faces and their 68 ibug landmarks in pictures: dlib's detector (histograms of oriented gradients, [dalal2005])
/// and its regression trees [kazemi2014]. dlib is optional when building; the trees are a file of its own, which
/// Debian's package libdlib-data installs. They were trained on the 300-W pictures, whose terms exclude commercial use:
/// see docs/landmarking.md. Costs a second to make and 50 to 600 ms an image; make one, use it for all images.
class FaceDetector {
 public:
  /// Reads the trees from `predictor`, or from where Debian puts them if that is empty. Throws InvalidInput if this
  /// build has no dlib, IoError if the file is missing or no such file; both say what to do.
  explicit FaceDetector(const std::filesystem::path& predictor = {});
  ~FaceDetector();
  FaceDetector(FaceDetector&&) noexcept;
  FaceDetector& operator=(FaceDetector&&) noexcept;

  /// All faces, the surest first. Not for use by several threads at once: copy() one for each.
  std::vector<DetectedFace> detect(const Image& image, const DetectFacesOptions& options = {});
  /// The landmarks of a face known to fill each box, one result per box. For pictures of one's own making, where it is
  /// known where the face is; what comes is a face's landmarks whether there is a face or not.
  std::vector<ImageLandmarks> predict(const Image& image, const std::vector<FaceBox>& boxes) const;
  FaceDetector copy() const;

  static bool available();                           ///< whether this build has dlib
  static std::filesystem::path default_predictor();  ///< /usr/share/dlib/shape_predictor_68_face_landmarks.dat

 private:
  struct Parts;
  explicit FaceDetector(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace facewright
