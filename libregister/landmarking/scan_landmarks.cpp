// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/scan_landmarks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/geometry/normals.h"
#include "libregister/landmarking/coarse_pose.h"
#include "libregister/landmarking/image_landmarks.h"
#include "libregister/landmarking/relief_landmarks.h"
#include "libregister/landmarking/template_reading.h"
#include "libregister/landmarking/thin_mesh.h"
#include "libregister/landmarking/view_landmarks.h"

namespace facewright {
namespace {

constexpr double kPoseEdge = 3;                  // mm: detail that poses are found on
constexpr Eigen::Index kMostTriangles = 300000;  // of what is shown and registered; a face scan has fewer
constexpr double kFloor = 1.0;                   // mm: what the predictor gets wrong alike in all views

bool is_jaw(const std::string& name) {
  return name.size() <= 2 && name.find_first_not_of("0123456789") == name.npos && std::stoi(name) <= 17;
}

// The middle of the inner landmarks: eyes, nose and mouth.
Eigen::Vector3d face_centre(const Landmarks& marks) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double n = 0;
  for (const auto& [name, mark] : marks)
    if (!is_jaw(name)) sum += mark.position, ++n;
  return sum / std::max(1.0, n);
}

}  // namespace

LandmarkMethod landmark_method_from_name(const std::string& name) {
  if (name == "auto") return LandmarkMethod::automatic;
  if (name == "dlib") return LandmarkMethod::pictures;
  if (name == "geometry") return LandmarkMethod::geometry;
  throw InvalidInput("landmark method: expected auto, dlib or geometry, got '" + name + "'");
}

struct ScanLandmarker::Parts {
  MultiresTemplate coarse;
  Landmarks marks;  // of the reference, head frame
  Mesh fine;        // of the reference: what relief is compared with
  FacePattern pattern;
  FaceViewOptions view;
  std::vector<ViewCalibration> clay, painted;  // the front first; painted: for scans with colours
  std::shared_ptr<FaceDetector> detector;      // none: geometry

  FaceViewOptions view_options(const FindLandmarksOptions& options) const {
    FaceViewOptions v = view;
    v.use_colour = options.use_colour;
    v.threads = options.threads;
    return v;
  }
};

ScanLandmarker::ScanLandmarker(const MultiresTemplate& reference, LandmarkMethod method,
                               const std::filesystem::path& predictor, const Colours& reference_colours)
    : parts_(std::make_unique<Parts>()) {
  Parts& p = *parts_;
  const int levels = static_cast<int>(reference.levels.size());
  p.coarse = coarse_levels(reference, std::min(2, levels));
  const Mesh base = reference.level_mesh(0), fine = reference.level_mesh(std::min(1, levels - 1));
  p.fine = reference.level_mesh(std::min(2, levels - 1));
  p.marks = locate(reference.landmarks, base.V, base.F);
  if (!p.marks.contains("31")) throw InvalidInput("landmarking: the reference has no landmark 31, the tip of the nose");
  p.pattern = face_pattern(fine, base, p.marks.at("31").position);
  p.view.centre = face_centre(p.marks);
  if (method == LandmarkMethod::geometry) return;
  const std::filesystem::path file = predictor.empty() ? FaceDetector::default_predictor() : predictor;
  const bool there = FaceDetector::available() && std::filesystem::is_regular_file(file);
  if (method == LandmarkMethod::automatic && !there) return;
  p.detector = std::make_shared<FaceDetector>(file);
  Landmarks wanted = p.marks;
  std::erase_if(wanted, [](const auto& m) { return is_jaw(m.first); });
  Mesh face = reference.level_mesh(levels - 1);
  p.clay = calibrate_views(*p.detector, face, wanted, default_view_angles(), p.view);
  p.painted = p.clay;
  face.colours = reference_colours;
  if (face.has_colours()) {
    auto painted = calibrate_views(*p.detector, face, wanted, default_view_angles(), p.view);
    if (!painted.empty()) p.painted = std::move(painted);
  }
  if (p.clay.empty()) {
    if (method == LandmarkMethod::pictures)
      throw InvalidInput("landmarking: the detector finds no face in a picture of the reference face");
    p.detector.reset();
  }
}

namespace {

constexpr double kRadians = std::numbers::pi / 180;

// One scan on its way to its landmarks.
struct Surface {
  const Mesh& mesh;            // thinned where it is too fine
  const Mesh& shown;           // what pictures are made of
  const LinearImage* texture;  // of `shown`, or nullptr
};

}  // namespace

// What finds landmarks for a pose; another pose and better landmarks come of them.
struct ScanLandmarker::Search {
  Parts& p;
  const Surface& surface;
  FaceViewOptions view;
  const std::vector<ViewCalibration>& calibrations;

  Landmarks by_pictures(const Similarity& scan_from_head, Care care, FindLandmarksSummary* s) const {
    std::vector<Landmarks> views;
    for (const ViewCalibration& c : calibrations) {
      const FaceView seen = look_at(surface.shown, surface.texture, scan_from_head, c.angle, view);
      views.push_back(landmarks_in_view(*p.detector, seen, surface.shown, c, p.marks, scan_from_head, care));
    }
    s->views = static_cast<int>(views.size());
    return fuse_views(views, kFloor);
  }

