// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <limits>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/similarity.h"
#include "libregister/landmarking/face_view.h"
#include "libregister/landmarking/template_reading.h"

namespace facewright {

/// A reference bent a first time to look like a scan.
struct ReliefStart {
  BentTemplate bent;
  double likeness = -1;                                     ///< of its relief to the scan's, as relief_likeness()
  double merit = -std::numeric_limits<double>::infinity();  ///< how much like the scan and like a face, in one
};

/// Landmarks by relief alone: a reference is bent to look like a scan, from the whole face to its features.
class ReliefBending {
 public:
  /// `fine`: the reference's mesh that relief is compared with, its vertices the first of which `coarse` has too;
  /// `marks`: the reference's landmarks in the head frame. All are kept by reference. `view`: field, centre, threads.
  ReliefBending(const Mesh& scan, const Mesh& fine, const MultiresTemplate& coarse, const Landmarks& marks,
                const FaceViewOptions& view);

  /// Surfaces slide along each other and relief has likenesses, so both are asked: the pose as it is, and as the relief
  /// of the whole face lays it (lay_by_relief()). Parts of the face bend each; the one that then looks most like the
  /// scan and is most of a face's size and proportions is taken. Some 1 s.
  ReliefStart start(const Similarity& scan_from_head) const;
  /// From parts of the face to features: landmarks in the scan's place. `views`: how many sides were looked at. Throws
  /// InvalidInput if what is found is no face.
  Landmarks finish(const ReliefStart& start, int* views) const;
  /// Features near where the template has them.
  Landmarks refine(const BentTemplate& bent, int* views) const;

 private:
  struct Round;
  Landmarks compare(const BentTemplate& bent, const Round& round, int* views) const;
  Landmarks marks_on(const BentTemplate& bent) const;
  ReliefStart bend(const BentTemplate& straight) const;

  static const Round kRounds[];
  const Mesh& scan_;
  const Mesh& fine_;
  const MultiresTemplate& coarse_;
  const Landmarks& marks_;
  FaceViewOptions view_;
};

}  // namespace facewright
