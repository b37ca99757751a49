// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/make_reference.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/surface/nearest.h"
#include "libregister/reference/mark_half.h"
#include "libregister/reference/regions.h"
#include "libregister/reference/remesh_half.h"
#include "libregister/reference/symmetrise.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

constexpr int least_landmarks = 6;      // fewer leave no more than a similarity for the start
constexpr double merge_distance = 0.8;  // mm: landmarks nearer than this share a vertex if the slit does not part them
constexpr double off_face = 3;          // mm: a landmark farther from the cropped face than this is left out

Vector3d mirrored(const Vector3d& p) { return {-p.x(), p.y(), p.z()}; }

template <class Names>
std::string listed(const Names& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void check_options(const MakeReferenceOptions& o) {
  check_vertex_count(o.vertices);
  if (!(o.radius >= 0)) throw InvalidInput("reference: the radius must not be negative");
  if (!(o.lip_gap >= 0 && o.lip_gap <= 5)) throw InvalidInput("reference: the lips' gap must lie within 0 .. 5 mm");
}

void check_landmarks(const Landmarks& given, const LandmarkSet& known) {
  if (given.empty())
    throw InvalidInput(
        "reference: the mesh has no landmarks; give a file with at least six of the ibug-68 points by "
        "their numbers, for instance the corners of eyes and mouth (37, 40, 43, 46, 49, 55) and the tip "
        "of the nose (31)");
  std::vector<std::string> names, strangers;
  for (const auto& entry : given) (known.count(entry.first) ? names : strangers).push_back(entry.first);
  if (static_cast<int>(names.size()) >= least_landmarks) return;
  throw InvalidInput(
      "reference: at least six landmarks with names of the built-in face are needed (ibug-68 numbers, "
      "names as in docs/reference.md), got " +
      std::to_string(names.size()) + (names.empty() ? "" : " (" + listed(names) + ")") +
      (strangers.empty() ? "" : "; unknown: " + listed(strangers)) +
      "; place more, for instance 37, 40, 43, 46, 31, 49, 55");
}

// The registered face on its way to a reference.
class Maker {
 public:
  Maker(const MakeReferenceOptions& options, const Progress& progress)
      : options_(options), progress_(progress), built_in_(default_reference()) {}

  MakeReferenceResult run(Mesh mesh, const Landmarks& given) {
    check_options(options_);
    check_landmarks(given, built_in_.landmarks);
    tell("registering", 0);
    if (!options_.keep_eyeballs) summary().eyeballs_removed = remove_eyeballs(mesh, given);
    registration_ = register_scan(mesh, given, built_in_, options_.registration);
    summary().registration = registration_.summary;
    if (!registration_.summary.acceptable)
      throw InvalidInput(
          "reference: the built-in face could not be laid onto the mesh: " + registration_.summary.concern +
          "is it a face, and are the landmarks in its units and in their places?");
    tell("registering", 1);
    make_symmetric();
    cut();
    mark();
    draw_to_landmarks();
    tell("meshing", 0);
    assemble(mesh_anew());
    tell("meshing", 1);
    measure();
    return std::move(result_);
  }

 private:
  MakeReferenceSummary& summary() { return result_.summary; }
  void tell(const std::string& stage, int done) const {
    if (progress_) progress_({stage, done, 1, ""});
  }

  void make_symmetric() {
    Eigen::VectorXd weights = Eigen::VectorXd::Constant(built_in_.V.rows(), 0.1);
    int off = 0;
    for (Eigen::Index v = 0; v < weights.size(); ++v)
      if (registration_.origins[static_cast<size_t>(v)] == MatchOrigin::matched)
        weights[v] = 1;
      else
        ++off;
    summary().off_mesh_percent = 100.0 * off / static_cast<double>(weights.size());
    symmetric_ = symmetrise(registration_.V, built_in_.V, built_in_.mirror, weights);
    summary().asymmetry_rms = symmetric_.rms;
    registered_ = symmetric_.head_from_scan.apply(registration_.V);
    const auto& bad = registration_.summary.landmarks_rejected;
    for (const auto& [name, point] : registration_.landmarks) {
      if (std::find(bad.begin(), bad.end(), name) != bad.end()) {
        summary().left_out[name] = "the other landmarks contradict it";
        continue;
      }
      given_[name] = point;
      given_[name].position = symmetric_.head_from_scan * point.position;
    }
    wanted_ = symmetrise(given_);
  }

  int half_vertex(const std::string& name) const {
    const auto it = built_in_.landmarks.find(name);
    if (it == built_in_.landmarks.end()) return -1;
    const int v = it->second.vertex;
    const auto found = std::find(half_.source.begin(), half_.source.end(), v);
    return found != half_.source.end() ? static_cast<int>(found - half_.source.begin()) : -1;
  }

  // The left half, cropped. Distances to the rim are told as they come out.
  void cut() {
    half_ = left_half(built_in_, symmetric_.V);
    const int tip = half_vertex("31");
    Eigen::VectorXd distance = geodesic_distances(half_, tip);
    if (options_.radius > 0) {
      double mouth = 0;
      for (int v = 0; v < half_.count(); ++v)
        if (half_.slit[static_cast<size_t>(v)]) mouth = std::max(mouth, distance[v]);
      if (options_.radius < mouth + 10) {
        std::ostringstream text;
        text << "reference: the radius of " << options_.radius << " mm cuts through the mouth, whose corners lie "
             << mouth << " mm from the tip of the nose; give at least " << std::ceil(mouth + 10);
        throw InvalidInput(text.str());
      }
      if (options_.radius < distance.maxCoeff()) {
        half_ = crop(half_, distance, options_.radius, tip);
        distance = geodesic_distances(half_, half_vertex("31"));
      }
    }
    rim_ = rim();
    summary().nearest_rim = INFINITY;
    for (const int v : rim_) {
      summary().nearest_rim = std::min(summary().nearest_rim, distance[v]);
      summary().farthest_rim = std::max(summary().farthest_rim, distance[v]);
    }
    summary().rim = describe_rim();
  }

  std::string describe_rim() const {
    constexpr double slack = 1;  // mm: fast marching on the cropped mesh sees other triangles
    const MakeReferenceSummary& s = result_.summary;
    if (options_.radius == 0) return "as far as the built-in face reaches";
    if (options_.radius <= s.nearest_rim + slack) return "at the radius asked for";
    if (options_.radius <= s.farthest_rim + slack)
      return "at the radius asked for where the built-in face reaches so far, else at its own rim";
    return "as far as the built-in face reaches, which is less than the radius asked for";
  }

  // The half's share of the outer border, from midline to midline.
  std::vector<int> rim() const {
    std::vector<int> loop = border_loop(half_), line;
    const auto inside = [&](int v) {
      return !half_.midline[static_cast<size_t>(v)] && !half_.slit[static_cast<size_t>(v)];
    };
    const size_t n = loop.size();
    for (size_t i = 0; i < n; ++i)
      if (inside(loop[i]) || inside(loop[(i + 1) % n]) || inside(loop[(i + n - 1) % n]))
        if (!half_.slit[static_cast<size_t>(loop[i])]) line.push_back(loop[i]);
    return line;
  }

  LandmarkWish wish_for(const std::string& name, const Vector3d& p) const {
    LandmarkWish wish;
    wish.position = p;
    wish.near = half_vertex(name);
    wish.on_midline = is_midline_landmark(name, p);
    wish.on_slit = wish.near >= 0 && half_.slit[static_cast<size_t>(wish.near)];
    return wish;
  }

  // Names on the left half and on the midline; the others are their mirror images.
  void mark() {
    std::vector<std::pair<std::string, LandmarkWish>> wishes;
    for (const auto& [name, point] : wanted_)
      if (point.position.x() >= 0 || mirrored_landmark(name) == name)
        wishes.emplace_back(name, wish_for(name, left_side(point.position)));
    for (const auto& [name, mark] : built_in_.landmarks) {
      if (wanted_.count(name) || built_in_.V(mark.vertex, 0) < 0) continue;
      LandmarkWish wish = wish_for(name, symmetric_.V.row(mark.vertex));
      if (wish.near >= 0) wishes.emplace_back(name, wish);
    }
    for (const int v : rim_)
      if (half_.midline[static_cast<size_t>(v)]) fixed_.push_back(v);
    if (const LipMargins lips = lip_margins(half_); !lips.upper.empty())
      fixed_.push_back(mouth_corner_ = lips.upper.back());
    for (const auto& [name, wish] : wishes) place(name, wish, wanted_.count(name) && wanted_.at(name).position.x() < 0);
  }

  static Vector3d left_side(const Vector3d& p) { return {std::abs(p.x()), p.y(), p.z()}; }

  void place(const std::string& name, const LandmarkWish& wish, bool on_right) {
    const int v = mark_on_half(half_, wish);
    const double distance = (half_.shape.row(v).transpose() - wish.position).norm();
    if (distance > off_face) {
      for (const std::string& side : {name, mirrored_landmark(name)})
        if (given_.count(side)) summary().left_out[side] = "off the reference's surface, or beyond its rim";
      return;
    }
    marks_.push_back({name, share(v), on_right, wish.position});
  }

  // Where the registration passed a given landmark by more than a millimetre, the surface is drawn towards it, so that
  // it passes at one.
  void draw_to_landmarks() {
    std::vector<SurfacePull> pulls;
    for (const Mark& m : marks_)
      if (given_.count(m.name) || given_.count(mirrored_landmark(m.name))) pulls.push_back({m.vertex, m.wanted});
    draw_surface(half_, pulls);
  }

  // A vertex that is marked already (or the corner of the mouth), if one is near enough, else v.
  int share(int v) {
    for (const int other : fixed_)
      if (other == v || (!parted(v, other) && (half_.shape.row(v) - half_.shape.row(other)).norm() < merge_distance))
        return other;
    fixed_.push_back(v);
    return v;
  }

  // Points of the two lips may touch and are not the same; their margins meet in the corner.
  bool parted(int a, int b) const {
    if (!options_.mouth_slit || a == mouth_corner_ || b == mouth_corner_) return false;
    return half_.slit[static_cast<size_t>(a)] || half_.slit[static_cast<size_t>(b)];
  }

  RemeshedHalf mesh_anew() {
    if (!options_.mouth_slit) {
      half_ = close_mouth(half_);
      half_.slit.assign(half_.slit.size(), false);
    }
    RemeshedHalf remeshed = remesh_half(half_, fixed_, {options_.vertices, RemeshOptions{}.rounds});
    part_lips(remeshed.half, options_.lip_gap);
    return remeshed;
  }

  void assemble(const RemeshedHalf& remeshed) {
    const MirroredFace whole = mirror_half(remeshed.half);
    ReferenceFace& face = result_.face;
    face.mesh.V = whole.V;
    face.mesh.F = whole.F;
    face.mirror = whole.mirror;
    for (const Mark& m : marks_) {
      const auto place = static_cast<size_t>(std::find(fixed_.begin(), fixed_.end(), m.vertex) - fixed_.begin());
      const int left = whole.left[static_cast<size_t>(remeshed.vertices_of[place])];
      const int own = m.on_right ? face.mirror[static_cast<size_t>(left)] : left;
      const std::string twin = mirrored_landmark(m.name);
      face.landmarks[m.name] = mark_vertex(face.mesh.F, own);
      if (twin != m.name) face.landmarks[twin] = mark_vertex(face.mesh.F, face.mirror[static_cast<size_t>(own)]);
      for (const std::string& name : {m.name, twin})
        if (!given_.count(name)) face.derived.insert(name);
    }
    face.regions = face_regions(face.mesh, face.landmarks, face.mirror);
    const auto loops = boundary_loops(face.mesh.F);
    const char* names[] = {"rim", "mouth_slit"};
    for (size_t l = 0; l < loops.size() && l < 2; ++l) {
      std::vector<int>& region = face.regions[names[l]] = loops[l];
      std::sort(region.begin(), region.end());
    }
  }

  void measure() {
    const ReferenceFace& face = result_.face;
    const Faces& F = built_in_.levels.back().F;
    const SurfaceIndex neutral(built_in_.V, F);
    std::map<std::string, Vector3d> neutral_mark;
    for (const Mark& m : marks_) {
      const Vector3d p = half_.neutral.row(m.vertex), own = m.on_right ? mirrored(p) : p;
      neutral_mark[m.name] = own;
      if (mirrored_landmark(m.name) != m.name) neutral_mark[mirrored_landmark(m.name)] = mirrored(own);
    }
    double count = 0;
    for (const auto& [name, mark] : face.landmarks) {
      ReferenceLandmark l{name, face.derived.count(name) > 0, 0, 0};
      if (!l.derived) {
        l.symmetric_distance = (face.mesh.V.row(mark.vertex).transpose() - wanted_.at(name).position).norm();
        l.registered_distance =
            (position(neutral.nearest(neutral_mark.at(name)).where, registered_, F) - given_.at(name).position).norm();
        summary().symmetric_mean += l.symmetric_distance;
        summary().registered_mean += l.registered_distance;
        summary().symmetric_max = std::max(summary().symmetric_max, l.symmetric_distance);
        summary().registered_max = std::max(summary().registered_max, l.registered_distance);
        ++count;
      }
      summary().landmarks.push_back(l);
    }
    if (count > 0) summary().symmetric_mean /= count, summary().registered_mean /= count;
    summary().check = check_reference(face);
  }

  struct Mark {
    std::string name;
    int vertex;  // of half_
    bool on_right;
    Vector3d wanted;  // on the left half
  };

  const MakeReferenceOptions& options_;
  const Progress& progress_;
  MultiresTemplate built_in_;
  RegistrationResult registration_;
  SymmetricFace symmetric_;
  Vertices registered_;       // in the head frame, not symmetric
  Landmarks given_, wanted_;  // in the head frame: as given, and made symmetric
  HalfFace half_;
  std::vector<int> rim_;  // of half_ once it is cropped
  std::vector<Mark> marks_;
  std::vector<int> fixed_;  // vertices of half_ that stay
  int mouth_corner_ = -1;
  MakeReferenceResult result_;
};

}  // namespace

