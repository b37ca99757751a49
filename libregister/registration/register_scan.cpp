// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/register_scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/core/stage_clock.h"
#include "libmodel/core/topology.h"
#include "libmodel/geometry/folds.h"

namespace facewright {
namespace {

double geometric(double first, double last, int i, int n) {
  return n <= 1 ? last : first * std::pow(last / first, static_cast<double>(i) / (n - 1));
}

std::vector<LandmarkTarget> landmark_targets(const MultiresTemplate& reference, const GlobalMapResult& map,
                                             double stddev) {
  std::vector<LandmarkTarget> targets;
  for (const std::string& name : map.alignment.used) {
    if (std::find(map.dropped.begin(), map.dropped.end(), name) != map.dropped.end()) continue;
    const auto& mark = reference.landmarks.at(name);
    const auto& point = map.alignment.landmarks.at(name);
    const double factor = map.data.empty() ? 1 : map.smoothness.noise;  // the noise found, if it was looked for
    if (mark.vertex >= 0)
      targets.push_back({mark.vertex, point.position, factor * (point.stddev > 0 ? point.stddev : stddev)});
  }
  return targets;
}

// One scan on its way through the levels.
class Registration {
 public:
  Registration(const MultiresTemplate& reference, const MatchTarget& target, const RegisterOptions& options,
               std::vector<LandmarkTarget> landmarks)
      : reference_(reference), target_(target), options_(options), landmarks_(std::move(landmarks)) {}

  const LevelSchedule& schedule(int level) const {
    return options_.levels[std::min(static_cast<size_t>(level), options_.levels.size() - 1)];
  }

  Correspondence run_level(int level, Vertices& V) const { return run_level(level, schedule(level), V); }

  Correspondence run_level(int level, const LevelSchedule& s, Vertices& V) const {
    const Faces& F = reference_.levels[static_cast<size_t>(level)].F;
    const std::vector<Stitch> stitches = seam_stitches(reference_, level);
    Vertices rest = V;
    Correspondence matches;
    ConformWorkspace workspace;
    for (int i = 0; i < s.iterations; ++i) {
      matches = match_locally(V, F, reference_.mirror, target_, match_options(s, i));
      ConformOptions c;
      c.smoothing_length = geometric(s.smoothing_first, s.smoothing_last, i, s.iterations);
      c.landmark_weight = s.landmark_weight;
      V = conform(rest, F, matches, landmarks_, c, stitches, &workspace).V;
      if (s.move_rest) rest = V;
    }
    return matches;
  }

 private:
  MatchOptions match_options(const LevelSchedule& s, int i) const {
    MatchOptions m;
    m.highest_distance = s.highest_distance;
    m.highest_angle = s.highest_angle_deg * std::numbers::pi / 180;
    m.welsch_width = geometric(s.welsch_first, s.welsch_last, i, s.iterations);
    m.use_mirror = options_.use_mirror;
    m.to_vertices = options_.match_vertices;
    return m;
  }

