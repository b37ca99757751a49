// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/intake/frame_detection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libregister/intake/face_alignment.h"
#include "libregister/intake/handedness.h"
#include "libregister/intake/relief_search.h"

namespace facewright {
namespace {

constexpr int kSamples = 24000;                              // some 4 mm apart on a head
constexpr double kCell = 10, kSmoothing = 7;                 // mm
constexpr double kSmallest = 100, kLargest = 1600;           // mm: diagonal of half a small face, of an upper body
constexpr double kLowestScale = 0.72, kHighestScale = 1.35;  // of faces over the reference, children included
constexpr int kTried = 24, kFitted = 6;
constexpr double kSure = 0.9;  // share of triangles that must agree
constexpr double kSureTexture =
    0.75;                            // noise folds single triangles; a picture used for both halves of a face gives 0.5
constexpr double kLeastCover = 0.8;  // of the inner face
constexpr double kOverrideAngle = 50 * std::numbers::pi / 180;

struct NamedUnit {
  double mm;
  const char* name;
};
constexpr NamedUnit kUnits[] = {{1, "millimetres"}, {10, "centimetres"}, {25.4, "inches"}, {1000, "metres"}};

std::string unit_name(double mm) {
  for (const NamedUnit& unit : kUnits)
    if (unit.mm == mm) return unit.name;
  char text[48];
  std::snprintf(text, sizeof text, "units of %.4g mm", mm);
  return text;
}

struct Reference {
  FaceRelief relief;
  FacePoints coarse, fine;
  double eye_distance = 0;
};

FacePoints face_points(const Mesh& face, int count, const Eigen::Vector3d& middle, double radius) {
  FacePoints points;
  points.sample = sample_surface(face.V, face.F, count);
  for (Eigen::Index i = 0; i < points.sample.P.rows(); ++i)
    points.inner.push_back((points.sample.P.row(i).transpose() - middle).norm() < radius);
  return points;
}

Reference prepare(const MultiresTemplate& t) {
  const Mesh base = t.level_mesh(0), face = t.level_mesh(t.levels.size() > 1 ? 1 : 0);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const char* name : {"31", "37", "46", "49", "55"}) {
    if (!t.landmarks.count(name)) throw InvalidInput(std::string("frame: the reference lacks landmark ") + name);
    middle += position(t.landmarks.at(name).point, base.V, base.F) / 5;
  }
  Reference reference;
  reference.eye_distance =
      (position(t.landmarks.at("37").point, base.V, base.F) - position(t.landmarks.at("46").point, base.V, base.F))
          .norm();
  const double radius = 0.65 * reference.eye_distance;  // brows, nose and mouth
  reference.relief = face_relief(sample_surface(face.V, face.F, 8000).P, kCell);
  reference.coarse = face_points(face, 250, middle, radius);
  reference.fine = face_points(face, 900, middle, radius);
  return reference;
}

// Extent that a few stray points do not change.
double robust_diagonal(const Vertices& P) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> x(P.col(k).begin(), P.col(k).end());
    const auto low = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 100);
    const auto high = x.end() - 1 - static_cast<std::ptrdiff_t>(x.size() / 100);
    std::nth_element(x.begin(), low, x.end());
    const double lowest = *low;
    std::nth_element(x.begin(), high, x.end());
    sum += (*high - lowest) * (*high - lowest);
  }
  return std::sqrt(sum);
}

double cost_of(const FaceAlignment& a) { return a.misfit - 2 * a.relief + 10 * a.bend; }

bool agrees(const Similarity& pose, const FrameOptions& o) {
  const auto fits = [](FileAxis axis, const Eigen::Vector3d& direction) {
    return axis == FileAxis::automatic || file_axis_vector(axis).dot(direction) > std::cos(kOverrideAngle);
  };
  return fits(o.up, pose.R.col(1)) && fits(o.front, pose.R.col(2));
}

struct Fit {
  FrameCandidate candidate;
  FaceAlignment alignment;
};

FrameCandidate candidate_of(const FaceAlignment& a, double mm, const Reference& reference) {
  FrameCandidate c;
  c.mm_per_unit = mm;
  c.scan_from_head = {a.scan_from_face.s / mm, a.scan_from_face.R, a.scan_from_face.t / mm};
  c.cost = cost_of(a), c.misfit = a.misfit, c.relief = a.relief, c.bend = a.bend, c.cover = a.cover;
  c.eye_distance = reference.eye_distance * a.sides[0] / mm;
  c.face_scale = a.scan_from_face.s;
  const Eigen::Matrix3d Q = nearest_axis_rotation(c.scan_from_head.R);
  c.up = nearest_file_axis(Q.col(1)), c.front = nearest_file_axis(Q.col(2));
  c.tilt = Eigen::AngleAxisd(Q.transpose() * c.scan_from_head.R).angle();
  return c;
}