int remove_eyeballs(Mesh& mesh, const Landmarks& landmarks) {
  std::vector<Vector3d> eyes;
  for (const int first : {37, 43}) {
    Vector3d sum = Vector3d::Zero();
    int count = 0;
    for (int k = first; k < first + 6; ++k)
      if (const auto it = landmarks.find(std::to_string(k)); it != landmarks.end()) sum += it->second.position, ++count;
    if (count > 0) eyes.push_back(sum / count);
  }
  const Components parts = connected_components(mesh.V.rows(), mesh.F);
  std::vector<Eigen::AlignedBox3d> boxes(static_cast<size_t>(parts.count));
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v)
    boxes[static_cast<size_t>(parts.vertex_label[static_cast<size_t>(v)])].extend(mesh.V.row(v).transpose());
  constexpr double eye_diagonal = 55, eye_reach = 25;  // mm: an eyeball of 24 mm has a diagonal of 42
  std::vector<bool> is_eye(boxes.size(), false);
  int removed = 0;
  for (size_t p = 0; p < boxes.size(); ++p)
    for (const Vector3d& eye : eyes)
      if (!is_eye[p] && boxes[p].diagonal().norm() > 0 && boxes[p].diagonal().norm() < eye_diagonal &&
          (boxes[p].center() - eye).norm() < eye_reach)
        is_eye[p] = true, ++removed;
  if (removed == 0) return 0;
  Mesh rest;
  rest.V = mesh.V;
  std::vector<int> kept;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
    if (!is_eye[static_cast<size_t>(parts.vertex_label[static_cast<size_t>(mesh.F(f, 0))])])
      kept.push_back(static_cast<int>(f));
  rest.F = mesh.F(kept, Eigen::all);
  mesh = std::move(rest);
  return removed;
}

MakeReferenceResult make_reference(const Mesh& mesh, const Landmarks& landmarks, const MakeReferenceOptions& options,
                                   const Progress& progress) {
  return Maker(options, progress).run({mesh.V, mesh.F, {}, {}, {}}, landmarks);
}

}  // namespace facewright
