// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/make_reference.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <fstream>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/core/topology.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/surface/nearest.h"
#include "libmodel/synthetic/mean_head.h"
#include "libmodel/synthetic/parametric_face.h"
#include "pipelines/reference_file.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;

// The mean head turned and shifted, with its true landmarks; made symmetric again it is itself.
struct Head {
  Mesh mesh;
  Landmarks landmarks;
  Similarity scan_from_head;
};

const Head& head() {
  static const Head h = [] {
    const ParametricFace face(CanonicalMeshOptions{1.6, 4.5, 0});
    Head made;
    made.scan_from_head.R = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    made.scan_from_head.t = {30, -20, 10};
    made.mesh.V = made.scan_from_head.apply(face.mean().V);
    made.mesh.F = face.mean().F;
    for (const auto& [name, mark] : mean_head_landmarks())
      if (name.find_first_not_of("0123456789") == std::string::npos)
        made.landmarks[name].position = made.scan_from_head * mark.position;
    return made;
  }();
  return h;
}

const MakeReferenceResult& made() {
  static const MakeReferenceResult result = make_reference(head().mesh, head().landmarks);
  return result;
}

std::string failure(const Mesh& mesh, const Landmarks& landmarks, const MakeReferenceOptions& options = {}) {
  try {
    make_reference(mesh, landmarks, options);
  } catch (const InvalidInput& e) {
    return e.what();
  }
  return "";
}

TEST(MakeReference, IsSymmetricToTheLastBitAndAnAnnulusOfTheWantedCount) {
  const ReferenceFace& face = made().face;
  const ReferenceCheck& check = made().summary.check;
  EXPECT_EQ(check.vertices, 845);
  EXPECT_EQ(check.triangles, 2 * 845 - check.boundary_edges);
  EXPECT_EQ(check.euler_characteristic, 0);
  EXPECT_EQ(check.boundary_loops, 2);
  EXPECT_EQ(check.components, 1);
  EXPECT_TRUE(check.symmetric);
  EXPECT_EQ(check.largest_asymmetry, 0);
  EXPECT_EQ(find_mirror(face.mesh), face.mirror);
  EXPECT_EQ(check.self_intersections, 0);
  EXPECT_GT(check.smallest_angle_deg, 15);  // as the built-in face
  EXPECT_LT(check.sharpest_fold_deg, 90);
}

TEST(MakeReference, IsATriangulationOfItsOwn) {
  // The two lie on the same head: vertices that coincide would be taken over. Landmarks may.
  const ReferenceFace built_in = default_reference_face();
  const ReferenceFace& own = made().face;
  std::set<int> marked;
  for (const auto& [name, mark] : own.landmarks) marked.insert(mark.vertex);
  int near = 0, others = 0;
  for (int v = 0; v < own.mesh.V.rows(); ++v) {
    if (marked.count(v)) continue;
    ++others;
    near += (built_in.mesh.V.rowwise() - own.mesh.V.row(v)).rowwise().norm().minCoeff() < 0.5;  // mm, of edges of 7
  }
  std::printf("[ figures  ] %d of %d vertices without a mark within 0.5 mm of a built-in one\n", near, others);
  EXPECT_LT(near, others / 10);
  std::map<int, int> valences[2];
  for (const int i : {0, 1}) {
    const Mesh& mesh = i ? own.mesh : built_in.mesh;
    const Adjacency around = vertex_neighbours(mesh.V.rows(), mesh.F);
    for (int v = 0; v < around.size(); ++v) ++valences[i][around.degree(v)];
  }
  EXPECT_NE(valences[0], valences[1]);
}