bool same_reading(const FrameCandidate& a, const FrameCandidate& b, double face_width) {
  const double cosine = ((a.scan_from_head.R.transpose() * b.scan_from_head.R).trace() - 1) / 2;
  const Eigen::Vector3d middle(0, -35, 50);
  return a.mm_per_unit == b.mm_per_unit && cosine > std::cos(35 * std::numbers::pi / 180) &&
         (a.scan_from_head * middle - b.scan_from_head * middle).norm() * a.mm_per_unit < face_width / 2;
}

// Fits of the face in one unit, the best first.
std::vector<Fit> fits_in_unit(SurfaceSample sample, double mm, const Reference& reference, const FrameOptions& o) {
  sample.P *= mm;
  sample.N = smooth_normals(sample, kSmoothing);
  std::vector<ReliefMatch> matches = search_relief(reference.relief, sample.P, 4 * kTried, o.threads);
  std::erase_if(matches, [&](const ReliefMatch& m) { return !agrees(m.scan_from_face, o); });
  if (matches.size() > kTried) matches.resize(kTried);
  const PointIndex index(sample.P);
  const auto align_all = [&](const FacePoints& face, const std::vector<Similarity>& starts, int iterations) {
    std::vector<FaceAlignment> list(starts.size());
    parallel_for(static_cast<int>(starts.size()), o.threads, [&](int i) {
      list[static_cast<size_t>(i)] = align_face(face, sample, index, starts[static_cast<size_t>(i)], iterations);
    });
    std::erase_if(list, [&](const FaceAlignment& a) {
      return !agrees(a.scan_from_face, o) || a.scan_from_face.s < kLowestScale || a.scan_from_face.s > kHighestScale;
    });
    std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return cost_of(a) < cost_of(b); });
    return list;
  };
  std::vector<Similarity> starts;
  for (const ReliefMatch& match : matches) starts.push_back(match.scan_from_face);
  std::vector<FaceAlignment> rough = align_all(reference.coarse, starts, 12);
  if (rough.size() > kFitted) rough.resize(kFitted);
  starts.clear();
  for (const FaceAlignment& a : rough) starts.push_back(a.scan_from_face);
  std::vector<Fit> fits;
  for (const FaceAlignment& a : align_all(reference.fine, starts, 30))
    fits.push_back({candidate_of(a, mm, reference), a});
  return fits;
}

std::vector<Fit> distinct(std::vector<Fit> fits, double face_width) {
  std::stable_sort(fits.begin(), fits.end(),
                   [](const Fit& a, const Fit& b) { return a.candidate.cost < b.candidate.cost; });
  std::vector<Fit> kept;
  for (const Fit& fit : fits) {
    const auto known = [&](const Fit& k) { return same_reading(k.candidate, fit.candidate, face_width); };
    if (kept.size() < kFitted && std::none_of(kept.begin(), kept.end(), known)) kept.push_back(fit);
  }
  return kept;
}

std::vector<double> plausible_units(double diagonal, const FrameOptions& o) {
  if (o.mm_per_unit > 0) return {o.mm_per_unit};
  std::vector<double> list;
  for (const NamedUnit& unit : kUnits)
    if (diagonal * unit.mm >= kSmallest && diagonal * unit.mm <= kLargest) list.push_back(unit.mm);
  return list;
}

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

std::string listed(const std::vector<Fit>& fits, double highest_cost) {
  std::string text;
  for (size_t i = 0; i < fits.size() && i < 3; ++i)
    if (i == 0 || fits[i].candidate.cost < highest_cost)
      text += (i > 0 ? "; or " : "") + fits[i].candidate.words() + " (cost " + number(fits[i].candidate.cost) + ")";
  return text;
}

