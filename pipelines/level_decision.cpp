// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/level_decision.h"

#include <algorithm>
#include <atomic>
#include <new>
#include <nlohmann/json.hpp>

#include "libmodel/building/procrustes.h"
#include "libmodel/core/errors.h"
#include "libmodel/core/parallel.h"
#include "libregister/reference/regions.h"
#include "libregister/reference/symmetrise.h"
#include "libregister/registration/register_scan.h"
#include "libregister/subdivision/deviation.h"
#include "pipelines/drawing.h"
#include "pipelines/hierarchy_file.h"
#include "pipelines/matrix_hash.h"
#include "pipelines/scan_colours.h"
#include "pipelines/scan_stage.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kFaces = 6;       // more change the deviation left by less than 3 % (docs/subdivision.md)
constexpr size_t kLeastFaces = 3;  // fewer say more about themselves than about faces
constexpr int kEnoughVertices = 60000;
constexpr int kRounds = 1;          // a second sharpens the appearance no further (docs/registration.md)
constexpr double kLeastSeen = 0.5;  // share of the vertices, by all scans; our choice

// Base mesh, its second step, and a uniform mesh about as fine as the finest level.
MultiresTemplate uniform_template(const ReferenceFace& face, const std::vector<int>& levels) {
  const double enough = std::min(0.9 * levels.back(), 1.0 * kEnoughVertices);
  FourEightMesh mesh = tri_quad_mesh(face.mesh, face.mirror, levels.front());
  mesh.uniform_step();
  int steps = 0;
  for (; steps < 2 || mesh.vertex_count() < enough; ++steps) mesh.uniform_step();
  MultiresTemplate t = uniform_hierarchy(face.mesh, face.mirror, face.landmarks, levels.front(), {2, steps});
  t.regions = template_regions(t, face.regions);
  return t;
}

// Shape matters here, not correspondence: few iterations on the coarse levels, one on the finest.
RegisterOptions coarse_registration(RegisterOptions options) {
  const std::vector<LevelSchedule> usual = default_schedule();
  options.levels = {usual.at(0), usual.at(1), usual.at(2)};
  const int iterations[] = {3, 2, 1};
  for (size_t l = 0; l < 3; ++l) options.levels[l].iterations = iterations[l];
  options.keep_stages = false;
  return options;
}

// Those with landmarks, in an order that other files in the folder cannot change.
std::vector<ScanFiles> drawn_scans(std::vector<ScanFiles> files) {
  std::erase_if(files, [](const ScanFiles& f) { return !f.landmarks; });
  std::vector<std::string> ids;
  for (const ScanFiles& f : files) ids.push_back(f.id);
  std::vector<ScanFiles> drawn;
  for (const size_t i : drawing_order(ids)) drawn.push_back(files[i]);
  return drawn;
}

struct CoarseFaces {
  std::vector<Vertices> faces;
  std::vector<std::vector<MatchOrigin>> origins;  // of the faces' vertices
  std::vector<Mesh> scans;                        // denoised, with colours at the vertices if the scan has any
  std::vector<Landmarks> landmarks;
  std::vector<std::string> ids, left_out;
};

void register_coarsely(const std::vector<ScanFiles>& files, const MultiresTemplate& reference,
                       const BuildPipelineOptions& options, const Progress& progress, CoarseFaces* result) {
  std::vector<Vertices> faces(files.size());
  std::vector<std::vector<MatchOrigin>> origins(files.size());
  std::vector<Mesh> scans(files.size());
  std::vector<Landmarks> landmarks(files.size());
  std::atomic<int> done{0};
  const int total = static_cast<int>(files.size());
  const RegisterOptions registration = coarse_registration(options.registration);
  if (progress && total > 0) progress({"deciding the levels", 0, total, ""});
  parallel_for(total, options.jobs, [&](int i) {
    const auto s = static_cast<size_t>(i);
    try {
      const Scan scan = load_scan(files[s], options.scan);
      RegistrationResult r = register_scan(mesh_with_colours(scan), scan.landmarks, reference, registration);
      if (r.summary.acceptable)
        faces[s] = r.V, origins[s] = r.origins, scans[s] = std::move(r.denoised), landmarks[s] = scan.landmarks;
    } catch (const std::bad_alloc&) {
      throw;                           // the decision must not depend on the memory there happens to be
    } catch (const std::exception&) {  // the scan's own turn will tell why
    }
    const int n = ++done;
    if (progress) progress({"deciding the levels", n, total, files[s].id});
  });
  for (size_t s = 0; s < files.size(); ++s) {
    const bool usable = faces[s].rows() > 0;
    (usable ? result->ids : result->left_out).push_back(files[s].id);
    if (usable) {
      result->faces.push_back(std::move(faces[s]));
      result->origins.push_back(std::move(origins[s]));
      result->scans.push_back(std::move(scans[s]));
      result->landmarks.push_back(std::move(landmarks[s]));
    }
  }
}