TEST(MakeReference, MarksGivenLandmarksWhereTheyAreAndCarriesTheOthersOver) {
  const ReferenceFace& face = made().face;
  const Landmarks truth = mean_head_landmarks(), found = locate(face.landmarks, face.mesh.V, face.mesh.F);
  for (const auto& [name, mark] : face.landmarks) {
    ASSERT_GE(mark.vertex, 0) << name;
    EXPECT_EQ(face.landmarks.at(mirrored_landmark(name)).vertex, face.mirror[static_cast<size_t>(mark.vertex)]) << name;
    // The head frame is that of the mean head, up to what the registration of its other half leaves: a millimetre.
    if (!face.derived.count(name))
      EXPECT_LT((found.at(name).position - truth.at(name).position).norm(), 1.5) << name;
    else
      EXPECT_LT((found.at(name).position - truth.at(name).position).norm(), 5) << name;
  }
  EXPECT_EQ(face.landmarks.size() - face.derived.size(), 68u);
  EXPECT_LE(made().summary.symmetric_max, 1.5);
  EXPECT_TRUE(made().summary.left_out.empty());
}

TEST(MakeReference, LiesOnTheHeadItWasMadeOf) {
  const ReferenceFace& face = made().face;
  const auto& nostrils = face.regions.at("nostrils");
  double sum = 0;
  for (int v = 0; v < face.mesh.V.rows(); ++v) sum += std::abs(mean_head_distance(face.mesh.V.row(v).transpose()));
  EXPECT_LT(sum / static_cast<double>(face.mesh.V.rows()), 0.3);  // mm, the parted lips and the nostrils included
  EXPECT_FALSE(nostrils.empty());
}

TEST(MakeReference, CarriesTheLevelsOfAModelWhateverItsCount) {
  for (const int count : {600, 845, 846, 1500}) {
    MakeReferenceOptions options;
    options.vertices = count;
    const ReferenceFace face = make_reference(head().mesh, head().landmarks, options).face;
    ASSERT_EQ(face.mesh.V.rows(), count);
    const MultiresTemplate levels = build_template(face, {3448, 16759, 29587});
    ASSERT_EQ(levels.levels.size(), 4u);
    for (const TemplateLevel& level : levels.levels) {
      EXPECT_EQ(euler_characteristic(level.F), 0);
      EXPECT_EQ(level.F.rows(), 2 * level.vertex_count - boundary_edge_count(level.F));
    }
    EXPECT_EQ(levels.levels[1].vertex_count, 3448);
    EXPECT_EQ(levels.levels[3].vertex_count, 29587);
    for (int v = 0; v < levels.V.rows(); ++v)
      ASSERT_NEAR(levels.V(levels.mirror[static_cast<size_t>(v)], 0), -levels.V(v, 0), 1e-12);
  }
}

TEST(MakeReference, OfAReferenceIsNearlyThatReference) {
  const ReferenceFace& first = made().face;
  const Landmarks marks = locate(first.landmarks, first.mesh.V, first.mesh.F);
  MakeReferenceOptions options;
  options.registration.denoise.method = DenoiseMethod::none;  // a base mesh is coarse, not noisy
  const MakeReferenceResult second = make_reference(first.mesh, marks, options);
  const SurfaceIndex surface(first.mesh.V, first.mesh.F);
  double sum = 0;
  for (int v = 0; v < second.face.mesh.V.rows(); ++v)
    sum += surface.nearest(second.face.mesh.V.row(v).transpose().eval()).distance;
  EXPECT_LT(sum / static_cast<double>(second.face.mesh.V.rows()), 0.5);  // mm, of edges of 7 mm
  EXPECT_EQ(second.summary.check.euler_characteristic, 0);
}

TEST(MakeReference, TheRadiusIsTheGeodesicDistanceOfTheRim) {
  MakeReferenceOptions options;
  options.radius = 90;
  const MakeReferenceResult result = make_reference(head().mesh, head().landmarks, options);
  EXPECT_NEAR(result.summary.nearest_rim, 90, 1);  // fast marching on the cropped mesh sees other triangles
  EXPECT_NEAR(result.summary.farthest_rim, 90, 1);
  EXPECT_EQ(result.summary.rim, "at the radius asked for");
  EXPECT_EQ(result.summary.check.euler_characteristic, 0);
  EXPECT_EQ(result.face.mesh.V.rows(), 845);
  EXPECT_TRUE(result.summary.left_out.count("1"));
  EXPECT_FALSE(result.face.landmarks.count("1"));
  EXPECT_TRUE(result.face.landmarks.count("31"));
}

