// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/landmarking/scan_landmarks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libmodel/geometry/normals.h"
#include "libregister/landmarking/coarse_pose.h"
#include "libregister/landmarking/image_landmarks.h"
#include "libregister/landmarking/landmark_checks.h"
#include "libregister/landmarking/relief_bending.h"
#include "libregister/landmarking/template_reading.h"
#include "libregister/landmarking/thin_mesh.h"
#include "libregister/landmarking/view_landmarks.h"

namespace facewright {
namespace {

constexpr double kPoseEdge = 3;                  // mm: detail that poses are found on
constexpr Eigen::Index kMostTriangles = 300000;  // of what is shown and registered; a face scan has fewer
constexpr double kFloor = 1.0;                   // mm: what the predictor gets wrong alike in all views

// The middle of the inner landmarks: eyes, nose and mouth.
Eigen::Vector3d face_centre(const Landmarks& marks) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double n = 0;
  for (const auto& [name, mark] : marks)
    if (!is_jaw_landmark(name)) sum += mark.position, ++n;
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
  std::erase_if(wanted, [](const auto& m) { return is_jaw_landmark(m.first); });
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

// One scan on its way to its landmarks.
struct Surface {
  const Mesh& mesh;            // thinned where it is too fine
  const Mesh& shown;           // what pictures are made of
  const LinearImage* texture;  // of `shown`, or nullptr
};

// Leaves the poses near one that is known, or that alone.
void keep_near(const Similarity& known, const FacePattern& pattern, double least_score,
               std::vector<CoarsePose>* poses) {
  constexpr double kAngle = 35 * std::numbers::pi / 180, kDistance = 50;  // mm
  const Eigen::Vector3d middle = pattern.V.colwise().mean().transpose();
  std::erase_if(*poses, [&](const CoarsePose& pose) {
    const Similarity& S = pose.scan_from_head;
    return Eigen::AngleAxisd(S.R.transpose() * known.R).angle() > kAngle ||
           (S * middle - known * middle).norm() > kDistance;
  });
  poses->push_back({known, least_score});
}

// A pose, and what the detector says of it; without a detector how it looks in relief.
struct Candidate {
  CoarsePose pose;
  FrontCheck front;
  ReliefStart relief;
};

}  // namespace

// What finds landmarks for a pose; another pose and better landmarks come of them.
struct ScanLandmarker::Search {
  const Parts& p;
  const Surface& surface;
  FaceViewOptions view;
  const std::vector<ViewCalibration>& calibrations;
  ReliefBending bending;

  Landmarks by_pictures(const Similarity& scan_from_head, Care care, FindLandmarksSummary* s) const {
    std::vector<Landmarks> views(calibrations.size());
    FaceViewOptions alone = view;
    alone.threads = 1;
    parallel_for(static_cast<int>(views.size()), view.threads, [&](int i) {
      const ViewCalibration& c = calibrations[static_cast<size_t>(i)];
      const FaceView seen = look_at(surface.shown, surface.texture, scan_from_head, c.angle, alone);
      views[static_cast<size_t>(i)] =
          landmarks_in_view(*p.detector, seen, surface.shown, c, p.marks, scan_from_head, care);
    });
    s->views = static_cast<int>(views.size());
    return fuse_views(views, kFloor);
  }

