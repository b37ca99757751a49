// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Expressions, outlines, image sizes and inputs at the edge of what can be fitted.
#include <gtest/gtest.h>

#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/fitting/fit_landmarks.h"
#include "tests/libmodel/fitting/toy_model.h"

namespace facewright {
namespace {

OrthographicCamera camera_at(double yaw) { return {3, rotation({yaw, 0.08, -0.05}), {410, 390}}; }

/// The toy model with a mouth that opens, one that smiles and brows that rise.
MorphableModelParts expressive_parts() {
  const MorphableModel neutral = toy_model(6);
  MorphableModelParts parts = neutral.parts();
  const Vertices V = neutral.mean().V;
  const auto shape = [&](const char* name, double x0, double y0, double width, const Eigen::Vector3d& way,
                         bool mirror) {
    Vertices D(V.rows(), 3);
    for (Eigen::Index i = 0; i < V.rows(); ++i) {
      const double x = mirror ? std::abs(V(i, 0)) : V(i, 0), d = std::hypot(x - x0, V(i, 1) - y0) / width;
      D.row(i) = std::exp(-d * d) * way.transpose();
      if (mirror && V(i, 0) < 0) D(i, 0) *= -1;
    }
    parts.blendshapes.push_back({name, as_vector(D)});
  };
  shape("jaw_open", 0, -62, 18, {0, -15, -3}, false);
  shape("smile", 24, -48, 10, {8, 5, -4}, true);
  shape("brows_up", 32, 48, 15, {0, 9, 0}, true);
  return parts;
}
MorphableModel expressive() { return MorphableModel(expressive_parts()); }

Vertices posed(const MorphableModel& model, const Eigen::VectorXd& c, const std::vector<double>& weights) {
  Vertices V = model.instance(c).V;
  for (size_t i = 0; i < weights.size(); ++i) V += weights[i] * as_vertices(model.blendshapes()[i].displacement);
  return V;
}

TEST(FitExpression, RecoversPlantedWeightsByName) {
  const MorphableModel model = expressive();
  Random random(2);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  const ImageLandmarks marks = project_landmarks(model, posed(model, c, {0.8, 0, 0.5}), camera_at(0.2).affine());
  FitOptions options;
  options.lambda = options.expression.lambda = 1e-6;
  options.jaw = JawMode::fixed;
  options.iterations = 500;
  options.tolerance = 1e-8;
  const FitResult fit = fit_landmarks(model, marks, options);
  EXPECT_NEAR(fit.blendshape_weights.at("jaw_open"), 0.8, 0.01);
  EXPECT_NEAR(fit.blendshape_weights.at("smile"), 0, 0.01);
  EXPECT_NEAR(fit.blendshape_weights.at("brows_up"), 0.5, 0.01);
  EXPECT_LT((fit.shape_coefficients - c).cwiseAbs().maxCoeff(), 0.05);
  EXPECT_LT((fitted_mesh(model, fit).V - posed(model, c, {0.8, 0, 0.5})).cwiseAbs().maxCoeff(), 0.3);
}

TEST(FitExpression, WeightsStayWithinTheirBounds) {
  const MorphableModel model = expressive();
  const Eigen::VectorXd c = Eigen::VectorXd::Zero(6);
  FitOptions options;
  options.expression.lambda = 0.01;
  const ImageLandmarks much = project_landmarks(model, posed(model, c, {1.6, -0.7, 0.5}), camera_at(0).affine());
  FitResult fit = fit_landmarks(model, much, options);
  for (const auto& [name, weight] : fit.blendshape_weights) {
    EXPECT_GE(weight, 0) << name;
    EXPECT_LE(weight, 1) << name;
  }
  EXPECT_EQ(fit.blendshape_weights.at("jaw_open"), 1);
  EXPECT_EQ(fit.blendshape_weights.at("smile"), 0);
  options.expression.lower = -1;
  options.expression.upper = 2;
  fit = fit_landmarks(model, much, options);
  EXPECT_GT(fit.blendshape_weights.at("jaw_open"), 1.2);
  EXPECT_LT(fit.blendshape_weights.at("smile"), -0.3);
}

TEST(FitExpression, ANeutralFaceStaysNeutralAndThePriorHoldsWeightsBack) {
  const MorphableModel model = expressive();
  const Eigen::VectorXd c = Eigen::VectorXd::Zero(6);
  const FitResult neutral = fit_landmarks(model, project_landmarks(model, posed(model, c, {}), camera_at(0).affine()));
  for (const auto& [name, weight] : neutral.blendshape_weights) EXPECT_LT(weight, 0.02) << name;
  double last = 2;
  for (const double lambda : {0.01, 1.0, 100.0, 1e4}) {
    FitOptions options;
    options.expression.lambda = lambda;
    const ImageLandmarks open = project_landmarks(model, posed(model, c, {0.9}), camera_at(0).affine());
    const double weight = fit_landmarks(model, open, options).blendshape_weights.at("jaw_open");
    EXPECT_LT(weight, last);
    last = weight;
  }
  EXPECT_LT(last, 0.05);
}

TEST(FitExpression, ModesOfExpressionHaveAPriorOfTheirOwn) {
  MorphableModelParts parts = expressive_parts();
  PcaModel expression;
  expression.mean = Eigen::VectorXd::Zero(parts.shape.mean.size());
  expression.basis = parts.blendshapes[0].displacement.normalized();
  expression.variances = Eigen::VectorXd::Constant(1, parts.blendshapes[0].displacement.squaredNorm() / 4);
  parts.expression = expression;
  const MorphableModel model(std::move(parts));
  const ImageLandmarks marks =
      project_landmarks(model, posed(model, Eigen::VectorXd::Zero(6), {0.8}), camera_at(0).affine());
  FitOptions options;
  options.expression.mode = ExpressionMode::modes;
  const FitResult fit = fit_landmarks(model, marks, options);
  EXPECT_TRUE(fit.blendshape_weights.empty());
  ASSERT_EQ(fit.expression_coefficients.size(), 1);
  EXPECT_NEAR(fit.expression_coefficients[0], 1.6, 0.3);
  options.expression.lambda = 1e6;
  EXPECT_LT(fit_landmarks(model, marks, options).expression_coefficients[0], 0.05);
  options.expression.mode = ExpressionMode::none;
  EXPECT_EQ(fit_landmarks(model, marks, options).expression_coefficients.size(), 0);
}

TEST(FitExpression, AModelWithoutTheExpressionsAskedForIsRefused) {
  const MorphableModel model = toy_model();
  const ImageLandmarks marks = project_landmarks(model, model.mean().V, camera_at(0).affine());
  FitOptions options;
  options.expression.mode = ExpressionMode::blendshapes;
  EXPECT_THROW(fit_landmarks(model, marks, options), InvalidInput);
  options.expression.mode = ExpressionMode::modes;
  EXPECT_THROW(fit_landmarks(model, marks, options), InvalidInput);
}

/// A picture on whose jaw the outline was marked: vertices of the true face's outline instead of the landmarks'.
ImageLandmarks marked_on_outline(const MorphableModel& model, const Vertices& V, const OrthographicCamera& camera) {
  ImageLandmarks marks = project_landmarks(model, V, camera.affine());
  const auto outline = visible_outline(V, model.faces(), model.edge_topology(), camera.affine());
  Pixels jaw(8, 2);
  for (int k = 0; k < 8; ++k) jaw.row(k) = marks.at(std::to_string(10 + k)).position.transpose();
  const std::vector<int> match = match_outline(jaw, outline, 200);
  for (int k = 0; k < 8; ++k)
    if (const int i = match[static_cast<size_t>(k)]; i >= 0)
      marks[std::to_string(10 + k)].position = outline[static_cast<size_t>(i)].pixel;
  return marks;
}

TEST(FitContour, OutlinesMarkedOnTheFarSideServeWhereFixedPointsMislead) {
  const MorphableModel model = toy_model();
  double fixed = 0, contour = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    const Vertices truth = model.instance(model.shape().draw_coefficients(random)).V;
    const ImageLandmarks marks = marked_on_outline(model, truth, camera_at(0.7));
    FitOptions options;
    options.jaw = JawMode::fixed;
    fixed += (fitted_mesh(model, fit_landmarks(model, marks, options)).V - truth).norm();
    options.jaw = JawMode::contour;
    const FitResult fit = fit_landmarks(model, marks, options);
    EXPECT_EQ(fit.summary.stop, FitStop::converged);
    contour += (fitted_mesh(model, fit).V - truth).norm();
  }
  EXPECT_LT(contour, 0.8 * fixed);
}

TEST(FitContour, EachVertexIsMatchedAtMostOnce) {
  const MorphableModel model = toy_model();
  FitOptions options;
  options.jaw = JawMode::contour;
  const FitResult fit = fit_landmarks(model, marked_on_outline(model, model.mean().V, camera_at(0.7)), options);
  std::map<int, int> count;
  for (const LandmarkResidual& r : fit.summary.residuals)
    if (r.used && std::stoi(r.name) <= 17) {
      EXPECT_EQ(++count[r.vertex], 1) << r.name;
    }
  EXPECT_GT(count.size(), 10U);
}

TEST(FitLandmarksInput, TheSizeOfTheImageDoesNotMatterInAnyMode) {
  const MorphableModel model = expressive();
  Random random(5);
  const Eigen::VectorXd c = model.shape().draw_coefficients(random);
  const ImageLandmarks marks = project_landmarks(model, posed(model, c, {0.4}), camera_at(0.5).affine());
  for (const JawMode jaw : {JawMode::exclude, JawMode::slide, JawMode::fixed, JawMode::contour})
    for (const CameraKind camera : {CameraKind::orthographic, CameraKind::affine}) {
      FitOptions options;
      options.jaw = jaw;
      options.camera = camera;
      const FitResult one = fit_landmarks(model, marks, options);
      for (const double size : {0.25, 4.0}) {
        ImageLandmarks scaled = marks;
        for (auto& [name, mark] : scaled) mark.position *= size;
        const FitResult other = fit_landmarks(model, scaled, options);
        EXPECT_LT((other.shape_coefficients - one.shape_coefficients).norm(), 0.01 * one.shape_coefficients.norm());
        EXPECT_NEAR(other.summary.rms_percent, one.summary.rms_percent, 0.01 * one.summary.rms_percent);
        EXPECT_NEAR(other.blendshape_weights.at("jaw_open"), one.blendshape_weights.at("jaw_open"), 0.01);
      }
    }
}

TEST(FitLandmarksInput, RepetitionGivesTheSameBytes) {
  const MorphableModel model = expressive();
  const ImageLandmarks marks = project_landmarks(model, model.mean().V, camera_at(0.5).affine());
  FitOptions options;
  options.jaw = JawMode::contour;
  const FitResult a = fit_landmarks(model, marks, options), b = fit_landmarks(model, marks, options);
  EXPECT_EQ(a.shape_coefficients, b.shape_coefficients);
  EXPECT_EQ(a.shape_covariance, b.shape_covariance);
  EXPECT_EQ(a.blendshape_weights, b.blendshape_weights);
  EXPECT_EQ(a.camera.A, b.camera.A);
}

TEST(FitLandmarksInput, CoplanarAndCoincidentLandmarksAreRefused) {
  MorphableModelParts parts = toy_model().parts();
  const int nose = parts.landmarks.at("31").vertex;
  for (auto& [name, mark] : parts.landmarks) mark.vertex = nose;  // all on one vertex
  const MorphableModel pinned(parts);
  EXPECT_THROW(fit_landmarks(pinned, project_landmarks(toy_model(), toy_model().mean().V, camera_at(0).affine())),
               InvalidInput);
  parts = toy_model().parts();
  for (Eigen::Index i = 2; i < parts.shape.mean.size(); i += 3) parts.shape.mean[i] = 0;  // a flat face
  const MorphableModel flat(parts);
  EXPECT_THROW(fit_landmarks(flat, project_landmarks(flat, flat.mean().V, camera_at(0).affine())), InvalidInput);
}

TEST(FitLandmarksInput, DuplicatesAndPlacesOutsideTheImageGetAnAnswer) {
  const MorphableModel model = toy_model();
  Random random(6);
  const Vertices truth = model.instance(model.shape().draw_coefficients(random)).V;
  OrthographicCamera camera = camera_at(0.2);
  const FitResult inside = fit_landmarks(model, project_landmarks(model, truth, camera.affine()));
  camera.t = {-5000, 30};
  const FitResult outside = fit_landmarks(model, project_landmarks(model, truth, camera.affine()));
  EXPECT_LT((outside.shape_coefficients - inside.shape_coefficients).norm(), 1e-6);
  ImageLandmarks twice = project_landmarks(model, truth, camera.affine());
  LandmarkMapper mapper(std::map<std::string, LandmarkMapper::Target>{
      {"a", "31"}, {"b", "31"}, {"c", "37"}, {"d", "46"}, {"e", "49"}, {"f", "55"}, {"g", "28"}});
  ImageLandmarks named;
  for (const auto& [from, to] : std::map<std::string, std::string>{
           {"a", "31"}, {"b", "31"}, {"c", "37"}, {"d", "46"}, {"e", "49"}, {"f", "55"}, {"g", "28"}})
    named[from] = twice.at(to);
  const FitResult fit = fit_landmarks(model, named, {}, mapper);
  EXPECT_TRUE(fit.shape_coefficients.allFinite());
  EXPECT_LT(fit.summary.rms_px, 3);
}

TEST(FitLandmarksInput, ASchemeOfItsOwnWithContourLandmarksFitsAsIbugDoes) {
  const MorphableModel model = toy_model();
  Random random(8);
  const Vertices truth = model.instance(model.shape().draw_coefficients(random)).V;
  const ImageLandmarks ibug = marked_on_outline(model, truth, camera_at(0.5));
  ImageLandmarks custom;
  std::map<std::string, LandmarkMapper::Target> table;
  ContourLandmarks contour;
  for (const auto& [name, mark] : ibug) {
    custom["p" + name] = mark;
    const int number = std::stoi(name);
    if (number < 9) {
      contour.right.push_back("p" + name);
    } else if (number > 9 && number < 18) {
      contour.left.push_back("p" + name);
    } else if (number % 2 == 0) {
      table["p" + name] = name;
    } else {
      table["p" + name] = model.landmarks().at(name).vertex;
    }
  }
  FitOptions options;
  options.jaw = JawMode::contour;
  const FitResult fit = fit_landmarks(model, custom, options, LandmarkMapper(table, contour));
  EXPECT_TRUE(fit.summary.unknown.empty());
  const FitResult same = fit_landmarks(model, ibug, options);
  EXPECT_LT((fitted_mesh(model, fit).V - truth).norm(), 1.2 * (fitted_mesh(model, same).V - truth).norm());
}

TEST(FitLandmarksInput, FourLandmarksAnswerThreeAreRefusedByTheirNumber) {
  const MorphableModel model = toy_model();
  const ImageLandmarks all = project_landmarks(model, model.mean().V, camera_at(0.1).affine());
  ImageLandmarks few = {{"31", all.at("31")}, {"37", all.at("37")}, {"46", all.at("46")}};
  try {
    fit_landmarks(model, few);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_NE(std::string(e.what()).find("at least 4 landmarks that the model has, got 3"), std::string::npos);
  }
  few["58"] = all.at("58");
  const FitResult fit = fit_landmarks(model, few);
  EXPECT_TRUE(fit.shape_coefficients.allFinite());
  EXPECT_LT(fit.shape_coefficients.norm(), 0.5);  // the mean face was seen
  EXPECT_GT(fit.shape_stddevs().mean(), 0.7);     // and it is known to be hardly known
}

TEST(FitLandmarksInput, AModelWithoutColourAndTextureMapIsFittedAllTheSame) {
  MorphableModelParts parts = toy_model().parts();
  parts.colour = {};
  parts.uv.resize(0, 2);
  const MorphableModel bare(std::move(parts));
  const FitResult fit = fit_landmarks(bare, project_landmarks(bare, bare.mean().V, camera_at(0).affine()));
  EXPECT_EQ(fit.summary.stop, FitStop::converged);
  EXPECT_FALSE(fitted_mesh(bare, fit).has_colours());
}

}  // namespace
}  // namespace facewright