  Landmarks by_relief(const BentTemplate& bent, double reach, FindLandmarksSummary* s) const {
    const Mesh base{bent.V.topRows(p.coarse.base_count()), p.coarse.levels[0].F, {}, {}, {}};
    BentReference reference{{bent.V, p.fine.F, {}, {}, {}}, locate(p.coarse.landmarks, base.V, base.F)};
    FaceViewOptions millimetres = view;
    millimetres.size = static_cast<int>(view.field);
    std::vector<ViewAngle> angles;
    for (const double yaw : {0.0, -25.0, 25.0, -50.0, 50.0}) angles.push_back({yaw * kRadians, 0});
    angles.push_back({0, -25 * kRadians});  // chin and jaw from below
    PatchMatchOptions options;
    options.reach = reach;
    const std::vector<Landmarks> views =
        relief_landmarks(surface.mesh, reference, bent.scan_from_head, angles, millimetres, options);
    s->views = static_cast<int>(views.size());
    return fuse_views(views, kFloor);
  }

  // What the pictures and the relief tell together, each by its deviations.
  Landmarks by_both(const Landmarks& pictures, FindLandmarksSummary* s) const {
    const int views = s->views;
    const Landmarks relief = by_relief(bend_template(p.fine.V, p.coarse, pictures), 6, s);
    s->views += views;
    Landmarks both = pictures;
    for (const auto& [name, other] : relief) {
      const auto it = both.find(name);
      if (it == both.end()) {
        both.emplace(name, other);
        continue;
      }
      const double a = 1 / (it->second.stddev * it->second.stddev), b = 1 / (other.stddev * other.stddev);
      it->second = {(a * it->second.position + b * other.position) / (a + b), std::sqrt(1 / (a + b))};
    }
    return both;
  }

  Landmarks by_relief(const Similarity& scan_from_head, FindLandmarksSummary* s) const {
    BentTemplate bent{scan_from_head.apply(p.fine.V), scan_from_head};
    Landmarks found;
    for (const double reach : {14.0, 9.0, 6.0}) {
      found = by_relief(bent, reach, s);
      bent = bend_template(p.fine.V, p.coarse, found);
    }
    return found;
  }
};

FindLandmarksResult ScanLandmarker::find(const Mesh& mesh, const Image& texture, const FindLandmarksOptions& options) {
  validate(mesh);
  Parts& p = *parts_;
  FindLandmarksResult result;
  FindLandmarksSummary& s = result.summary;
  StageClock clock(&s.seconds);
  s.method = p.detector ? "pictures" : "geometry";
  const bool textured = options.use_colour && mesh.has_uv() && !texture.empty();
  const Mesh reduced = thin_mesh_to(mesh, kMostTriangles);
  const Mesh& shown = textured ? mesh : reduced;
  Mesh thin = thin_mesh(reduced, kPoseEdge);
  Vertices normals = vertex_normals(thin.V, thin.F);
  const PoseTarget target(std::move(thin), std::move(normals));
  clock.finish("thinning");
  std::vector<CoarsePose> poses = find_coarse_poses(p.pattern, target);
  if (poses.empty() || poses[0].score < options.least_pose) {
    s.pose_score = poses.empty() ? 0 : poses[0].score;
    s.reason = "no face was found on the surface; check that the scan shows one and its units, or give landmarks";
    return result;
  }
  clock.finish("pose");
  const auto prepared = textured ? std::make_unique<LinearImage>(texture) : nullptr;
  const LinearImage* colours = prepared.get();
  const FaceViewOptions view_options = p.view_options(options);
  const bool coloured = textured || (options.use_colour && mesh.has_colours());
  const std::vector<ViewCalibration>& calibrations = coloured ? p.painted : p.clay;
  CoarsePose pose = straighten(poses[0], p.pattern, target);
  if (p.detector) {
    for (const CoarsePose& found : poses) {
      if (found.score < options.least_pose) break;
      const CoarsePose candidate = straighten(found, p.pattern, target);
      const FaceView front = look_at(shown, colours, candidate.scan_from_head, {}, view_options);
      const FrontCheck check = check_front(*p.detector, front, calibrations[0]);
      if (!check.seen || check.offset > 0.35 || check.scale < 0.65 || check.scale > 1.5) continue;
      pose = candidate;
      s.face_seen = true;
      s.detector_score = check.score;
      break;
    }
    clock.finish("detection");
  }
  s.pose_score = pose.score;
  result.scan_from_head = pose.scan_from_head;
  const Surface surface{reduced, shown, colours};
  const Search search{p, surface, view_options, calibrations};
  for (int round = 0; round < (p.detector ? 2 : 1); ++round) {
    result.detected = p.detector
                          ? search.by_pictures(result.scan_from_head, round == 0 ? Care::quick : Care::thorough, &s)
                          : search.by_relief(result.scan_from_head, &s);
    if (p.detector && round == 1) result.detected = search.by_both(result.detected, &s);
    clock.finish("views " + std::to_string(round));
    s.detected = static_cast<int>(result.detected.size());
    const TemplateReading reading = read_off_template(reduced, result.detected, p.coarse);
    result.scan_from_head = reading.scan_from_head;
    result.landmarks = reading.landmarks;
    s.dropped = reading.dropped;
    s.leave_one_out_rms = reading.leave_one_out_rms;
    s.matched = reading.matched;
    clock.finish("template " + std::to_string(round));
  }
  if (!options.refine) result.landmarks = result.detected;
  s.found = true;
  return result;
}

ScanLandmarker ScanLandmarker::copy() const {
  auto parts = std::make_unique<Parts>(*parts_);
  if (parts->detector) parts->detector = std::make_shared<FaceDetector>(parts->detector->copy());
  return ScanLandmarker(std::move(parts));
}

bool ScanLandmarker::uses_pictures() const { return parts_->detector != nullptr; }

ScanLandmarker::ScanLandmarker(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
ScanLandmarker::~ScanLandmarker() = default;
ScanLandmarker::ScanLandmarker(ScanLandmarker&&) noexcept = default;
ScanLandmarker& ScanLandmarker::operator=(ScanLandmarker&&) noexcept = default;

}  // namespace facewright