// The first of the draw that can be used: which files cannot does not change them.
CoarseFaces coarse_faces(const std::vector<ScanFiles>& files, const MultiresTemplate& reference,
                         const BuildPipelineOptions& options, const Progress& progress) {
  const std::vector<ScanFiles> drawn = drawn_scans(files);
  CoarseFaces result;
  for (size_t next = 0; next < drawn.size() && result.faces.size() < kFaces;) {
    const size_t end = std::min(drawn.size(), next + kFaces - result.faces.size());
    register_coarsely(
        {drawn.begin() + static_cast<std::ptrdiff_t>(next), drawn.begin() + static_cast<std::ptrdiff_t>(end)},
        reference, options, progress, &result);
    next = end;
  }
  return result;
}

std::string decision_key(const ReferenceFace& face, const BuildPipelineOptions& o) {
  Json j;
  j["levels"] = o.levels;
  j["criterion"] = criterion_name(o.criterion);
  j["mean_as_reference"] = o.mean_as_reference;
  j["registration"] = describe_options(o);  // the faces that decide were registered with them
  j["mirror"] = face.mirror;
  j["regions"] = face.regions;
  for (const auto& [name, mark] : face.landmarks)
    j["landmarks"][name] = {mark.vertex, mark.point.triangle, mark.point.barycentric[0], mark.point.barycentric[1]};
  return sha256(j.dump() + sha256_of(face.mesh.V) + sha256_of(face.mesh.F));
}

HierarchyOptions reference_criterion(LevelCriterion criterion) {
  HierarchyOptions hierarchy;
  if (criterion == LevelCriterion::length) hierarchy.criterion = bent_length_criterion(0);
  return hierarchy;
}

// Faces in correspondence with the hierarchy's finest level.
struct FacesInCommon {
  std::vector<Vertices> faces;
  std::vector<bool> seen_by_all;  // per vertex
};

FacesInCommon carry_over(const DeviationTable& table, const CoarseFaces& coarse, const MultiresTemplate& reference) {
  FacesInCommon common;
  Vertices matched = Vertices::Zero(coarse.faces.front().rows(), 3);
  for (const auto& origins : coarse.origins)
    for (size_t i = 0; i < origins.size(); ++i)
      if (origins[i] == MatchOrigin::matched) matched(static_cast<Eigen::Index>(i), 0) += 1;
  const Vertices count = on_hierarchy(table, matched, reference);
  for (Eigen::Index i = 0; i < count.rows(); ++i)
    common.seen_by_all.push_back(count(i, 0) == static_cast<double>(coarse.faces.size()));
  for (const Vertices& face : coarse.faces) common.faces.push_back(on_hierarchy(table, face, reference));
  return common;
}

// The mean of the faces, symmetric if the reference is, in the reference's frame. What not all scans show follows
// the rest smoothly, with the reference's own shape. Rounded, so that the file of the decision stays small. Empty if
// they show too little in common.
Vertices mean_shape(const FacesInCommon& common, const MultiresTemplate& reference, int threads) {
  SampleMatrix shapes(static_cast<Eigen::Index>(common.faces.size()), reference.V.size());
  for (size_t i = 0; i < common.faces.size(); ++i) {
    const Vertices& V = common.faces[i];
    shapes.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>(V.data(), V.size());
  }
  const std::vector<bool>& seen = common.seen_by_all;
  Eigen::VectorXd weights(reference.V.rows());
  for (Eigen::Index i = 0; i < weights.size(); ++i) weights[i] = seen[static_cast<size_t>(i)] ? 1 : 0;
  if (weights.mean() < kLeastSeen) return {};
  ProcrustesOptions options;
  options.threads = threads;
  Vertices V = generalised_procrustes(shapes, weights, reference.V, options).mean;
  if (!reference.mirror.empty()) V = symmetrise(V, reference.V, reference.mirror, weights).V;
  const Similarity mean_from_reference = fit_similarity(reference.V, V, weights);
  const Vertices moved = mean_from_reference.apply(reference.V);
  V = moved + fill_harmonic(moved, reference.levels.back().F, V - moved, seen);
  if (!reference.mirror.empty()) V = symmetrise(V, V, reference.mirror, weights).V;
  return (1e4 * V).array().round() / 1e4;
}

// What the faces' colours have in common, at the vertices of the reference's level for it. Rounded like the mean.
FaceAppearance common_appearance(const FacesInCommon& common, const std::vector<Mesh>& scans,
                                 const MultiresTemplate& reference, int threads) {
  const AppearanceSpace space(reference);
  std::vector<AppearanceFeatures> features(common.faces.size());
  std::vector<std::vector<bool>> seen(common.faces.size());
  parallel_for(static_cast<int>(common.faces.size()), threads, [&](int i) {
    const auto s = static_cast<size_t>(i);
    if (!scans[s].has_colours()) return;
    const MatchTarget target(scans[s], Eigen::VectorXd::Ones(scans[s].V.rows()));
    const AppearanceSample sample = sample_appearance(common.faces[s].topRows(space.vertex_count()), target);
    features[s] = space.features(sample);
    seen[s] = sample.seen;
  });
  std::erase_if(features, [](const AppearanceFeatures& f) { return f.rows() == 0; });
  std::erase_if(seen, [](const std::vector<bool>& b) { return b.empty(); });
  FaceAppearance a = learn_appearance(features, seen);
  a.mean = (1e4 * a.mean).array().round() / 1e4;
  a.deviation = (1e4 * a.deviation).array().round() / 1e4;
  return a;
}

