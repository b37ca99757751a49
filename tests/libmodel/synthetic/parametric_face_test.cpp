// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/parametric_face.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "tests/libmodel/synthetic/shared_face.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

SyntheticPerson one_parameter(const std::string& name, double value) {
  SyntheticPerson person = shared_face().mean_person();
  person.shape[shared_face().parameter_index(name)] = value;
  return person;
}

TEST(ParametricFace, HasAtLeastThirtyParameters) { EXPECT_GE(shared_face().parameters().size(), 30U); }

TEST(ParametricFace, MeanPersonIsTheMeanMesh) {
  EXPECT_EQ(shared_face().mesh(shared_face().mean_person()).V, shared_face().mean().V);
}

TEST(ParametricFace, EveryParameterMovesWhatItNamesByItsStandardDeviation) {
  const ParametricFace& face = shared_face();
  const Landmarks mean = face.locate_landmarks(face.mean_person());
  for (const ShapeParameter& p : face.parameters()) {
    if (p.from.empty()) continue;
    const Landmarks moved = face.locate_landmarks(one_parameter(p.name, 1));
    const auto measure = [&](const Landmarks& l) { return (l.at(p.to).position - l.at(p.from).position)[p.axis]; };
    // the marks of the mesh lie within its facets' height of the calibrated points
    EXPECT_NEAR(measure(moved) - measure(mean), p.stddev, 0.03 * p.stddev + 0.02) << p.name;
  }
}

TEST(ParametricFace, MouthWidthLeavesTheEyesAlone) {
  const ParametricFace& face = shared_face();
  const Landmarks mean = face.locate_landmarks(face.mean_person()),
                  wide = face.locate_landmarks(one_parameter("mouth_width", 2));
  for (const char* name : {"37", "40", "43", "46"})
    EXPECT_LT((wide.at(name).position - mean.at(name).position).norm(), 0.01) << name;
}

TEST(ParametricFace, ParametersKeepTheFaceSymmetric) {
  const ParametricFace& face = shared_face();
  SyntheticPerson person = draw_person(face, 4, 0);
  person.asymmetry = 0;
  const Vertices V = face.mesh(person).V;
  double worst = 0;
  for (int v = 0; v < static_cast<int>(V.rows()); ++v) {
    const Vector3d m = row(V, face.mirror()[static_cast<size_t>(v)]);
    worst = std::max(worst, (row(V, v) - Vector3d(-m.x(), m.y(), m.z())).norm());
  }
  EXPECT_LT(worst, 1e-9);
  person.asymmetry = 0.5;
  const Landmarks marks = face.locate_landmarks(person);
  EXPECT_GT(std::abs(marks.at("31").position.x()) + std::abs(marks.at("9").position.x()), 1e-3);
}

TEST(ParametricFace, PositionAgreesWithTheMeshAndItsLandmarks) {
  const ParametricFace& face = shared_face();
  const SyntheticPerson person = draw_person(face, 4, 1);
  const Mesh mesh = face.mesh(person);
  for (int v = 0; v < static_cast<int>(mesh.V.rows()); v += 997)
    EXPECT_LT((face.position(person, row(face.mean().V, v)) - row(mesh.V, v)).norm(), 1e-12);
  const Landmarks direct = face.locate_landmarks(person), located = locate(face.landmarks(), mesh.V, mesh.F);
  ASSERT_EQ(direct.size(), located.size());
  for (const auto& [name, mark] : direct) EXPECT_LT((mark.position - located.at(name).position).norm(), 1e-9) << name;
}

TEST(ParametricFace, ThirtyPeopleHaveNoFlippedTriangles) {
  const ParametricFace& face = shared_face();
  for (std::uint64_t i = 0; i < 30; ++i) {
    const Vertices V = face.positions(draw_person(face, 11, i), face.mean().V);
    int flipped = 0;
    for (Eigen::Index f = 0; f < face.mean().F.rows(); ++f)
      flipped += facet_normal(V, face.mean().F, f).dot(facet_normal(face.mean().V, face.mean().F, f)) <= 0;
    EXPECT_EQ(flipped, 0) << "person " << i;
  }
}

TEST(DrawPerson, IsReproducibleAndPeopleDiffer) {
  const ParametricFace& face = shared_face();
  EXPECT_EQ(draw_person(face, 5, 7).shape, draw_person(face, 5, 7).shape);
  EXPECT_NE(draw_person(face, 5, 7).shape, draw_person(face, 5, 8).shape);
  EXPECT_NE(draw_person(face, 5, 7).shape, draw_person(face, 6, 7).shape);
  EXPECT_EQ(draw_person(face, 5, 7).appearance.skin, draw_person(face, 5, 7).appearance.skin);
}

TEST(DrawPerson, ParametersHaveAboutUnitVarianceOverManyPeople) {
  const ParametricFace& face = shared_face();
  Eigen::MatrixXd all(400, static_cast<Eigen::Index>(face.parameters().size()));
  for (Eigen::Index i = 0; i < all.rows(); ++i)
    all.row(i) = draw_person(face, 9, static_cast<std::uint64_t>(i)).shape.transpose();
  const Eigen::RowVectorXd mean = all.colwise().mean();
  const Eigen::RowVectorXd sd = ((all.rowwise() - mean).colwise().squaredNorm() / 400).cwiseSqrt();
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), 0.2);  // four standard errors of 1/20
  EXPECT_GT(sd.minCoeff(), 0.8);
  EXPECT_LT(sd.maxCoeff(), 1.2);
}

TEST(DrawPerson, ColoursAreColoursAndSkinRunsFromDarkToLight) {
  const ParametricFace& face = shared_face();
  double darkest = 1, lightest = 0;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const Appearance a = draw_person(face, 2, i).appearance;
    darkest = std::min(darkest, a.skin.x());
    lightest = std::max(lightest, a.skin.x());
  }
  EXPECT_LT(darkest, 0.2);
  EXPECT_GT(lightest, 0.5);
  const Mesh mesh = face.mesh(draw_person(face, 2, 0));
  EXPECT_GE(mesh.colours.minCoeff(), 0);
  EXPECT_LE(mesh.colours.maxCoeff(), 1);
}

TEST(SkinPainter, PutsColourWhereItBelongs) {
  const ParametricFace& face = shared_face();
  const Landmarks marks = face.locate_landmarks(face.mean_person());
  const SkinPainter paint(face.mean_person().appearance);
  const auto at = [&](const std::string& name) { return marks.at(name).position; };
  const Vector3d cheek = paint(at("left_cheek")), brow = paint(at("25"));
  EXPECT_LT(brow.sum(), 0.6 * cheek.sum());
  const Vector3d lip = paint(0.5 * (at("58") + at("67")));
  EXPECT_GT(lip.x() / lip.y(), 1.2 * cheek.x() / cheek.y());
  const Vector3d pupil = paint({31.3, 0.2, 44.5}), white = paint({40, 0.3, 40.2});
  EXPECT_LT(pupil.sum(), 0.1);
  EXPECT_GT(white.minCoeff(), 0.3);
}

TEST(ParametricFace, RefusesWrongInput) {
  const ParametricFace& face = shared_face();
  SyntheticPerson person = face.mean_person();
  person.shape.resize(3);
  EXPECT_THROW(face.mesh(person), InvalidInput);
  EXPECT_THROW(face.parameter_index("number_of_noses"), InvalidInput);
  EXPECT_THROW(draw_person(face, 1, 1, {.spread = -1}), InvalidInput);
  EXPECT_THROW(draw_person(face, 1, 1, {.asymmetry = 5}), InvalidInput);
}

}  // namespace
}  // namespace facewright
