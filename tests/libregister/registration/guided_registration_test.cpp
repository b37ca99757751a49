// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libmodel/geometry/normals.h"
#include "libmodel/synthetic/mean_head.h"
#include "libmodel/synthetic/scan_person.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/register_scan.h"
#include "tests/support/matchers.h"

namespace facewright {
namespace {

// People with known correspondence: a vertex of the reference is a place of the mean head, and each person says where
// that place is and what colour it has.
class GuidedRegistration : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    face_ = new ParametricFace({2.5, 5, 0});
    reference_ = new MultiresTemplate(build_template(default_reference_face(), {3448, 16759}));
    places_ = new Vertices(reference_->V);
    for (auto row : places_->rowwise()) row = project_to_mean_head(row.transpose()).transpose();
    guide_ = new AppearanceGuide(*reference_, learn());
  }
  static void TearDownTestSuite() {
    delete guide_;
    delete places_;
    delete reference_;
    delete face_;
  }

  static FaceAppearance learn() {
    const AppearanceSpace space(*reference_);
    std::vector<AppearanceFeatures> features;
    std::vector<std::vector<bool>> seen;
    for (std::uint64_t i = 0; i < 6; ++i) {
      const SkinPainter paint(draw_person(*face_, 31, i).appearance);
      Colours colours(space.vertex_count(), 3);
      for (Eigen::Index v = 0; v < colours.rows(); ++v) colours.row(v) = paint(places_->row(v).transpose()).transpose();
      seen.emplace_back(static_cast<size_t>(space.vertex_count()), true);
      features.push_back(space.features({colours, seen.back()}));
    }
    return learn_appearance(features, seen);
  }

  struct Subject {
    SyntheticScan scan;
    Vertices truth;  // of the reference's vertices
  };
  static Subject subject(std::uint64_t i, double landmark_noise) {
    const SyntheticPerson person = draw_person(*face_, 32, i);
    ScannerOptions o;
    o.spacing = 1.8;
    o.landmark_noise = landmark_noise;
    Subject s{scan_person(*face_, person, 32, i, o), {}};
    s.truth = s.scan.scanner_from_head.apply(face_->positions(person, *places_));
    return s;
  }

  // Mean distance along the surface of the vertices of brows and lips from where they belong, mm.
  static double slip(const Subject& s, const Vertices& V) {
    const Vertices N = vertex_normals(s.truth, reference_->levels.back().F);
    double sum = 0;
    int n = 0;
    for (const char* region : {"left_brow", "right_brow", "lips"})
      for (const int v : reference_->regions.at(region)) {
        const Eigen::RowVector3d d = V.row(v) - s.truth.row(v);
        sum += (d - d.dot(N.row(v)) * N.row(v)).norm();
        ++n;
      }
    return sum / n;
  }

  static ParametricFace* face_;
  static MultiresTemplate* reference_;
  static Vertices* places_;
  static AppearanceGuide* guide_;
};
ParametricFace* GuidedRegistration::face_ = nullptr;
MultiresTemplate* GuidedRegistration::reference_ = nullptr;
Vertices* GuidedRegistration::places_ = nullptr;
AppearanceGuide* GuidedRegistration::guide_ = nullptr;

TEST_F(GuidedRegistration, LooksAtBrowsAndLips) {
  for (const char* region : {"left_brow", "right_brow", "lips"}) {
    const std::vector<int>& vertices = reference_->regions.at(region);
    int n = 0;
    for (const int v : guide_->control_vertices()) n += std::binary_search(vertices.begin(), vertices.end(), v);
    EXPECT_GE(n, 3) << region;
  }
}

// 0.48 against 0.61 mm.
TEST_F(GuidedRegistration, SlipsLessAtBrowsAndLipsIfLandmarksAreNoisy) {
  double with = 0, without = 0;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const Subject s = subject(i, 3);
    const RegistrationResult guided = register_scan(s.scan.mesh, s.scan.landmarks, *reference_, {}, guide_);
    const RegistrationResult alone = register_scan(s.scan.mesh, s.scan.landmarks, *reference_);
    EXPECT_GT(guided.summary.guided, 30);
    EXPECT_EQ(alone.summary.guided, 0);
    for (const RegistrationResult* r : {&guided, &alone}) {
      EXPECT_GT(r->summary.landmark_noise, 3 / 1.5);
      EXPECT_LT(r->summary.landmark_noise, 3 * 1.5);
    }
    with += slip(s, guided.V);
    without += slip(s, alone.V);
    EXPECT_LT(slip(s, guided.V), slip(s, alone.V)) << i;
  }
  EXPECT_LT(with, 0.85 * without);
}

TEST_F(GuidedRegistration, GivesTheSameBytesTwice) {
  const Subject s = subject(9, 2);
  const RegistrationResult a = register_scan(s.scan.mesh, s.scan.landmarks, *reference_, {}, guide_);
  const RegistrationResult b = register_scan(s.scan.mesh, s.scan.landmarks, *reference_, {}, guide_);
  EXPECT_GT(a.summary.guided, 0);
  EXPECT_THAT(a.V, SameBytes(b.V));
  EXPECT_EQ(a.summary.guided, b.summary.guided);
}

TEST_F(GuidedRegistration, FindsHowNoisyTheLandmarksAre) {
  const SymmetryPlane plane = symmetry_plane(reference_->V, reference_->mirror);
  const Landmarks marks = locate(reference_->landmarks, reference_->V, reference_->levels.front().F);
  for (const double noise : {1.0, 2.0}) {
    double sum = 0;
    constexpr int kPeople = 6;
    for (std::uint64_t i = 0; i < kPeople; ++i) {
      Landmarks of_person = face_->locate_landmarks(draw_person(*face_, 33, i));
      Random random = Random::stream(34, i);
      for (auto& [name, mark] : of_person)
        for (int c = 0; c < 3; ++c) mark.position[c] += noise / std::sqrt(3.0) * random.normal();
      const GlobalMapResult map = global_mapping(reference_->V, &plane, marks, of_person);
      EXPECT_TRUE(map.used_spline);
      sum += std::log(map.landmark_noise);
    }
    const double found = std::exp(sum / kPeople);
    EXPECT_LT(found, 1.5 * noise);
    EXPECT_GT(found, noise / 1.5);
  }
}

}  // namespace
}  // namespace facewright
