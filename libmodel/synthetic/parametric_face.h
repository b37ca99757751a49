// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/synthetic/appearance.h"
#include "libmodel/synthetic/canonical_mesh.h"
#include "libmodel/synthetic/shape_parameters.h"

namespace facewright {

/// A synthetic individual: shape, individuality and asymmetry, and colours.
struct SyntheticPerson {
  Eigen::VectorXd shape;         ///< (K) shape parameters in standard deviations
  std::uint64_t field_seed = 0;  ///< of the smooth random fields
  double individuality = 0;      ///< mm rms per axis, symmetric field of 25 .. 60 mm wavelength
  double asymmetry = 0;          ///< mm rms per axis, free field of 60 .. 160 mm wavelength
  Appearance appearance;
};

/// The parametric human head. Correspondence between people is the row of the canonical mesh. Immutable and safe to
/// share between threads.
class ParametricFace {
 public:
  explicit ParametricFace(const CanonicalMeshOptions& options = {});

  const Mesh& mean() const { return canonical_.mesh; }  ///< mean shape with the mean person's colours
  const std::vector<int>& mirror() const { return canonical_.mirror; }
  const LandmarkSet& landmarks() const { return landmarks_; }
  const std::vector<ShapeParameter>& parameters() const { return parameters_; }
  /// Index of a shape parameter; throws InvalidInput for an unknown name.
  Eigen::Index parameter_index(const std::string& name) const;

  /// The mean person: all parameters zero.
  SyntheticPerson mean_person() const;
  /// Where the point p of the mean head lies on a person (head frame, mm). Smooth in p.
  Eigen::Vector3d position(const SyntheticPerson& person, const Eigen::Vector3d& p) const;
  /// The same for many points at once.
  Vertices positions(const SyntheticPerson& person, const Vertices& points, int threads = 0) const;
  /// The canonical mesh of a person, with colours. About 0.2 s.
  Mesh mesh(const SyntheticPerson& person, int threads = 0) const;
  /// Landmarks of a person.
  Landmarks locate_landmarks(const SyntheticPerson& person) const;

 private:
  CanonicalMesh canonical_;
  LandmarkSet landmarks_;
  std::vector<ShapeParameter> parameters_;
};

struct DrawOptions {
  double spread = 1;           ///< standard deviations of the shape parameters, 0 .. 2
  double individuality = 0.3;  ///< mm rms per axis, 0 .. 2
  double asymmetry = 0.3;      ///< mm rms per axis, 0 .. 2; a face and its mirror image then differ by about 0.5 mm
};

/// Person `index` of the crowd `seed`; the same whatever was drawn before. Throws InvalidInput for options out of
/// range.
SyntheticPerson draw_person(const ParametricFace& face, std::uint64_t seed, std::uint64_t index,
                            const DrawOptions& options = {});

}  // namespace facewright
