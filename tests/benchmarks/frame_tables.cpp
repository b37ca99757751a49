// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Are units, axes, winding and handedness of scans found? Each scan of a folder, with its landmarks as the truth, is
// turned, scaled, mirrored and turned inside out in 240 known ways.
//   frame_tables FOLDER [MM_PER_UNIT] [TILT_DEGREES] [VARIANTS]
#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>

#include "libmodel/core/random.h"
#include "libregister/intake/frame_detection.h"
#include "libregister/intake/scan.h"
#include "libregister/reference/reference_face.h"

namespace facewright {
namespace {

constexpr double kUnits[] = {1, 10, 1000};

struct Variant {
  const char* kind = "";
  double mm_per_unit = 1;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  // file from scan, determinant 1
  bool mirrored = false, flipped = false, textured = false;
};

std::vector<Eigen::Matrix3d> axis_rotations() {
  std::vector<Eigen::Matrix3d> list;
  for (int up = 1; up <= 6; ++up)
    for (int front = 1; front <= 6; ++front) {
      if ((up - 1) / 2 == (front - 1) / 2) continue;
      Eigen::Matrix3d Q;
      Q.col(1) = file_axis_vector(static_cast<FileAxis>(up));
      Q.col(2) = file_axis_vector(static_cast<FileAxis>(front));
      Q.col(0) = Q.col(1).cross(Q.col(2));
      list.push_back(Q);
    }
  return list;
}

// 72 as they are, 72 mirrored, 72 with their triangles turned over, and 24 mirrored without a texture.
std::vector<Variant> variants() {
  std::vector<Variant> list;
  const auto rotations = axis_rotations();
  for (const double mm : kUnits)
    for (const auto& Q : rotations) {
      list.push_back({"as it is", mm, Q, false, false, false});
      list.push_back({"mirrored", mm, Q, true, false, true});
      list.push_back({"turned over", mm, Q, false, true, true});
      if (mm == 10) list.push_back({"mirrored, no texture", mm, Q, true, false, false});
    }
  return list;
}

Mesh transformed(Mesh mesh, const Variant& v, const Eigen::Matrix3d& A) {
  mesh.uv = TexCoords(), mesh.uv_faces = Faces();
  if (v.textured) {
    mesh.uv.resize(mesh.V.rows(), 2);
    for (Eigen::Index i = 0; i < mesh.V.rows(); ++i)
      mesh.uv.row(i) << std::atan2(mesh.V(i, 0), mesh.V(i, 2) + 100) / 7 + 0.5, mesh.V(i, 1) / 1000 + 0.5;
  }
  mesh.V = (mesh.V * A.transpose()).eval();
  if (v.flipped) mesh.F.col(1).swap(mesh.F.col(2));
  return mesh;
}

// In the head's axes the eyes lie right and left, the nose before and the mouth below them, in millimetres.
bool is_upright(const Landmarks& l) {
  const auto at = [&](const char* name) { return l.at(name).position; };
  const Eigen::Vector3d eyes = at("46") - at("37"), brow = (at("46") + at("37")) / 2, nose = at("31") - brow,
                        mouth = (at("49") + at("55")) / 2 - brow;
  return eyes[0] > 0.8 * eyes.norm() && eyes.norm() > 60 && eyes.norm() < 140 && nose[2] > 20 && mouth[1] < -40;
}

struct Count {
  int right = 0, reported = 0, wrong = 0;
};

int run(int argc, char** argv) {
  const double mm = argc > 2 ? std::atof(argv[2]) : 1, tilt = argc > 3 ? std::atof(argv[3]) : 0;
  const MultiresTemplate reference = default_reference();
  const auto files = find_scans(argv[1]);
  std::vector<Variant> list = variants();
  if (argc > 4) list.resize(std::min<size_t>(list.size(), static_cast<size_t>(std::atoi(argv[4]))));
  std::map<std::string, Count> counts;
  double least_margin = 1e9, highest_cost = 0, seconds = 0;
  Scan scan;
  for (size_t i = 0; i < list.size(); ++i) {
    const Variant& v = list[i];
    ScanOptions options;
    options.units = mm == 1000 ? Units::m : mm == 10 ? Units::cm : Units::mm;
    scan = load_scan(files[i % files.size()], options);
    Random random(i + 1);
    Eigen::Matrix3d lean = Eigen::Matrix3d::Identity();
    if (tilt > 0)
      lean = Eigen::AngleAxisd(random.uniform() * tilt * std::numbers::pi / 180,
                               Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized());
    const Eigen::Vector3d mirror(v.mirrored ? -1 : 1, 1, 1);
    const Eigen::Matrix3d A = v.turn * mirror.asDiagonal() * lean / v.mm_per_unit;
    Mesh mesh = transformed(scan.mesh, v, A);
    Landmarks landmarks = scan.landmarks;
    for (auto& entry : landmarks) entry.second.position = A * entry.second.position;
    const auto start = std::chrono::steady_clock::now();
    const FrameDetection d = detect_frame(mesh, reference);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    convert_to_head_axes(d, &mesh, &landmarks);
    Count& count = counts[v.kind];
    const bool right = d.summary.decided && d.mm_per_unit == v.mm_per_unit && d.mirrored == v.mirrored &&
                       d.flip_triangles == v.flipped && is_upright(landmarks);
    ++(right ? count.right : d.summary.decided ? count.wrong : count.reported);
    const auto& c = d.summary.candidates;
    if (!c.empty()) highest_cost = std::max(highest_cost, c[0].cost);
    if (c.size() > 1) least_margin = std::min(least_margin, c[1].cost - c[0].cost);
    if (!right && (d.summary.decided || std::string(v.kind) != "mirrored, no texture"))
      std::printf("%s, %s: %s%s\n", scan.id.c_str(), v.kind, d.summary.explanation.c_str(), d.summary.problem.c_str());
    else if (i % 24 == 0)
      std::printf("  %s, %s: %s%s\n", scan.id.c_str(), v.kind, d.summary.explanation.c_str(),
                  d.summary.problem.c_str());
    std::fflush(stdout);
  }
  std::printf("\n| variant | decided rightly | not decided, reported | silent errors |\n|---|---|---|---|\n");
  for (const auto& [kind, n] : counts)
    std::printf("| %s | %d | %d | %d |\n", kind.c_str(), n.right, n.reported, n.wrong);
  std::printf("\nhighest cost %.2f, least margin %.2f, %.2f s per detection\n", highest_cost, least_margin,
              seconds / static_cast<double>(list.size()));
  return 0;
}

}  // namespace
}  // namespace facewright

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: frame_tables FOLDER [MM_PER_UNIT] [TILT_DEGREES] [VARIANTS]\n");
    return 2;
  }
  return facewright::run(argc, argv);
}