// The faces' mean shape and appearance become the reference's.
void take_mean(const FacesInCommon& common, const CoarseFaces& coarse, const BuildPipelineOptions& options,
               LevelDecision* d) {
  const Vertices mean = mean_shape(common, d->reference, options.jobs);
  d->summary.mean_as_reference = mean.rows() > 0;
  if (d->summary.mean_as_reference) d->reference.V = mean;
  d->appearance = common_appearance(common, coarse.scans, d->reference, options.jobs);
}

// The same scans, registered to what they had in common so far. One that fails now keeps its face.
void register_again(const CoarseFaces& coarse, const LevelDecision& d, const BuildPipelineOptions& options,
                    FacesInCommon* common) {
  const AppearanceGuide guide(d.reference, d.appearance);
  RegisterOptions registration = coarse_registration(options.registration);
  registration.denoise.method = DenoiseMethod::none;  // they are the denoised meshes
  std::vector<std::vector<MatchOrigin>> origins(coarse.scans.size());
  parallel_for(static_cast<int>(coarse.scans.size()), options.jobs, [&](int i) {
    const auto s = static_cast<size_t>(i);
    try {
      RegistrationResult r = register_scan(coarse.scans[s], coarse.landmarks[s], d.reference, registration, &guide);
      if (r.summary.acceptable) common->faces[s] = std::move(r.V), origins[s] = std::move(r.origins);
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception&) {
    }
  });
  if (std::none_of(origins.begin(), origins.end(), [](const auto& o) { return o.empty(); }))
    common->seen_by_all.assign(common->seen_by_all.size(), true);
  for (const auto& o : origins)
    for (size_t i = 0; i < o.size(); ++i)
      if (o[i] != MatchOrigin::matched) common->seen_by_all[i] = false;
}

// Decides by some of the scans. Too few that can be registered: by the reference itself, whose shape then stands too.
void decide_by_faces(const ReferenceFace& face, const std::vector<ScanFiles>& files,
                     const BuildPipelineOptions& options, const Progress& progress, LevelDecision* d) {
  LevelDecisionSummary& s = d->summary;
  CoarseFaces coarse = coarse_faces(files, uniform_template(face, options.levels), options, progress);
  s.scans = std::move(coarse.ids);
  s.left_out = std::move(coarse.left_out);
  s.too_few_scans = coarse.faces.size() < kLeastFaces;
  if (s.too_few_scans) {
    if (s.criterion == LevelCriterion::deviation) s.criterion = LevelCriterion::bend;
    d->reference = build_template(face, options.levels, reference_criterion(s.criterion));
    return;
  }
  const FourEightMesh start = tri_quad_mesh(face.mesh, face.mirror, options.levels.front());
  const DeviationTable table = measure_deviation(start, coarse.faces);
  HierarchyOptions hierarchy = reference_criterion(s.criterion);
  if (s.criterion == LevelCriterion::deviation) hierarchy.criterion = deviation_criterion(table);
  d->reference = build_template(face, options.levels, hierarchy);
  if (!options.mean_as_reference) return;
  FacesInCommon common = carry_over(table, coarse, d->reference);
  take_mean(common, coarse, options, d);
  for (int round = 0; round < kRounds && s.mean_as_reference; ++round) {
    register_again(coarse, *d, options, &common);
    take_mean(common, coarse, options, d);
  }
}

}  // namespace

const char* criterion_name(LevelCriterion criterion) {
  switch (criterion) {
    case LevelCriterion::length:
      return "length";
    case LevelCriterion::bend:
      return "bend";
    case LevelCriterion::deviation:
      break;
  }
  return "deviation";
}

LevelDecision decide_levels(const ReferenceFace& face, const std::vector<ScanFiles>& files,
                            const BuildPipelineOptions& options, const OutputTree& tree, const Progress& progress) {
  check_budgets(static_cast<int>(face.mesh.vertex_count()), options.levels);  // before any scan is read
  const std::string key = decision_key(face, options);
  if (options.resume)
    if (auto earlier = earlier_decision(face, key, options, tree)) return *earlier;
  if (options.part.count > 0)
    throw InvalidInput(
        "build: the levels have not been decided with these options, and a part of the scans must not decide them; run "
        "until levels first, with the same options");
  LevelDecision d;
  d.summary.criterion = options.criterion;
  const bool by_faces = options.criterion == LevelCriterion::deviation || options.mean_as_reference;
  if (by_faces && options.levels.size() > 1)
    decide_by_faces(face, files, options, progress, &d);
  else
    d.reference = build_template(face, options.levels, reference_criterion(options.criterion));
  write_decision(d, key, tree);
  return d;
}

}  // namespace facewright