TEST(MakeReference, SaysWhereTheRimRunsWhenTheFaceEndsBeforeTheRadius) {
  EXPECT_THAT(made().summary.rim, HasSubstr("as far as the built-in face reaches"));
  const double middle = (made().summary.nearest_rim + made().summary.farthest_rim) / 2;
  MakeReferenceOptions options;
  options.radius = middle;
  const MakeReferenceSummary in_part = make_reference(head().mesh, head().landmarks, options).summary;
  EXPECT_LT(in_part.nearest_rim, middle - 5);
  EXPECT_NEAR(in_part.farthest_rim, middle, 1);
  EXPECT_THAT(in_part.rim, HasSubstr("else at its own rim"));
  options.radius = made().summary.farthest_rim + 20;
  EXPECT_THAT(make_reference(head().mesh, head().landmarks, options).summary.rim, HasSubstr("less than the radius"));
}

// Left and right exchanged by whoever placed them: the registration sees it, and every name changes sides.
TEST(MakeReference, ExchangedSidesAreExchangedBackForNamesWithoutPartnerToo) {
  Landmarks exchanged;
  for (const auto& [name, mark] : head().landmarks) exchanged[mirrored_landmark(name)] = mark;
  const Eigen::Vector3d scar = project_to_mean_head(mean_head_landmarks().at("left_cheek").position);
  exchanged["right_scar"].position = head().scan_from_head * scar;
  const ReferenceFace face = make_reference(head().mesh, exchanged).face;
  EXPECT_FALSE(face.derived.count("left_scar"));
  EXPECT_TRUE(face.derived.count("right_scar"));
  EXPECT_LT((face.mesh.V.row(face.landmarks.at("left_scar").vertex).transpose() - scar).norm(), 1.5);
}

TEST(MakeReference, WithoutAMouthSlitItIsADisc) {
  MakeReferenceOptions options;
  options.mouth_slit = false;
  const MakeReferenceResult result = make_reference(head().mesh, head().landmarks, options);
  EXPECT_EQ(result.summary.check.euler_characteristic, 1);
  EXPECT_EQ(result.summary.check.boundary_loops, 1);
  EXPECT_EQ(build_template(result.face, {3448}).levels[1].vertex_count, 3448);
}

TEST(MakeReference, TakesSevenLandmarksAndMarksNamesItDoesNotKnow) {
  Landmarks few;
  for (const char* name : {"37", "40", "43", "46", "31", "49", "55"}) few[name] = head().landmarks.at(name);
  few["left_scar"].position =
      head().scan_from_head * project_to_mean_head(mean_head_landmarks().at("left_cheek").position);
  const MakeReferenceResult result = make_reference(head().mesh, few);
  EXPECT_GE(result.face.derived.size(), 61u);
  EXPECT_TRUE(result.face.derived.count("9"));
  EXPECT_FALSE(result.face.derived.count("31"));
  EXPECT_FALSE(result.face.derived.count("left_scar"));
  EXPECT_TRUE(result.face.derived.count("right_scar"));
  EXPECT_LE(result.summary.symmetric_max, 1.5);
}

TEST(MakeReference, TakesEyeballsOutAndNothingElse) {
  Mesh mesh = head().mesh;
  const Eigen::Index triangles = mesh.F.rows();
  for (const int first : {37, 43}) {
    Eigen::RowVector3d eye = Eigen::RowVector3d::Zero();
    for (int k = first; k < first + 6; ++k) eye += head().landmarks.at(std::to_string(k)).position.transpose() / 6;
    const Mesh ball = icosphere(2, 12);
    const Eigen::Index n = mesh.V.rows(), m = mesh.F.rows();
    mesh.V.conservativeResize(n + ball.V.rows(), 3);
    mesh.V.bottomRows(ball.V.rows()) = ball.V.rowwise() + eye;
    mesh.F.conservativeResize(m + ball.F.rows(), 3);
    mesh.F.bottomRows(ball.F.rows()) = ball.F.array() + static_cast<int>(n);
  }
  EXPECT_EQ(remove_eyeballs(mesh, head().landmarks), 2);
  EXPECT_EQ(mesh.F.rows(), triangles);
  EXPECT_EQ(remove_eyeballs(mesh, head().landmarks), 0);
}

