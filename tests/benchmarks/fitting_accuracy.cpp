// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
//
// Errors of fitting to people who are not in the model, as tables in Markdown; pipelines/measure-fitting makes its
// input. usage: fitting_accuracy MODEL PEOPLE [name=value ...] PEOPLE holds places/ID.ply (where each model vertex
// belongs on the person), landmarks/ID.json (true ones), scans/ID.ply and .json (a scan in the same frame, with noisy
// landmarks), and counted.txt (per vertex: 0 or 1).
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <numbers>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/fitting/contour.h"
#include "libmodel/fitting/fit_landmarks.h"
#include "libmodel/fitting/fit_perspective.h"
#include "libmodel/fitting/fit_points.h"
#include "libmodel/fitting/fit_scan.h"
#include "libmodel/fitting/point_tree.h"
#include "libmodel/fitting/refine_scan_fit.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"
using namespace facewright;

namespace {

namespace fs = std::filesystem;
constexpr double face_px = 200, degree = std::numbers::pi / 180, near_mm = 500;

struct Person {
  std::string id;
  Vertices places;  ///< in the scan's frame
  Landmarks marks;
  Mesh scan;
  Landmarks scan_marks;
  Similarity model_from_person;  ///< an upright frame for the cameras
};

struct Study {
  MorphableModel model;
  std::vector<Person> people;
  std::vector<int> counted;
  std::map<std::string, double> values;
  double value(const char* name, double fallback) const { return values.count(name) ? values.at(name) : fallback; }

  /// Mean distance of the counted vertices, after a similarity that brings them nearest, or as they are.
  double error(const Vertices& fitted, const Person& p, bool align = true) const {
    const Vertices A = fitted(counted, Eigen::all), B = p.places(counted, Eigen::all);
    return ((align ? fit_similarity(A, B).apply(A) : A) - B).rowwise().norm().mean();
  }
  double error(const Eigen::VectorXd& c, const Person& p) const { return error(model.instance(c).V, p); }
};

/// A name that is not read anywhere would silently measure the defaults.
const std::string& known_option(const std::string& name) {
  static const std::vector<std::string> known = {"lambda",       "sigma_mm", "points_sigma_mm",   "scan_sigma_mm",
                                                 "independent",  "slide",    "landmark_sigma_mm", "level",
                                                 "smoothing_mm", "fading"};
  if (std::find(known.begin(), known.end(), name) != known.end()) return name;
  std::string names = "only, out";
  for (const std::string& k : known) names += ", " + k;
  throw InvalidInput("no option " + name + "; there are " + names);
}

double number(const std::string& name, const std::string& text) {
  char* end = nullptr;
  const double x = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != 0) throw InvalidInput(name + "=" + text + ": expected a number");
  return x;
}

void read_study(const fs::path& model, const fs::path& folder, Study& s) {
  s.model = load_model(model);
  std::ifstream flags(folder / "counted.txt");
  int flag = 0;
  for (int i = 0; flags >> flag; ++i)
    if (flag) s.counted.push_back(i);
  if (s.counted.empty() || s.counted.back() >= s.model.vertex_count())
    throw InvalidInput("counted.txt does not belong to this model");
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder / "places")) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  const Vertices mean = s.model.mean().V;
  for (const fs::path& file : files) {
    Person p;
    p.id = file.stem().string();
    p.places = read_mesh(file).V;
    p.marks = read_landmarks(folder / "landmarks" / (p.id + ".json"));
    p.scan = read_mesh(folder / "scans" / (p.id + ".ply"));
    p.scan_marks = read_landmarks(folder / "scans" / (p.id + ".json"));
    p.model_from_person = fit_similarity(p.places(s.counted, Eigen::all), mean(s.counted, Eigen::all), Scaling::fixed);
    s.people.push_back(p);
  }
}

/// The image of one person: a camera, noise, and jaw landmarks as points or as what the outline shows of them.
struct View {
  double yaw_deg = 0, noise_px = 0;
  bool outline = false, perspective = false;
  double scale = 1;  ///< of the image
  std::uint64_t seed = 0;
};

struct Picture {
  ImageLandmarks marks;
  PerspectiveCamera camera;  ///< of a perspective view
};

/// Where the outline of the posed face hides the jaw line (the far side) landmarks sit on the outline.
void move_to_outline(const Study& s, const Vertices& V, const AffineCamera& camera, double yaw, double px_per_mm,
                     ImageLandmarks& marks) {
  const std::vector<OutlinePoint> outline =
      visible_outline(V, s.model.faces(), s.model.edge_topology(), camera, ContourOptions());
  for (auto& [name, mark] : marks) {
    const int place = std::atoi(name.c_str());
    if (place < 1 || place > 17 || place == 9) continue;
    if ((yaw > 0.1 && place < 9) || (yaw < -0.1 && place > 9)) continue;  // the near side is seen as it is
    double best = 20 * px_per_mm;
    Eigen::Vector2d to = mark.position;
    for (const OutlinePoint& o : outline)
      if ((o.pixel - mark.position).norm() < best) best = (o.pixel - mark.position).norm(), to = o.pixel;
    mark.position = to;
  }
}

