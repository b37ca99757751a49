// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libregister/registration/symmetric_spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "libmodel/core/errors.h"
#include "libmodel/synthetic/mean_head.h"
#include "libmodel/synthetic/smooth_noise.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"

namespace facewright {
namespace {

using Field = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

// Points with the extent of a face's landmarks, no two of them mirror images.
Vertices cloud(std::uint64_t seed, Eigen::Index n) {
  Random random(seed);
  Vertices X = random_points(random, n, 1);
  for (auto row : X.rowwise()) row = Eigen::RowVector3d(35 * row[0], 40 * row[1], 20 * row[2]);
  return X;
}

std::vector<SplineDatum> data_of(const Vertices& X, const Field& field, double stddev) {
  std::vector<SplineDatum> data;
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    add_displacement(X.row(i).transpose(), field(X.row(i).transpose()), stddev, &data);
  return data;
}

Vertices values_of(const Vertices& X, const Field& field) {
  Vertices Y(X.rows(), 3);
  for (Eigen::Index i = 0; i < X.rows(); ++i) Y.row(i) = field(X.row(i).transpose()).transpose();
  return Y;
}

Eigen::Vector3d bent(const Eigen::Vector3d& x) {
  return {3 * std::sin(0.05 * x[1]), 2 * std::cos(0.04 * x[0] + 1), 3 * std::sin(0.03 * x[0] - 0.04 * x[2])};
}

Vertices reflected(const Vertices& X, const SymmetryPlane& plane) {
  return values_of(X, [&](const Eigen::Vector3d& x) { return plane.reflect_point(x); });
}

Vertices turned_over(const Vertices& displacements, const SymmetryPlane& plane) {
  return values_of(displacements, [&](const Eigen::Vector3d& d) { return plane.reflect_direction(d); });
}

SymmetryPlane oblique_plane() { return {Eigen::Vector3d(2, -1, 0.5).normalized(), 4}; }

TEST(SymmetricSpline, ReproducesAnAffineFieldWhateverTheNoise) {
  Eigen::Matrix3d A;
  A << 0.1, -0.02, 0.03, 0.04, -0.08, 0.01, 0.02, 0.05, 0.06;
  const Field affine = [&](const Eigen::Vector3d& x) { return Eigen::Vector3d(A * x + Eigen::Vector3d(3, -2, 7)); };
  const SymmetryPlane plane = oblique_plane();
  const Vertices X = cloud(1, 20), elsewhere = 3 * cloud(2, 50);  // beyond the data's radius too
  for (const SymmetryPlane* p : {static_cast<const SymmetryPlane*>(nullptr), &plane})
    for (const double noise : {0.01, 1.0, 10.0})
      EXPECT_THAT(SymmetricSpline(data_of(X, affine, 1), p, {2, noise, 0.3})(elsewhere),
                  VerticesNear(values_of(elsewhere, affine), 1e-8));
}

TEST(SymmetricSpline, InterpolatesDataWithoutNoise) {
  const SymmetryPlane plane = oblique_plane();
  const Vertices X = cloud(3, 30);
  const SymmetricSpline spline(data_of(X, bent, 1e-5), &plane, {2, 1, 0.3});
  EXPECT_THAT(spline(X), VerticesNear(values_of(X, bent), 1e-6));
}

TEST(SymmetricSpline, SmoothsTheMoreTheNoisierTheDataAreSaidToBe) {
  const Vertices X = cloud(3, 30), wanted = values_of(X, bent);
  double last = 0;
  for (const double noise : {0.1, 0.3, 1.0, 3.0}) {
    const double residual = (SymmetricSpline(data_of(X, bent, 1), nullptr, {2, noise, 1})(X) - wanted).norm();
    EXPECT_GT(residual, 1.1 * last) << noise;
    last = residual;
  }
}

TEST(SymmetricSpline, CommutesWithARigidMotionOfEverything) {
  const SymmetryPlane plane = oblique_plane();
  const Vertices X = cloud(4, 25), elsewhere = 2 * cloud(5, 40);
  Random random(6);
  Similarity motion = random_similarity(random);
  motion.s = 1;
  SymmetryPlane moved_plane{motion.R * plane.normal, 0};
  moved_plane.offset = moved_plane.normal.dot(motion * (plane.offset * plane.normal));
  std::vector<SplineDatum> data = data_of(X, bent, 0.5);
  data.push_back({{10, 20, 5}, Eigen::Vector3d(1, 2, 3).normalized(), 2.5, 0.7});
  std::vector<SplineDatum> moved = data;
  for (SplineDatum& d : moved) d.point = motion * d.point, d.direction = motion.R * d.direction;
  const SplineSmoothness smoothness{2, 1, 0.3};
  const Vertices here = SymmetricSpline(data, &plane, smoothness)(elsewhere);
  EXPECT_THAT(SymmetricSpline(moved, &moved_plane, smoothness)(motion.apply(elsewhere)),
              VerticesNear(Vertices(here * motion.R.transpose()), 1e-8));
  const SplineSmoothness a = estimate_smoothness(data, &plane), b = estimate_smoothness(moved, &moved_plane);
  EXPECT_DOUBLE_EQ(a.amplitude, b.amplitude);
  EXPECT_DOUBLE_EQ(a.noise, b.noise);
  EXPECT_DOUBLE_EQ(a.asymmetry, b.asymmetry);
}

TEST(SymmetricSpline, SymmetricDataMakeASymmetricField) {
  const SymmetryPlane plane = oblique_plane();
  std::vector<SplineDatum> data = data_of(cloud(7, 20), bent, 0.5);
  for (size_t i = 0, n = data.size(); i < n; ++i) {
    const SplineDatum d = data[i];
    data.push_back({plane.reflect_point(d.point), plane.reflect_direction(d.direction), d.value, d.stddev});
  }
  const SymmetricSpline spline(data, &plane, {2, 1, 0.3});
  const Vertices X = 2 * cloud(8, 40);
  EXPECT_THAT(spline(reflected(X, plane)), VerticesNear(turned_over(spline(X), plane), 1e-9));
}

// A bump on the left, nothing known of the right but that rim and midline rest.
struct OneSided {
  std::vector<SplineDatum> data;
  Vertices here{{35, 0, 25.2}}, there{{-35, 0, 25.2}};
};

OneSided one_sided() {
  OneSided o;
  for (double y = -60; y <= 60; y += 20)
    for (const double x : {-80.0, 0.0, 15.0, 30.0, 35.0, 45.0, 80.0}) {
      const double z = 35 - 0.008 * x * x;
      const double bump = 3 * std::exp(-((x - 35) * (x - 35) + y * y) / 400);
      add_displacement({x, y, z}, {bump, 0, bump}, 0.02, &o.data);
    }
  return o;
}

TEST(SymmetricSpline, OneSideTellsOfTheOtherOnlyIfThereIsAPlane) {
  const OneSided o = one_sided();
  const SymmetryPlane plane;
  const Vertices with = SymmetricSpline(o.data, &plane, {2, 1, 0.15})(o.there);
  EXPECT_LT(with(0, 0), -1);  // outwards is the other way there
  EXPECT_GT(with(0, 2), 1);
  EXPECT_LT(SymmetricSpline(o.data, nullptr, {2, 1, 0.15})(o.there).norm(), 0.5);
  EXPECT_LT(SymmetricSpline(o.data, &plane, {2, 1, 1})(o.there).norm(), 0.5);  // sides as different as can be
  for (const SymmetryPlane* p : {static_cast<const SymmetryPlane*>(nullptr), &plane})
    EXPECT_THAT(SymmetricSpline(o.data, p, {2, 1, 0.15})(o.here), VerticesNear(Vertices{{3, 0, 3}}, 0.1));
}

TEST(SymmetricSpline, ADatumAlongOneDirectionLeavesTheOthersAlone) {
  std::vector<SplineDatum> data = data_of(
      cloud(9, 15), [](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero().eval(); }, 0.5);
  const Eigen::Vector3d point(20, 10, 60), along = Eigen::Vector3d(1, -2, 2) / 3;
  data.push_back({point, along, 4, 0.2});
  const Vertices X = 2 * cloud(10, 30);
  const SymmetricSpline spline(data, nullptr, {2, 1, 1});
  const Vertices Y = spline(X);
  EXPECT_GT(spline(point.transpose()).row(0).dot(along), 1);
  EXPECT_THAT(Y, VerticesNear(Vertices(Y * along * along.transpose()), 1e-9));
  data.back().direction = Eigen::Vector3d::UnitZ();  // in the plane of symmetry: its twin pulls the same way
  const SymmetryPlane plane;
  EXPECT_LT(SymmetricSpline(data, &plane, {2, 1, 0.3})(X).leftCols<2>().norm(), 1e-9);
}

TEST(SymmetricSpline, TheOrderOfTheDataDoesNotMatter) {  // components of one point are merged when they are neighbours
  const SymmetryPlane plane = oblique_plane();
  const std::vector<SplineDatum> data = data_of(cloud(11, 20), bent, 0.5);
  std::vector<SplineDatum> apart;
  for (size_t c = 0; c < 3; ++c)
    for (size_t i = c; i < data.size(); i += 3) apart.push_back(data[i]);
  const Vertices X = 2 * cloud(12, 40);
  EXPECT_THAT(SymmetricSpline(apart, &plane, {2, 1, 0.3})(X),
              VerticesNear(SymmetricSpline(data, &plane, {2, 1, 0.3})(X), 1e-9));
}

TEST(SymmetricSpline, IsAffineFarAway) {
  const SymmetryPlane plane;
  const SymmetricSpline spline(data_of(cloud(13, 30), bent, 0.5), &plane, {2, 1, 0.3});
  const Vertices D = spline(Vertices{{1000, 300, 0}, {1200, 200, 100}, {1400, 100, 200}});
  EXPECT_LT((D.row(0) - 2 * D.row(1) + D.row(2)).norm(), 1e-9);
}

TEST(SymmetricSpline, RefusesDataThatDoNotFixTheAffinePart) {
  const SymmetryPlane plane;
  EXPECT_THROW(SymmetricSpline({}, &plane, {}), InvalidInput);
  EXPECT_THROW(SymmetricSpline(data_of(cloud(14, 3), bent, 1), &plane, {}), InvalidInput);
  Vertices flat = cloud(15, 30);
  flat.col(2).setConstant(12);
  EXPECT_THROW(SymmetricSpline(data_of(flat, bent, 1), &plane, {}), InvalidInput);
  std::vector<SplineDatum> one_way;  // many places, but never their x
  for (const SplineDatum& d : data_of(cloud(16, 30), bent, 1))
    if (d.direction[0] == 0) one_way.push_back(d);
  EXPECT_THROW(SymmetricSpline(one_way, &plane, {}), InvalidInput);
  EXPECT_THROW(estimate_smoothness(data_of(cloud(17, 4), bent, 1), &plane), InvalidInput);
}

Vertices face_landmarks() {
  Vertices X(68, 3);
  const Landmarks marks = mean_head_landmarks();
  for (int i = 0; i < 68; ++i) X.row(i) = marks.at(std::to_string(i + 1)).position.transpose();
  return X;
}

// A smooth random displacement of about 2 mm a component; `symmetric`: the same on both sides of x = 0.
Field random_field(Random& random, bool symmetric) {
  const SmoothField x(random, 60, 200), y(random, 60, 200), z(random, 60, 200);
  const Field free = [=](const Eigen::Vector3d& p) { return Eigen::Vector3d(2 * x(p), 2 * y(p), 2 * z(p)); };
  if (!symmetric) return free;
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d flip(-1, 1, 1);
    return Eigen::Vector3d((free(p) + flip.cwiseProduct(free(flip.cwiseProduct(p)))) / std::sqrt(2));
  };
}

std::vector<SplineDatum> noisy_data(const Vertices& X, const Field& field, double noise, Random& random) {
  std::vector<SplineDatum> data = data_of(X, field, 1);
  for (SplineDatum& d : data) d.value += noise * random.normal();
  return data;
}

TEST(EstimateSmoothness, FindsPlantedNoise) {
  constexpr int kDraws = 6;
  const Vertices X = face_landmarks();
  const SymmetryPlane plane;
  for (const double noise : {0.3, 0.6, 1.2}) {
    double sum = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      Random random = Random::stream(18, static_cast<std::uint64_t>(draw));
      const Field field = random_field(random, draw % 2 == 0);
      sum += std::log(estimate_smoothness(noisy_data(X, field, noise, random), &plane).noise);
    }
    const double found = std::exp(sum / kDraws);
    EXPECT_LT(found, 1.5 * noise);
    EXPECT_GT(found, noise / 1.5);
  }
}