TEST(MakeReference, SaysWhatIsMissing) {
  EXPECT_THAT(failure(head().mesh, {}), HasSubstr("no landmarks"));
  Landmarks three;
  for (const char* name : {"31", "37", "46"}) three[name] = head().landmarks.at(name);
  EXPECT_THAT(failure(head().mesh, three), testing::AllOf(HasSubstr("at least six"), HasSubstr("31, 37, 46")));
  Landmarks strange;
  for (const auto& [name, mark] : head().landmarks) strange["p" + name] = mark;
  EXPECT_THAT(failure(head().mesh, strange), testing::AllOf(HasSubstr("unknown"), HasSubstr("p31")));
  EXPECT_THAT(failure(icosphere(4, 90), head().landmarks), HasSubstr("reference: the built-in face could not be laid"));
  MakeReferenceOptions small;
  small.radius = 30;
  EXPECT_THAT(failure(head().mesh, head().landmarks, small), HasSubstr("give at least"));
  MakeReferenceOptions none;
  none.vertices = 3;
  EXPECT_THAT(failure(head().mesh, head().landmarks, none), HasSubstr("200 .. 20000"));
}

TEST(ReferenceFile, RoundTripKeepsEverything) {
  const TemporaryDirectory folder;
  save_reference_file(folder / "face.reference", made().face);
  const ReferenceFace again = load_reference_file(folder / "face.reference");
  EXPECT_TRUE(again.mesh.V == made().face.mesh.V);
  EXPECT_TRUE(again.mesh.F == made().face.mesh.F);
  EXPECT_EQ(again.mirror, made().face.mirror);
  EXPECT_EQ(again.derived, made().face.derived);
  EXPECT_EQ(again.regions, made().face.regions);
  for (const auto& [name, mark] : made().face.landmarks)
    EXPECT_EQ(again.landmarks.at(name).vertex, mark.vertex) << name;
}

TEST(ReferenceFile, AMeshIsRefusedWithAdviceAndADamagedFileWithItsLine) {
  const TemporaryDirectory folder;
  write_obj(folder / "mesh.obj", icosphere(1, 90));
  EXPECT_THROW(
      try { load_reference_file(folder / "mesh.obj"); } catch (const IoError& e) {
        EXPECT_THAT(e.what(), HasSubstr("--reference-landmarks"));
        throw;
      },
      IoError);
  std::ofstream(folder / "cut.reference") << "# Facewright reference face\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1\n";
  EXPECT_THROW(
      try { load_reference_file(folder / "cut.reference"); } catch (const IoError& e) {
        EXPECT_EQ(e.line(), 5);
        throw;
      },
      IoError);
}

TEST(MakeReferenceProgram, KeepsTheContractOnBadInput) {
  const TemporaryDirectory folder;
  const std::string program = std::string(FACEWRIGHT_BIN_DIR) + "/make-reference ";
  write_ply(folder / "head.ply", head().mesh);
  write_landmarks(folder / "head.json", head().landmarks);
  const std::string head_file = (folder / "head.ply").string(), marks = (folder / "head.json").string();
  EXPECT_EQ(run_command(program + head_file + " -o " + (folder / "r").string()).exit_code, 2);  // no --landmarks
  EXPECT_EQ(run_command(program + head_file + " --landmarks " + marks).exit_code, 2);           // no -o
  CommandResult r = run_command(program + head_file + " --landmarks " + (folder / "none.json").string() + " -o " +
                                (folder / "r").string());
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("none.json"));
  write_ply(folder / "ball.ply", icosphere(4, 90));
  r = run_command(program + (folder / "ball.ply").string() + " --landmarks " + marks + " -o " +
                  (folder / "r").string());
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_THAT(r.output, HasSubstr("ball.ply"));
  EXPECT_FALSE(std::filesystem::exists(folder / "r"));
}

}  // namespace
}  // namespace facewright