  const MultiresTemplate& reference_;
  const MatchTarget& target_;
  const RegisterOptions& options_;
  std::vector<LandmarkTarget> landmarks_;
};

std::optional<SymmetryPlane> plane_of(const MultiresTemplate& reference) {
  if (reference.mirror.empty()) return {};
  return symmetry_plane(reference.V, reference.mirror);
}

// What the guide saw, as displacements of the reference in its own frame.
std::vector<SplineDatum> guide_data(const std::vector<GuideObservation>& observations,
                                    const MultiresTemplate& reference, const GlobalMapResult& map) {
  const Similarity& S = map.alignment.scan_from_reference;
  std::vector<SplineDatum> data;
  for (const GuideObservation& o : observations) {
    const Eigen::Vector3d x = reference.V.row(o.vertex), u = S.R.transpose() * o.direction;
    data.push_back({x, u, (o.value - o.direction.dot(S.t)) / S.s - u.dot(x), o.stddev / S.s / map.smoothness.noise});
  }
  return data;
}

// Conforms levels first .. last in turn. `mapped` (N x 3) is the reference in the scan's place: a level starts from it,
// moved as the level before has moved, so that what the reference knows of detail is kept.
template <class AfterLevel>
Correspondence run_levels(const MultiresTemplate& reference, const Registration& registration, const Vertices& mapped,
                          int first, int last, Vertices* V, const AfterLevel& after) {
  Correspondence matches;
  for (int level = first; level <= last; ++level) {
    const TemplateLevel& l = reference.levels[static_cast<size_t>(level)];
    if (level == first) {
      *V = mapped.topRows(l.vertex_count);
    } else {
      const Vertices moved = *V - mapped.topRows(V->rows());
      *V = mapped.topRows(l.vertex_count) + refine_positions(reference, moved, l.vertex_count);
    }
    matches = registration.run_level(level, *V);
    after(level, l);
  }
  return matches;
}

// The reference's vertices, mapped by landmarks and by places found by their colour. Rounds: the coarse levels lay the
// face on the scan, the guide looks where its places are, and the spline is fitted again.
Vertices guided_map(const MultiresTemplate& reference, const Registration& registration, const AppearanceGuide& guide,
                    const GlobalMapResult& map, const SymmetryPlane* plane, const MatchTarget& target,
                    const RegisterOptions& options, int* guided) {
  const int level = std::max(0, guide.level() - 1);
  const Eigen::Index count = reference.levels[static_cast<size_t>(level)].vertex_count, n = guide.vertex_count();
  Vertices V, mapped = map.V;
  run_levels(reference, registration, mapped, 0, level, &V, [](int, const TemplateLevel&) {});
  LevelSchedule settle = registration.schedule(level);
  settle.iterations = 1;
  std::vector<SplineDatum> data;
  for (int round = 0; round < options.guide_rounds; ++round) {
    if (round > 0) {
      mapped = map_with_data(map, plane, data, reference.V.topRows(n));
      V = mapped.topRows(count);
      registration.run_level(level, settle, V);
    }
    const Vertices moved = V - mapped.topRows(count);
    const Vertices fine = mapped.topRows(n) + refine_positions(reference, moved, static_cast<int>(n));
    data = guide_data(guide.observe(fine, target), reference, map);
  }
  *guided = static_cast<int>(data.size());
  return map_with_data(map, plane, data, reference.V);
}

void describe_alignment(const GlobalMapResult& map, RegisterSummary* s) {
  s->scale = map.alignment.scan_from_reference.s;
  s->landmarks_used = static_cast<int>(map.alignment.used.size() - map.dropped.size());
  s->landmarks_rejected = map.alignment.rejected;
  s->landmarks_rejected.insert(s->landmarks_rejected.end(), map.dropped.begin(), map.dropped.end());
  s->swapped_left_right = map.alignment.swapped_left_right;
  s->landmark_noise = map.landmark_noise;
  s->leave_one_out_rms = map.leave_one_out_rms;
}

void describe_matches(const Correspondence& m, RegistrationResult* r) {
  RegisterSummary& s = r->summary;
  s.matched = m.count(MatchOrigin::matched);
  s.mirrored = m.count(MatchOrigin::mirrored);
  s.interpolated = m.count(MatchOrigin::interpolated);
  s.free = m.count(MatchOrigin::free);
  for (const MatchStatus status : m.status) ++s.match_status[static_cast<size_t>(status)];
  r->origins = m.origins;
  r->visibility = m.weights;
  for (Eigen::Index i = 0; i < r->visibility.size(); ++i)
    if (m.origins[static_cast<size_t>(i)] != MatchOrigin::matched) r->visibility[i] = 0;
}

void measure(const MatchTarget& target, const Faces& F, const std::vector<LandmarkTarget>& landmarks,
             RegistrationResult* r) {
  RegisterSummary& s = r->summary;
  r->nearest = target.index().nearest(r->V);
  std::vector<double> d;
  for (size_t i = 0; i < r->nearest.size(); ++i)
    if (r->origins[i] == MatchOrigin::matched) d.push_back(r->nearest[i].distance);
  if (!d.empty()) {
    std::sort(d.begin(), d.end());
    for (const double x : d) s.surface_mean += x / static_cast<double>(d.size());
    s.surface_p95 = d[static_cast<size_t>(0.95 * static_cast<double>(d.size() - 1))];
  }
  for (const auto& k : landmarks) {
    const double e = (r->V.row(k.vertex).transpose() - k.position).norm();
    s.landmark_mean += e / static_cast<double>(landmarks.size());
    s.landmark_max = std::max(s.landmark_max, e);
  }
  const auto edge_list = edges(F);
  s.folds = static_cast<int>(folded_edges(r->V, F, edge_list).size());
  s.fold_percent = 100.0 * s.folds / static_cast<double>(edge_list.size());
}

void judge(RegistrationResult* r) {
  RegisterSummary& s = r->summary;
  std::ostringstream why;
  const double n = static_cast<double>(r->V.rows());
  if (s.matched < 0.6 * n)
    why << "only " << std::lround(100 * s.matched / n) << " % of the vertices found the scan's surface; ";
  if (s.mirrored > 0.15 * n) why << std::lround(100 * s.mirrored / n) << " % of the vertices were mirrored; ";
  if (s.fold_percent > 0.5) why << s.fold_percent << " % of the edges are folded; ";
  s.concern = why.str();
  s.acceptable = s.concern.empty();
}

void check(const Mesh& scan, const MultiresTemplate& reference, const RegisterOptions& options) {
  validate(scan);
  if (scan.F.rows() < 100)
    throw InvalidInput("registration: the scan has " + std::to_string(scan.F.rows()) +
                       " triangles; a face scan has thousands");
  if (reference.levels.empty()) throw InvalidInput("registration: the reference has no levels");
  if (options.levels.empty()) throw InvalidInput("registration: the schedule has no levels");
  if (!(options.landmark_stddev > 0)) throw InvalidInput("registration: landmark_stddev must be positive");
}

}  // namespace

std::vector<LevelSchedule> default_schedule() {
  return {{4, 6, 3, 8, 4, 20, 65, 0.3, false},
          {4, 4, 2, 4, 2, 8, 65, 0.1, false},
          {4, 3, 1, 4, 1, 8, 65, 0.03, false},
          {4, 1, 0.7, 1, 1, 4, 65, 0.01, true}};
}

RegistrationResult register_scan(const Mesh& scan, const Landmarks& landmarks, const MultiresTemplate& reference,
                                 const RegisterOptions& options, const AppearanceGuide* guide) {
  check(scan, reference, options);
  RegistrationResult result;
  StageClock clock(&result.summary.seconds);
  DenoiseResult clean = denoise(scan, options.denoise);
  result.summary.denoise = clean.summary;
  result.denoised = clean.mesh;
  clock.finish("denoise");
  const Mesh base = reference.level_mesh(0);
  GlobalMapOptions global = options.global;
  global.landmark_stddev = options.landmark_stddev;
  const std::optional<SymmetryPlane> symmetry = plane_of(reference);
  const SymmetryPlane* plane = symmetry ? &*symmetry : nullptr;
  const GlobalMapResult map =
      global_mapping(reference.V, plane, locate(reference.landmarks, base.V, base.F), landmarks, global, options.align);
  describe_alignment(map, &result.summary);
  result.landmarks = map.alignment.landmarks;
  const std::vector<LandmarkTarget> pulls = landmark_targets(reference, map, options.landmark_stddev);
  clock.finish("global mapping");
  const MatchTarget target(std::move(clean.mesh), std::move(clean.reliability));
  const Registration registration(reference, target, options, pulls);
  const auto keep = [&](const std::string& name, const Vertices& V, const Faces& F) {
    if (options.keep_stages) result.stages.push_back({name, {V, F, {}, {}, {}}});
  };
  keep("global", map.V.topRows(base.V.rows()), base.F);
  clock.finish("search structures");
  const int last = static_cast<int>(reference.levels.size()) - 1;
  int first = 0;
  Vertices mapped = map.V;
  if (guide && !guide->empty() && !map.data.empty() && target.mesh().has_colours()) {
    mapped = guided_map(reference, registration, *guide, map, plane, target, options, &result.summary.guided);
    first = std::min(guide->level(), last);  // the coarser levels have done their part
    keep("guided", mapped.topRows(base.V.rows()), base.F);
    clock.finish("colour guide");
  }
  const Correspondence matches =
      run_levels(reference, registration, mapped, first, last, &result.V, [&](int level, const TemplateLevel& l) {
        unfold(result.V, l.F);
        keep("level" + std::to_string(level), result.V, l.F);
        clock.finish("level " + std::to_string(level));
      });
  describe_matches(matches, &result);
  measure(target, reference.levels.back().F, pulls, &result);
  judge(&result);
  clock.finish("measuring");
  return result;
}

}  // namespace facewright