// What can be said when nothing was found: a face of a size that no unit explains, or none at all.
std::string nothing_found(const SurfaceSample& sample, double diagonal, const Reference& reference,
                          const std::vector<Fit>& fits, const FrameOptions& o) {
  std::vector<Fit> all;
  if (o.mm_per_unit <= 0)
    for (const double size : {190.0, 300.0, 450.0, 700.0})
      for (Fit& fit : fits_in_unit(sample, size / diagonal, reference, o)) all.push_back(std::move(fit));
  const std::vector<Fit> best = distinct(std::move(all), reference.eye_distance);
  if (!best.empty() && best[0].candidate.cost < o.highest_cost)
    return "the mesh is " + number(diagonal) +
           " units across, which is a face's size in none of mm, cm, inches and m; but its shape is a face's, with the "
           "outer eye corners " +
           number(best[0].candidate.eye_distance) + " units apart, so that one unit would be some " +
           number(best[0].candidate.mm_per_unit / best[0].candidate.face_scale) +
           " mm. Scale the scan to millimetres, or give its --units";
  const std::string nearest = fits.empty() ? "" : "; nearest to one: " + listed(fits, 0);
  return "no whole face was found in the mesh of " + number(diagonal) + " units across" + nearest +
         ". Check that the scan shows a face from brows to chin, cut away what is none, or give --units, --up and "
         "--front, or landmarks";
}

// What the geometry tells against the up and front that were given; nothing if it does not, or none were given.
std::string contradiction(const SurfaceSample& sample, const std::vector<double>& units, const std::vector<Fit>& given,
                          const Reference& reference, const FrameOptions& o) {
  if (o.up == FileAxis::automatic && o.front == FileAxis::automatic) return {};
  FrameOptions free = o;
  free.up = free.front = FileAxis::automatic;
  std::vector<Fit> all;
  for (const double mm : given.empty() ? units : std::vector<double>{given[0].candidate.mm_per_unit})
    for (Fit& fit : fits_in_unit(sample, mm, reference, free)) all.push_back(std::move(fit));
  const std::vector<Fit> fits = distinct(std::move(all), reference.eye_distance);
  if (fits.empty() || fits[0].candidate.cost > o.highest_cost) return {};
  const FrameCandidate& better = fits[0].candidate;
  if (!given.empty() && (better.cost > given[0].candidate.cost - o.least_margin ||
                         same_reading(better, given[0].candidate, reference.eye_distance)))
    return {};
  return "--up and --front leave out what the geometry tells: " + better.words() + " (cost " + number(better.cost) +
         (given.empty() ? "" : " against " + number(given[0].candidate.cost)) + "); check them";
}

void decide_sides(const SurfaceSides& sides, const FrameOptions& o, FrameDetection* d) {
  FrameSummary& s = d->summary;
  s.outward = sides.outward, s.unmirrored = sides.unmirrored;
  if (sides.outward > 1 - kSure && sides.outward < kSure)
    s.warnings.push_back("the winding of " + number(100 * (1 - sides.outward)) +
                         " % of the face's triangles is turned over");
  const bool shows_inward = sides.outward < 0.5;
  if (o.handedness != Handedness::automatic) {
    d->mirrored = o.handedness == Handedness::left;
  } else if (shows_inward) {
    if (sides.unmirrored >= kSureTexture) {
      d->mirrored = false;  // seen from outside, the picture is the right way round: only the triangles are wrong
    } else if (sides.unmirrored >= 0 && sides.unmirrored <= 1 - kSureTexture) {
      d->mirrored = true;
    } else {
      s.problem =
          "the triangles show inward, which has two causes that the geometry cannot tell apart: the triangles are "
          "turned "
          "over, or the axes are left-handed and the face is its mirror image (a scar or parting is then on the wrong "
          "side). Look at the scan: if it shows the person as they are, give --handedness right, if mirrored "
          "--handedness left";
    }
  } else if (sides.unmirrored >= 0 && sides.unmirrored <= 1 - kSureTexture) {
    s.warnings.push_back(
        "the texture lies mirrored on the face: its coordinates run downwards, or the scan is a mirror image with its "
        "triangles turned over (then give --handedness left)");
  }
  // Negating an axis turns the triangles over by itself.
  d->flip_triangles = shows_inward != d->mirrored;
}

std::string explanation(const FrameDetection& d) {
  const FrameCandidate& c = d.summary.candidates.front();
  std::string text = c.words();
  if (c.tilt > 15 * std::numbers::pi / 180)
    text += ", turned " + number(c.tilt * 180 / std::numbers::pi) + " degrees from the axes";
  if (d.mirrored) text += ", left-handed axes: mirrored back";
  if (d.summary.outward < 0.5 && !d.mirrored) text += ", triangles turned outward";
  return text;
}

}  // namespace

Handedness handedness_from_name(const std::string& name) {
  if (name == "auto") return Handedness::automatic;
  if (name == "right") return Handedness::right;
  if (name == "left") return Handedness::left;
  throw InvalidInput("handedness: expected auto, right or left, got '" + name + "'");
}