Picture picture(const Study& s, const Person& p, const View& view) {
  const auto at_home = [&](const std::string& name) { return p.model_from_person * p.marks.at(name).position; };
  const double px_per_mm = face_px / (at_home("1") - at_home("17")).norm();
  const Eigen::Matrix3d R = rotation({view.yaw_deg * degree, 0.05, 0.03});
  Picture out;
  out.camera.R = R;
  out.camera.t = {20, 10, -near_mm};
  out.camera.focal_px = px_per_mm * near_mm;
  out.camera.principal = {320, 240};
  const OrthographicCamera far{px_per_mm, R, {320, 240}};
  const AffineCamera affine = far.affine();
  for (const auto& [name, mark] : p.marks) {
    const Eigen::Vector3d x = at_home(name);
    out.marks[name].position = view.perspective ? out.camera.project(x) : affine.project(x);
  }
  if (view.outline && !view.perspective)
    move_to_outline(s, p.model_from_person.apply(p.places), affine, view.yaw_deg * degree, px_per_mm, out.marks);
  Random random = Random::stream(view.seed + 1, static_cast<std::uint64_t>(&p - s.people.data()));
  for (auto& [name, mark] : out.marks) {
    for (int k = 0; k < 2; ++k) mark.position[k] += view.noise_px * random.normal();
    mark.position *= view.scale;
  }
  return out;
}

FitOptions image_options(const Study& s, JawMode jaw, CameraKind camera = CameraKind::orthographic) {
  FitOptions o;
  o.lambda = s.value("lambda", o.lambda);
  o.sigma_mm = s.value("sigma_mm", o.sigma_mm);
  o.jaw = jaw;
  o.camera = camera;
  return o;
}

using Method = std::function<double(const Person&, double yaw, double noise)>;  // error in mm

Method by_landmarks(const Study& s, JawMode jaw, bool outline, CameraKind camera = CameraKind::orthographic) {
  return [&s, jaw, outline, camera](const Person& p, double yaw, double noise) {
    const View view{yaw, noise, outline};
    return s.error(fit_landmarks(s.model, picture(s, p, view).marks, image_options(s, jaw, camera)).shape_coefficients,
                   p);
  };
}

Method by_three_images(const Study& s, JawMode jaw, bool outline) {
  return [&s, jaw, outline](const Person& p, double yaw, double noise) {
    std::vector<ImageLandmarks> images;
    for (int i = -1; i <= 1; ++i) {
      View view{i * yaw, noise, outline};
      view.seed = static_cast<std::uint64_t>(i + 1);
      images.push_back(picture(s, p, view).marks);
    }
    return s.error(fit_landmarks_multi(s.model, images, image_options(s, jaw)).shape_coefficients, p);
  };
}

/// Pictures from 500 mm; `focal` 1: known; 2: unknown, the prior off by a third; 0: taken for orthographic.
Method from_nearby(const Study& s, int focal) {
  return [&s, focal](const Person& p, double yaw, double noise) {
    View view{yaw, noise, false, true};
    const Picture seen = picture(s, p, view);
    PerspectiveFitOptions o;
    o.fit = image_options(s, JawMode::fixed);
    if (focal == 0) return s.error(fit_landmarks(s.model, seen.marks, o.fit).shape_coefficients, p);
    o.camera.principal = seen.camera.principal;
    if (focal == 1) o.camera.focal_px = seen.camera.focal_px;
    o.camera.prior_focal_px = 1.33 * seen.camera.focal_px;
    return s.error(fit_landmarks_perspective(s.model, seen.marks, o).shape_coefficients, p);
  };
}

Method by_points(const Study& s) {
  return [&s](const Person& p, double, double noise) {
    FitPointsOptions o;
    o.lambda = s.value("lambda", o.lambda);
    o.sigma_mm = s.value("points_sigma_mm", o.sigma_mm);
    const double px_per_mm = face_px / (p.marks.at("1").position - p.marks.at("17").position).norm();
    Landmarks seen = p.marks;
    Random random = Random::stream(9, static_cast<std::uint64_t>(&p - s.people.data()));
    for (auto& [name, mark] : seen)
      for (int k = 0; k < 3; ++k) mark.position[k] += noise / px_per_mm * random.normal();
    return s.error(fit_points(s.model, seen, o).shape_coefficients, p);
  };
}