  // What the pictures and the relief tell together, each by its deviations.
  Landmarks by_both(const Landmarks& pictures, FindLandmarksSummary* s) const {
    int views = 0;
    const Landmarks relief = bending.refine(bend_template(p.fine.V, p.coarse, pictures), &views);
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

  // Poses in the order in which they are to be tried: where the detector sees a face first.
  std::vector<Candidate> candidates(const std::vector<CoarsePose>& poses, const PoseTarget& target,
                                    double least_score) const {
    std::vector<Candidate> list;
    for (const CoarsePose& pose : poses) {
      if (pose.score < least_score) break;
      Candidate c{straighten(pose, p.pattern, target), {}, {}};
      if (p.detector) {
        const FaceView front = look_at(surface.shown, surface.texture, c.pose.scan_from_head, {}, view);
        c.front = check_front(*p.detector, front, calibrations[0]);
        c.front.seen &= c.front.offset < 0.35 && c.front.scale > 0.65 && c.front.scale < 1.5;
      } else {
        c.relief = bending.start(c.pose.scan_from_head);
      }
      list.push_back(c);
      if (c.front.seen) break;
    }
    std::stable_sort(list.begin(), list.end(), [](const Candidate& a, const Candidate& b) {
      return a.front.seen != b.front.seen ? a.front.seen : a.relief.merit > b.relief.merit;
    });
    return list;
  }

  void read(const std::string& round, StageClock* clock, FindLandmarksResult* result) const {
    FindLandmarksSummary& s = result->summary;
    clock->finish("views " + round);
    s.detected = static_cast<int>(result->detected.size());
    const TemplateReading reading = read_off_template(surface.mesh, result->detected, p.coarse);
    result->scan_from_head = reading.scan_from_head;
    result->landmarks = reading.landmarks;
    s.dropped = reading.dropped;
    s.leave_one_out_rms = reading.leave_one_out_rms;
    s.matched = reading.matched;
    clock->finish("template " + round);
  }

  // From a pose to all landmarks, and how far they can be trusted.
  void run(const Candidate& candidate, FindLandmarksResult* result) const {
    FindLandmarksSummary& s = result->summary;
    StageClock clock(&s.seconds);
    s.method = p.detector ? "pictures" : "geometry";
    s.pose_score = candidate.pose.score;
    s.face_seen = candidate.front.seen;
    s.detector_score = candidate.front.score;
    result->scan_from_head = candidate.pose.scan_from_head;
    try {
      if (p.detector) {
        result->detected = by_pictures(result->scan_from_head, Care::quick, &s);
        read("1", &clock, result);
        result->detected = by_both(by_pictures(result->scan_from_head, Care::thorough, &s), &s);
        read("2", &clock, result);
      } else {
        s.likeness = candidate.relief.likeness;
        result->detected = bending.finish(candidate.relief, &s.views);
        read("1", &clock, result);
      }
      s.reason = landmark_failure(s);
    } catch (const InvalidInput& e) {
      s.reason = e.what();  // the landmarks are no face's
    }
    s.found = s.reason.empty();
    if (!s.found) {
      result->landmarks.clear();
      return;
    }
    s.asymmetry = landmark_asymmetry(result->landmarks);
    s.doubt = landmark_doubt(s);
    state_deviations(result->detected, &result->landmarks);
  }
};

FindLandmarksResult ScanLandmarker::find(const Mesh& mesh, const Image& texture, const FindLandmarksOptions& options) {
  validate(mesh);
  const Parts& p = *parts_;
  FindLandmarksResult result;
  FindLandmarksSummary& s = result.summary;
  StageClock clock(&s.seconds);
  s.method = p.detector ? "pictures" : "geometry";
  const bool textured = options.use_colour && mesh.has_uv() && !texture.empty();
  const bool coloured = textured || (options.use_colour && mesh.has_colours());
  const Mesh reduced = thin_mesh_to(mesh, kMostTriangles);
  Mesh thin = thin_mesh(reduced, kPoseEdge);
  Vertices normals = vertex_normals(thin.V, thin.F);
  const PoseTarget target(std::move(thin), std::move(normals));
  clock.finish("thinning");
  std::vector<CoarsePose> poses = find_coarse_poses(p.pattern, target);
  if (options.scan_from_head) keep_near(*options.scan_from_head, p.pattern, options.least_pose, &poses);
  clock.finish("pose");
  s.pose_score = poses.empty() ? 0 : poses[0].score;
  s.reason = "no face was found on the surface; check that the scan shows one and its units, or give landmarks";
  if (s.pose_score < options.least_pose) return result;
  const auto prepared = textured ? std::make_unique<LinearImage>(texture) : nullptr;
  const Surface surface{reduced, textured ? mesh : reduced, prepared.get()};
  const FaceViewOptions view = p.view_options(options);
  const Search search{p, surface, view, coloured ? p.painted : p.clay, {reduced, p.fine, p.coarse, p.marks, view}};
  std::vector<Candidate> candidates = search.candidates(poses, target, options.least_pose);
  clock.finish("detection");
  for (const Candidate& candidate : candidates) {
    FindLandmarksResult attempt;
    attempt.summary.seconds = s.seconds;
    search.run(candidate, &attempt);
    const bool first = &candidate == &candidates.front();
    if (first || attempt.summary.found) result = std::move(attempt);
    if (result.summary.found) break;
  }
  if (!options.refine && s.found) result.landmarks = result.detected;
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