std::string FrameCandidate::words() const {
  return unit_name(mm_per_unit) + ", " + file_axis_name(up) + " up, facing " + file_axis_name(front) +
         ": outer eye distance " + number(eye_distance) + " units";
}

Handedness handedness_by_landmarks(const Landmarks& landmarks, const MultiresTemplate& reference) {
  const Mesh base = reference.level_mesh(0);
  const Landmarks ours = locate(reference.landmarks, base.V, base.F);
  const std::vector<std::string> names = common_names(landmarks, ours);
  if (names.size() < 6) return Handedness::automatic;
  Vertices A(static_cast<Eigen::Index>(names.size()), 3), B(A.rows(), 3);
  for (Eigen::Index i = 0; i < A.rows(); ++i) {
    A.row(i) = ours.at(names[static_cast<size_t>(i)]).position.transpose();
    B.row(i) = landmarks.at(names[static_cast<size_t>(i)]).position.transpose();
  }
  const double right = (fit_similarity(A, B).apply(A) - B).norm();
  A.col(0) *= -1;
  const double left = (fit_similarity(A, B).apply(A) - B).norm();
  if (2 * right < left) return Handedness::right;
  return 2 * left < right ? Handedness::left : Handedness::automatic;
}

FrameDetection detect_frame(const Mesh& mesh, const MultiresTemplate& t, const FrameOptions& options) {
  const Reference reference = prepare(t);
  const SurfaceSample sample = sample_surface(mesh.V, mesh.F, kSamples);
  if (sample.P.rows() < 100) throw InvalidInput("frame: the mesh has no area");
  FrameDetection d;
  FrameSummary& s = d.summary;
  const double diagonal = robust_diagonal(sample.P);
  const std::vector<double> units = plausible_units(diagonal, options);
  std::vector<Fit> all;
  for (const double mm : units)
    for (Fit& fit : fits_in_unit(sample, mm, reference, options)) all.push_back(std::move(fit));
  const std::vector<Fit> fits = distinct(std::move(all), reference.eye_distance);
  for (const Fit& fit : fits) s.candidates.push_back(fit.candidate);
  if (fits.empty() || fits[0].candidate.cost > options.highest_cost || fits[0].candidate.cover < kLeastCover) {
    s.problem = nothing_found(sample, diagonal, reference, fits, options);
    const std::string told = contradiction(sample, units, fits, reference, options);
    if (!told.empty()) s.problem += ". " + told;
    return d;
  }
  const Fit& best = fits.front();
  if (fits.size() > 1 && fits[1].candidate.cost - best.candidate.cost < options.least_margin) {
    s.problem = "ambiguous: " + listed(fits, options.highest_cost) +
                ". Give --units, --up and --front, or landmarks; if the scan shows two faces, cut it";
    return d;
  }
  const std::string told = contradiction(sample, units, fits, reference, options);
  if (!told.empty()) s.warnings.push_back(told);
  d.mm_per_unit = best.candidate.mm_per_unit;
  decide_sides(surface_sides(mesh, sample, best.alignment), options, &d);
  const Eigen::Matrix3d Q = nearest_axis_rotation(best.candidate.scan_from_head.R);
  const Eigen::Vector3d mirror(d.mirrored ? -1 : 1, 1, 1);
  d.head_axes_from_file = mirror.asDiagonal() * Q.transpose();
  d.head_from_file = best.candidate.scan_from_head.inverse();
  s.explanation = explanation(d);
  s.decided = s.problem.empty();
  if (!s.decided) s.problem = best.candidate.words() + "; but " + s.problem;
  return d;
}

void convert_to_head_axes(const FrameDetection& frame, Mesh* mesh, Landmarks* landmarks) {
  const Eigen::Matrix3d A = frame.mm_per_unit * frame.head_axes_from_file;
  mesh->V = (mesh->V * A.transpose()).eval();
  if (frame.flip_triangles) {
    mesh->F.col(1).swap(mesh->F.col(2));
    if (mesh->uv_faces.rows() > 0) mesh->uv_faces.col(1).swap(mesh->uv_faces.col(2));
  }
  if (!landmarks) return;
  for (auto& entry : *landmarks) {
    entry.second.position = A * entry.second.position;
    entry.second.stddev *= frame.mm_per_unit;
  }
}

void require_decided(const FrameDetection& frame) {
  if (!frame.summary.decided) throw InvalidInput("frame: " + frame.summary.problem);
}

}  // namespace facewright
