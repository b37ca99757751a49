// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <string>
#include <vector>

#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/similarity.h"
#include "libregister/intake/frame_axes.h"

namespace facewright {

/// Whether a file's three axes are a right-handed system. In a left-handed one the face is its own mirror image.
enum class Handedness { automatic, right, left };
/// "auto", "right" or "left"; throws InvalidInput.
Handedness handedness_from_name(const std::string& name);

struct FrameOptions {
  double mm_per_unit = 0;                ///< > 0: given; 0: found among mm, cm, inch, m
  FileAxis up = FileAxis::automatic;     ///< where the crown points
  FileAxis front = FileAxis::automatic;  ///< where the nose points
  Handedness handedness = Handedness::automatic;
  double highest_cost = 4.0;   ///< above it nothing is called a face; 62 scans of people and busts: 1.0 to 3.6
  double least_margin = 0.35;  ///< by which the best pose must beat any other; those scans: 0.85 and more
  int threads = 1;             ///< 0 = all
};

/// One way to read a scan.
struct FrameCandidate {
  double mm_per_unit = 1;
  Similarity scan_from_head;  ///< head frame (mm) to the file's coordinates; scale of this person's face included
  double cost = 0;            ///< misfit - 2 relief + 10 bend: 1 to 3.5 for faces, more for all else
  double misfit = 0;  ///< mm: mean distance of the reference's inner face from the scan, width, height, depth fitted
  double relief = 0;  ///< correlation of depths: eyes, nose, mouth, -1..1
  double bend = 0;    ///< mean of 1 - |cosine| between the normals
  double cover = 0;   ///< share of the inner face that the scan shows
  double eye_distance = 0;  ///< of the outer corners, in the file's units
  double face_scale = 1;    ///< size of this face over the reference's
  double tilt = 0;          ///< radians between the head and the nearest axes
  FileAxis up = FileAxis::automatic, front = FileAxis::automatic;
  std::string words() const;  ///< "metres, z up, facing -y: outer eye distance 0.091 units"
};

struct FrameSummary {
  bool decided = false;
  std::string explanation;  ///< one line: what was decided, and from what
  std::string problem;      ///< why nothing was decided, the candidates, and what to do; empty if decided
  std::vector<std::string> warnings;
  std::vector<FrameCandidate> candidates;  ///< the best first, of different poses or units; at most 6
  double outward = 0;                      ///< share of the face's triangles whose winding shows outward, 0..1
  double unmirrored = -1;  ///< share of the face's triangles whose texture is seen the right way round; -1: no texture
};

/// What a scan's coordinates mean.
struct FrameDetection {
  double mm_per_unit = 1;
  Eigen::Matrix3d head_axes_from_file = Eigen::Matrix3d::Identity();  ///< signed permutation; det -1 if mirrored
  Similarity
      head_from_file;     ///< the head's pose, mm per unit included; of mirrored files the x of its result is negated
  bool mirrored = false;  ///< the file's axes are left-handed
  bool flip_triangles = false;  ///< triangles must be turned over, in converted coordinates
  FrameSummary summary;
};

/// Finds unit, up axis, facing direction, winding and handedness of a face scan from its geometry: the relief of the
/// reference face (845 or more vertices, head frame) is looked for from 504 directions and rolls in each plausible
/// unit, the best places are fitted, and the best fit must be good and far better than the next. Any pose will do; axes
/// are told to the nearest. A mirrored face looks like a face: only triangles that show inward give it away, and these
/// may as well be turned over; texture coordinates tell the two apart, without them `handedness` must be given. Poor
/// scans are a summary. The same mesh gives the same result for any number of threads. O(M) and some 1 s. Throws
/// InvalidInput for a mesh without area, or a reference without landmarks 31, 37, 46, 49 and 55.
FrameDetection detect_frame(const Mesh& mesh, const MultiresTemplate& reference, const FrameOptions& options = {});

/// What labelled landmarks tell: whether the reference's fit them better as they are or as their mirror image.
/// Automatic if fewer than 6 names are common, or neither fits twice as well as the other.
Handedness handedness_by_landmarks(const Landmarks& landmarks, const MultiresTemplate& reference);

/// Millimetres, +x the subject's left, +y up, +z out of the face, triangles outward: positions multiplied by
/// mm_per_unit and head_axes_from_file, nothing else is moved.
void convert_to_head_axes(const FrameDetection& frame, Mesh* mesh, Landmarks* landmarks = nullptr);

/// Throws InvalidInput with the problem if the frame was not decided.
void require_decided(const FrameDetection& frame);

}  // namespace facewright