TEST(EstimateSmoothness, TellsSymmetricFieldsFromOthers) {
  const Vertices X = face_landmarks();
  const SymmetryPlane plane;
  for (std::uint64_t draw = 0; draw < 3; ++draw) {
    Random random = Random::stream(19, draw);
    const Field symmetric = random_field(random, true), free = random_field(random, false);
    EXPECT_DOUBLE_EQ(estimate_smoothness(noisy_data(X, symmetric, 0.3, random), &plane).asymmetry, 0.15);
    EXPECT_DOUBLE_EQ(estimate_smoothness(noisy_data(X, free, 0.3, random), &plane).asymmetry, 0.6);
    EXPECT_DOUBLE_EQ(estimate_smoothness(noisy_data(X, symmetric, 0.3, random), nullptr).asymmetry, 1);
  }
}

TEST(EstimateSmoothness, StrongerFieldsHaveTheGreaterAmplitude) {
  const Vertices X = face_landmarks();
  const SymmetryPlane plane;
  Random random(20);
  const Field field = random_field(random, false);
  const auto amplitude = [&](double factor) {
    Random noise(21);
    return estimate_smoothness(
               noisy_data(
                   X, [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(factor * field(p)); }, 0.3, noise),
               &plane)
        .amplitude;
  };
  EXPECT_GT(amplitude(2), 1.3 * amplitude(0.7));
}

// The spline with the smoothness it finds is nearer to the truth than the data are.
TEST(EstimateSmoothness, RemovesNoiseFromSmoothFields) {
  const Vertices X = face_landmarks();
  const SymmetryPlane plane;
  Random random(22);
  const Field field = random_field(random, true);
  const std::vector<SplineDatum> data = noisy_data(X, field, 1.2, random);
  const Vertices found = SymmetricSpline(data, &plane, estimate_smoothness(data, &plane))(X);
  EXPECT_LT(std::sqrt((found - values_of(X, field)).rowwise().squaredNorm().mean()), 0.8 * 1.2 * std::sqrt(3.0));
}

}  // namespace
}  // namespace facewright