/// The nearest face of the model to the true places, coefficients free, over pose and size: no fit can be better.
double best_possible(const Study& s, const Person& p) {
  std::vector<Observation> seen(s.counted.size());
  for (size_t i = 0; i < seen.size(); ++i) seen[i].vertex = s.counted[i];
  const LandmarkShapeModel rows = landmark_shape_model(seen, s.model.shape(), -1);
  PointTargets t;
  t.positions = p.places(s.counted, Eigen::all);
  t.across = t.along = Eigen::VectorXd::Ones(t.positions.rows());
  PointFit fit{fit_similarity(rows.points(Eigen::VectorXd::Zero(rows.basis.cols())), t.positions),
               Eigen::VectorXd::Zero(rows.basis.cols())};
  for (int i = 0; i < 6; ++i) fit = step_to_points(fit, rows, t, 1e-9, Scaling::free);
  return s.error(fit.coefficients, p);
}

void image_table(const Study& s) {
  const std::vector<std::pair<const char*, Method>> methods = {
      {"mean face", [&s](const Person& p, double, double) { return s.error(Eigen::VectorXd(), p); }},
      {"affine, jaw as points", by_landmarks(s, JawMode::fixed, false, CameraKind::affine)},
      {"scaled orthographic, jaw as points", by_landmarks(s, JawMode::fixed, false)},
      {"scaled orthographic, jaw on the outline, taken as points", by_landmarks(s, JawMode::fixed, true)},
      {"scaled orthographic, jaw on the outline, slides", by_landmarks(s, JawMode::slide, true)},
      {"with contours, jaw on the outline", by_landmarks(s, JawMode::contour, true)},
      {"3 images (-yaw, 0, yaw), jaw as points", by_three_images(s, JawMode::fixed, false)},
      {"3 images with contours, jaw on the outline", by_three_images(s, JawMode::contour, true)},
      {"from 500 mm, taken for orthographic", from_nearby(s, 0)},
      {"from 500 mm, perspective, focal length known", from_nearby(s, 1)},
      {"from 500 mm, perspective, focal length unknown", from_nearby(s, 2)},
      {"3D landmarks", by_points(s)}};
  std::printf(
      "| yaw, degrees | 0 | 0 | 0 | 30 | 30 | 30 | 60 | 60 | 60 |\n|---|---|---|---|---|---|---|---|---|---|\n");
  std::printf("| noise, px | 0 | 1 | 2 | 0 | 1 | 2 | 0 | 1 | 2 |\n");
  for (const auto& [name, method] : methods) {
    std::printf("| %s |", name);
    for (const double yaw : {0.0, 30.0, 60.0})
      for (const double noise : {0.0, 1.0, 2.0}) {
        double sum = 0;
        for (const Person& p : s.people) sum += method(p, yaw, noise);
        std::printf(" %.2f |", sum / static_cast<double>(s.people.size()));
      }
    std::printf("\n");
    std::fflush(stdout);
  }
}

/// Mean distance of the counted vertices from the surface of the truth, along its normals, as they are.
double surface_error(const Study& s, const Vertices& V, const Person& p) {
  const PointTree tree(p.places);
  const Vertices normals = vertex_normals(p.places, s.model.faces());
  double sum = 0;
  for (const int i : s.counted) {
    const int at = tree.nearest(V.row(i).transpose()).row;
    sum += std::abs(normals.row(at).dot(V.row(i) - p.places.row(at)));
  }
  return sum / static_cast<double>(s.counted.size());
}

/// Mean of the parts of the error across the true surface and along it, after the alignment.
std::array<double, 2> split_error(const Study& s, const Vertices& V, const Person& p) {
  const Vertices normals = vertex_normals(p.places, s.model.faces());
  const Vertices A = V(s.counted, Eigen::all), B = p.places(s.counted, Eigen::all), N = normals(s.counted, Eigen::all);
  const Vertices d = fit_similarity(A, B).apply(A) - B;
  const Eigen::VectorXd across = d.cwiseProduct(N).rowwise().sum();
  return {across.cwiseAbs().mean(), (d.rowwise().squaredNorm() - across.cwiseAbs2()).cwiseMax(0).cwiseSqrt().mean()};
}

