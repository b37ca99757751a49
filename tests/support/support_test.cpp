// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "libmodel/core/topology.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kRounding = 1e-12;  // sums and square roots of values below 100

template <typename Matcher, typename Value>
std::string explanation(const Matcher& matcher, const Value& value) {
  ::testing::StringMatchResultListener listener;
  ::testing::ExplainMatchResult(matcher, value, &listener);
  return listener.str();
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.F.rowwise()) {
    const Eigen::Vector3d a = mesh.V.row(f[0]), b = mesh.V.row(f[1]), c = mesh.V.row(f[2]);
    sum += (b - a).cross(c - a).norm() / 2;
  }
  return sum;
}

// Smallest cosine between a triangle's normal and `outwards(centroid)`.
template <typename Outwards>
double worst_orientation(const Mesh& mesh, const Outwards& outwards) {
  double worst = 1;
  for (const auto& f : mesh.F.rowwise()) {
    const Eigen::Vector3d a = mesh.V.row(f[0]), b = mesh.V.row(f[1]), c = mesh.V.row(f[2]);
    const Eigen::Vector3d n = (b - a).cross(c - a).normalized();
    worst = std::min(worst, n.dot(outwards(Eigen::Vector3d((a + b + c) / 3)).normalized()));
  }
  return worst;
}

TEST(MatrixNear, NamesTheWorstEntryAndItsError) {
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  A(1, 0) = 0.5;
  EXPECT_THAT(A, Not(MatrixNear(Eigen::Matrix2d::Identity(), 0.1)));
  EXPECT_THAT(explanation(MatrixNear(Eigen::Matrix2d::Identity(), 0.1), A), HasSubstr("worst at (1, 0): 0.5"));
  EXPECT_THAT(A, MatrixNear(Eigen::Matrix2d::Identity(), 0.5));
}

TEST(MatrixNear, NeverAcceptsNanOrAnotherSize) {
  Eigen::Vector3d x(0, std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_THAT(x, Not(MatrixNear(Eigen::Vector3d::Zero(), 1e9)));
  EXPECT_THAT(Eigen::Vector2d::Zero(), Not(MatrixNear(Eigen::Vector3d::Zero(), 1)));
}

TEST(VerticesNear, NamesTheWorstRow) {
  const Vertices expected = Vertices::Zero(5, 3);
  Vertices actual = expected;
  actual(3, 1) = 2;
  EXPECT_THAT(explanation(VerticesNear(expected, 0.1), actual), HasSubstr("1 of 5 vertices are off"));
  EXPECT_THAT(explanation(VerticesNear(expected, 0.1), actual), HasSubstr("worst is row 3"));
  EXPECT_THAT(actual, VerticesNear(expected, 2.0));
  actual(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(actual, Not(VerticesNear(expected, 1e9)));
}

TEST(Shapes, HaveTheTopologyTheyPromise) {
  EXPECT_EQ(euler_characteristic(plane_grid(4, 3, 1, 1).F), 1);
  EXPECT_EQ(euler_characteristic(icosphere(2, 1).F), 2);
  EXPECT_EQ(boundary_edge_count(icosphere(2, 1).F), 0);
  EXPECT_EQ(euler_characteristic(hemisphere(4, 12, 1).F), 1);
  EXPECT_EQ(boundary_edge_count(hemisphere(4, 12, 1).F), 12);
  EXPECT_EQ(euler_characteristic(annulus(3, 10, 1, 2).F), 0);
  EXPECT_EQ(boundary_loops(annulus(3, 10, 1, 2).F).size(), 2u);
}

TEST(Shapes, FaceOutwards) {
  const auto radial = [](const Eigen::Vector3d& x) { return x; };
  const auto towards_z = [](const Eigen::Vector3d&) { return Eigen::Vector3d(0, 0, 1); };
  EXPECT_GT(worst_orientation(icosphere(3, 50), radial), 0.9);
  EXPECT_GT(worst_orientation(hemisphere(8, 24, 50), radial), 0.9);
  EXPECT_GT(worst_orientation(plane_grid(3, 3, 1, 1), towards_z), 0.999);
  EXPECT_GT(worst_orientation(annulus(3, 12, 1, 2), towards_z), 0.999);
  EXPECT_GT(worst_orientation(cylinder_patch(8, 2, 50, 1, 10),
                              [](const Eigen::Vector3d& x) { return Eigen::Vector3d(x[0], 0, x[2]); }),
            0.99);
}

TEST(Shapes, SphereAreaErrorFallsFourfoldPerSubdivision) {
  const double exact = 4 * std::numbers::pi * 100;
  const double coarse = exact - area(icosphere(3, 10)), fine = exact - area(icosphere(4, 10));
  EXPECT_NEAR(coarse / fine, 4, 0.1);  // second-order convergence
}

TEST(Shapes, VerticesLieOnTheirSurface) {
  EXPECT_THAT(Eigen::VectorXd(icosphere(3, 50).V.rowwise().norm()),
              MatrixNear(Eigen::VectorXd::Constant(642, 50.0), kRounding));
  EXPECT_THAT(Eigen::VectorXd(hemisphere(5, 9, 50).V.rowwise().norm()),
              MatrixNear(Eigen::VectorXd::Constant(46, 50.0), kRounding));
}

TEST(RandomRotation, IsARotationAndRepeatsWithItsSeed) {
  Random a(7), b(7);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Matrix3d R = random_rotation(a);
    EXPECT_THAT(R, IsRotation(kRounding));
    EXPECT_THAT(R, SameBytes(random_rotation(b)));
  }
}

TEST(TemporaryDirectory, IsGoneAfterItsScope) {
  std::filesystem::path path;
  {
    const TemporaryDirectory directory;
    path = directory.path();
    EXPECT_TRUE(std::filesystem::is_directory(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(RunCommand, ReturnsTheExitCodeAndBothStreams) {
  const CommandResult result = run_command("echo out; echo err >&2; exit 3");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.output, HasSubstr("out\nerr"));
}

}  // namespace
}  // namespace facewright
