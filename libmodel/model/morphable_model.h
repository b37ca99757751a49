// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libmodel/core/landmarks.h"
#include "libmodel/core/mesh.h"
#include "libmodel/core/multires_template.h"
#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"
#include "libmodel/model/pca_model.h"

namespace facewright {

/// One resolution of a model: its first `vertex_count` vertices and its own triangles.
struct ModelLevel {
  int vertex_count = 0;
  Faces F;  ///< (M x 3)
  /// Places of the landmarks that are no vertices, on these triangles; the others are at their vertex.
  std::map<std::string, SurfacePoint, LandmarkNameOrder> landmark_points = {};
};

/// Occluding-contour candidates: vertices along the cheek and the jaw from ear to chin, chin left out.
struct FaceContours {
  std::vector<int> right, left;  ///< of the subject
};

/// A named expression: displacements (3N) in mm, added to a face with a weight of usually 0 to 1.
struct Blendshape {
  std::string name;
  Eigen::VectorXd displacement;
};

/// What a MorphableModel is made of; N is the vertex count of the finest level.
struct MorphableModelParts {
  PcaModel shape;                                   ///< 3N, mm, head frame
  PcaModel colour;                                  ///< 3N linear RGB; may be empty, or have a mean and no modes
  std::optional<PcaModel> expression;               ///< 3N displacements in mm, with a mean displacement
  std::vector<Blendshape> blendshapes;              ///< named expressions, names unique; may be empty
  std::vector<ModelLevel> levels;                   ///< coarse to fine, at least one; the last has N vertices
  TexCoords uv;                                     ///< (N x 2) or empty, v up
  LandmarkSet landmarks;                            ///< every mark has a vertex of level 0, the nearest at least
  std::vector<int> mirror;                          ///< (N) left-right partner, or empty
  std::vector<VertexParents> parents;               ///< of vertex N - parents.size() + i; may be empty
  Faces base_faces;                                 ///< triangles before the first of `parents`, or empty
  std::map<std::string, std::vector<int>> regions;  ///< named vertex lists ("left_contour", "right_contour", ...)
  std::map<std::string, std::string> provenance;    ///< how it was made; free text or JSON per key
};

/// A multi-resolution 3D morphable face model. Immutable and cheap to copy. Level 0 is the coarsest; level l is the
/// first n_l vertices of the finest, so positions, texture coordinates and landmark vertices are the same numbers at
/// every level. `level = -1` means the finest.
class MorphableModel {
 public:
  MorphableModel() : MorphableModel(MorphableModelParts{}, Unchecked{}) {}
  /// Throws InvalidInput unless the parts fit together.
  explicit MorphableModel(MorphableModelParts parts);
  /// For readers that have validated the statistics on the way: their numbers are not looked at again.
  struct ValidStatistics {};
  MorphableModel(MorphableModelParts parts, ValidStatistics);

  const MorphableModelParts& parts() const { return *parts_; }
  const PcaModel& shape() const { return parts_->shape; }
  const PcaModel& colour() const { return parts_->colour; }
  const std::optional<PcaModel>& expression() const { return parts_->expression; }
  const std::vector<Blendshape>& blendshapes() const { return parts_->blendshapes; }
  const std::vector<ModelLevel>& levels() const { return parts_->levels; }
  const TexCoords& uv() const { return parts_->uv; }
  const LandmarkSet& landmarks() const { return parts_->landmarks; }
  const std::vector<int>& mirror() const { return parts_->mirror; }
  const std::vector<VertexParents>& parents() const { return parts_->parents; }
  const std::map<std::string, std::vector<int>>& regions() const { return parts_->regions; }
  const std::map<std::string, std::string>& provenance() const { return parts_->provenance; }
  const Faces& base_faces() const { return parts_->base_faces; }
  /// Vertices of the mesh the levels were refined from; N if there are no parents.
  int base_vertex_count() const { return vertex_count() - static_cast<int>(parents().size()); }

  /// Companions of one level. Landmarks: places on the level's own triangles; `vertex` is -1 where none coincides.
  LandmarkSet landmarks(int level) const;
  /// The regions' vertices of the level, in their order.
  std::map<std::string, std::vector<int>> regions(int level) const;
  /// Regions "right_contour" and "left_contour" of the level; without them the vertices of landmarks 1..8 and 10..17.
  FaceContours contours(int level = -1) const;
  /// Edges with their triangles, in lexicographic order. O(M log M).
  std::vector<Edge> edge_topology(int level = -1) const { return edges(faces(level)); }

  bool empty() const { return parts_->levels.empty(); }
  bool has_colour() const { return !parts_->colour.empty(); }
  int level_count() const { return static_cast<int>(parts_->levels.size()); }
  int vertex_count(int level = -1) const { return at(level).vertex_count; }
  const Faces& faces(int level = -1) const { return at(level).F; }
  /// Index of the level with that many vertices; throws InvalidInput naming the ones there are.
  int level_with(int vertex_count) const;

  /// Meshes carry V, F, colours (clamped to 0..1) and uv of the level.
  Mesh mean(int level = -1) const;
  Mesh instance(const Eigen::VectorXd& shape_coefficients, const Eigen::VectorXd& colour_coefficients = {},
                int level = -1, const Eigen::VectorXd& expression_coefficients = {}) const;
  /// A random face: shape coefficients are drawn first, then colour, each N(0, sigma^2).
  Mesh sample(Random& random, int level = -1, double sigma = 1) const;
  /// Shape coefficients (standard deviations) of a face in correspondence and in the model's frame; V holds the
  /// vertices of any level.
  Eigen::VectorXd coefficients(const Vertices& V) const;
  /// The nearest face of the model to V, at the level V has.
  Vertices project(const Vertices& V) const;

  /// The model of one level (levels().size() == 1). Its basis is cut by rows, so that the same coefficients mean the
  /// same face, and therefore not orthonormal unless l is the finest; see PcaModel::orthonormalised.
  MorphableModel level(int l) const;
  /// Only the first `shape_modes` and `colour_modes` (-1: as many as of shape).
  MorphableModel truncated(int shape_modes, int colour_modes = -1) const;
  /// The same model with these texture coordinates (N x 2) or entries added to its provenance.
  MorphableModel with_uv(TexCoords uv) const;
  MorphableModel with_provenance(const std::map<std::string, std::string>& entries) const;

 private:
  struct Unchecked {};
  MorphableModel(MorphableModelParts parts, Unchecked)
      : parts_(std::make_shared<const MorphableModelParts>(std::move(parts))) {}
  const ModelLevel& at(int level) const;
  void check() const;

  std::shared_ptr<const MorphableModelParts> parts_;
};

/// The template's landmarks as vertices of the mesh (V, F): a mark without a vertex moves to the nearest corner of its
/// triangle, `marked_on` being the triangles the marks refer to (the template's base level).
LandmarkSet landmarks_on_vertices(const LandmarkSet& marks, const Faces& marked_on, const Faces& F);

/// Places on the triangles of level l of the template of those of its landmarks that are no vertices (carry_point).
std::map<std::string, SurfacePoint, LandmarkNameOrder> landmark_points(const MultiresTemplate& reference, int l);

}  // namespace facewright