void scan_table(const Study& s, const char* out) {
  FitScanOptions o;
  o.lambda = s.value("lambda", o.lambda);
  o.sigma_mm = s.value("scan_sigma_mm", o.sigma_mm);
  o.independent = static_cast<int>(s.value("independent", o.independent));
  o.slide = s.value("slide", o.slide);
  o.landmark_sigma_mm = s.value("landmark_sigma_mm", o.landmark_sigma_mm);
  o.level = static_cast<int>(s.value("level", o.level));
  RefineOptions r;
  r.smoothing_mm = s.value("smoothing_mm", r.smoothing_mm);
  r.fading = s.value("fading", r.fading);
  const std::vector<const char*> names = {"3D landmarks of the scan (1 mm of noise)",
                                          "whole scan",
                                          "whole scan, part across the surface",
                                          "whole scan, part along the surface",
                                          "whole scan, no alignment",
                                          "whole scan, distance from the true surface (no alignment)",
                                          "refined",
                                          "refined, part across the surface",
                                          "refined, part along the surface",
                                          "refined, no alignment",
                                          "refined, distance from the true surface (no alignment)",
                                          "best face of the model"};
  std::vector<double> sums(names.size(), 0);
  for (const Person& p : s.people) {
    const FitScanResult fit = fit_scan(s.model, p.scan, p.scan_marks, o);
    const RefinedFace refined = refine_to_scan(s.model, p.scan, fit, r);
    if (out) {
      write_ply(fs::path(out) / (p.id + ".ply"), {fit.fitted, s.model.faces(), {}, {}, {}});
      write_ply(fs::path(out) / (p.id + "_refined.ply"), {refined.V, s.model.faces(), {}, {}, {}});
    }
    const auto [across, along] = split_error(s, fit.fitted, p);
    const auto [across_refined, along_refined] = split_error(s, refined.V, p);
    const std::vector<double> figures = {s.error(fit_points(s.model, p.scan_marks).shape_coefficients, p),
                                         s.error(fit.fitted, p),
                                         across,
                                         along,
                                         s.error(fit.fitted, p, false),
                                         surface_error(s, fit.fitted, p),
                                         s.error(refined.V, p),
                                         across_refined,
                                         along_refined,
                                         s.error(refined.V, p, false),
                                         surface_error(s, refined.V, p),
                                         best_possible(s, p)};
    for (size_t k = 0; k < sums.size(); ++k) sums[k] += figures[k];
    std::fprintf(stderr, "%s %.3f as it is %.3f matched %d of %d median %.3f |c| %.1f; refined %.3f in %d rounds\n",
                 p.id.c_str(), figures[1], figures[4], fit.summary.matched, fit.summary.vertices, fit.summary.median_mm,
                 fit.shape_coefficients.norm(), figures[6], refined.summary.iterations);
  }
  std::printf("\n| | mm |\n|---|---|\n");
  for (size_t k = 0; k < sums.size(); ++k)
    std::printf("| %s | %.2f |\n", names[k], sums[k] / static_cast<double>(s.people.size()));
}

/// Largest differences between fits of the same picture at other sizes.
void scale_table(const Study& s) {
  double rms = 0, coefficient = 0;
  for (const Person& p : s.people)
    for (const double yaw : {0.0, 30.0, 60.0}) {
      View view{yaw, 1, true};
      const FitOptions o = image_options(s, JawMode::contour);
      const FitResult one = fit_landmarks(s.model, picture(s, p, view).marks, o);
      for (const double scale : {0.25, 4.0}) {
        view.scale = scale;
        const FitResult other = fit_landmarks(s.model, picture(s, p, view).marks, o);
        rms = std::max(rms, std::abs(other.summary.rms_percent / one.summary.rms_percent - 1));
        coefficient = std::max(
            coefficient, (other.shape_coefficients - one.shape_coefficients).norm() / one.shape_coefficients.norm());
      }
    }
  std::printf(
      "\nimages of a quarter and four times the size, contours, %zu people x 3 yaws: normalised landmark rms "
      "differs by %.2g %% at most, coefficients by %.2g %% of their length\n",
      s.people.size(), 100 * rms, 100 * coefficient);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) throw InvalidInput("usage: fitting_accuracy MODEL PEOPLE [name=value ...]");
  Study study;
  std::string out, only;
  for (int i = 3; i < argc; ++i) {
    const std::string a = argv[i];
    const auto at = a.find('=');
    if (at == std::string::npos) throw InvalidInput("expected name=value, got " + a);
    const std::string name = a.substr(0, at), text = a.substr(at + 1);
    if (name == "out")
      out = text;
    else if (name == "only")
      only = text;
    else
      study.values[known_option(name)] = number(name, text);
  }
  if (!only.empty() && only != "images" && only != "scans" && only != "scale")
    throw InvalidInput("only=" + only + ": expected images, scans or scale");
  read_study(argv[1], argv[2], study);
  if (only.empty() || only == "images") image_table(study);
  if (only.empty() || only == "scans") scan_table(study, out.empty() ? nullptr : out.c_str());
  if (only.empty() || only == "scale") scale_table(study);
  return 0;
} catch (const std::exception& e) {
  std::cerr << "fitting_accuracy: " << e.what() << "\n";
  return 1;
}
