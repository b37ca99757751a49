// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libmodel/core/parallel.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/synthetic/scan_person.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

struct Settings {
  int count = 24;
  int first = 0;
  bool texture = false;
  int texture_size = 1024;
  bool truth = true;
  DrawOptions draw;
  ScannerOptions scan;
};

std::string scan_id(int index) {
  std::array<char, 16> id;
  std::snprintf(id.data(), id.size(), "p%03d", index);
  return id.data();
}

double file_unit(const std::string& name) { return name == "m" ? 0.001 : name == "cm" ? 0.1 : 1; }

/// NumPy array file, format 1.0: one row per scan vertex: canonical triangle, three barycentric coordinates.
std::string npy_bytes(const std::vector<SurfacePoint>& points) {
  std::string header =
      "{'descr': '<f8', 'fortran_order': False, 'shape': (" + std::to_string(points.size()) + ", 4), }";
  header.append(64 - (10 + header.size() + 1) % 64, ' ').push_back('\n');
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes.push_back(static_cast<char>(header.size() & 255));
  bytes.push_back(static_cast<char>(header.size() >> 8));
  bytes += header;
  for (const SurfacePoint& p : points) {
    const std::array<double, 4> row{static_cast<double>(p.triangle), p.barycentric[0], p.barycentric[1],
                                    p.barycentric[2]};
    bytes.append(reinterpret_cast<const char*>(row.data()), sizeof row);
  }
  return bytes;
}

std::vector<double> list(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

std::string truth_json(const ParametricFace& face, const SyntheticPerson& person, const SyntheticScan& scan) {
  nlohmann::ordered_json json;
  for (size_t k = 0; k < face.parameters().size(); ++k)
    json["shape_parameters"][face.parameters()[k].name] = person.shape[static_cast<Eigen::Index>(k)];
  json["individuality_mm"] = person.individuality;
  json["asymmetry_mm"] = person.asymmetry;
  const Appearance& a = person.appearance;
  json["appearance"] = {
      {"skin", list(a.skin)}, {"hair", list(a.hair)},      {"iris", list(a.iris)},   {"lips", a.lips},
      {"blush", a.blush},     {"mottling", a.mottling},    {"freckles", a.freckles}, {"beard", a.beard},
      {"brows", a.brows},     {"scalp_hair", a.scalp_hair}};
  const Similarity& pose = scan.scanner_from_head;
  for (int r = 0; r < 3; ++r) json["scanner_from_head"]["R"].push_back(list(pose.R.row(r).transpose()));
  json["scanner_from_head"]["t_mm"] = list(pose.t);
  for (size_t v = 0; v < scan.spike.size(); ++v)
    if (scan.spike[v]) json["spikes"].push_back(v);
  return json.dump(1) + "\n";
}

void write_scan(const Settings& s, const std::filesystem::path& folder, const std::string& id,
                const ParametricFace& face, const SyntheticPerson& person, SyntheticScan scan) {
  if (s.texture) {
    write_png(folder / (id + ".png"), paint_texture(face, person, scan, s.texture_size));
    scan.mesh.colours.resize(0, 3);
    write_obj(folder / (id + ".obj"), scan.mesh, ObjMaterial{id + ".png"});
  } else {
    scan.mesh.uv.resize(0, 2);
    write_ply(folder / (id + ".ply"), scan.mesh);
  }
  write_landmarks(folder / (id + ".json"), scan.landmarks);
  if (!s.truth) return;
  const auto truth = folder / "truth";
  write_ply(truth / (id + ".ply"), scan.truth);
  write_file(truth / (id + ".json"), truth_json(face, person, scan));
  write_landmarks(truth / (id + ".landmarks.json"), scan.true_landmarks);
  write_file(truth / (id + ".sources.npy"), npy_bytes(scan.source));
}

void write_mean(const std::filesystem::path& folder, const ParametricFace& face) {
  write_ply(folder / "truth" / "canonical.ply", face.mean());
  write_landmarks(folder / "truth" / "canonical.landmarks.json",
                  locate(face.landmarks(), face.mean().V, face.mean().F));
}

void add_options(CLI::App& app, Settings& s) {
  app.add_option("-n,--count", s.count, "Number of people, one scan each")->check(CLI::Range(1, 100000));
  app.add_option("--first", s.first, "Index of the first person: the same people whatever the count")
      ->check(CLI::Range(0, 1000000));
  app.add_option("--spacing", s.scan.spacing, "Distance of samples, mm");
  app.add_option("--noise", s.scan.noise, "Range noise, mm (standard deviation)");
  app.add_option("--spikes", s.scan.spikes, "Share of vertices thrown off the surface");
  app.add_option("--holes", s.scan.holes, "Holes per scan");
  app.add_option("--pose", s.scan.pose_deg, "Largest head rotation, degrees");
  app.add_option("--landmark-noise", s.scan.landmark_noise, "Landmark error, mm (root mean square distance)");
  app.add_option("--missing-landmarks", s.scan.missing_landmarks, "Share of landmarks left out");
  app.add_option("--field-of-view", s.scan.field_of_view_deg, "Degrees seen to either side");
  app.add_option("--spread", s.draw.spread, "How different the people are, 1 = as published");
  app.add_option("--asymmetry", s.draw.asymmetry, "Smooth asymmetry, mm (root mean square)");
  app.add_flag("--texture", s.texture, "OBJ with a texture image instead of PLY with vertex colours");
  app.add_option("--texture-size", s.texture_size, "Width and height of the texture, pixels");
  app.add_flag("!--no-truth", s.truth, "Leave out the planted truth");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Scans of synthetic people, with landmarks and the truth they were made from.", "generate-scans");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs | CommonFlags::seed | CommonFlags::units,
                     "generate-scans -n 24 --seed 1 -o scans");
  Settings settings;
  add_options(app, settings);
  return run_program(argc, argv, app, common, [&] {
    settings.scan.unit = file_unit(common.units);
    CanonicalMeshOptions mesh_options;
    mesh_options.threads = common.jobs;
    const ParametricFace face(mesh_options);
    if (settings.truth) write_mean(common.output, face);
    ProgressBar bar(common);
    std::atomic<int> done = 0;
    parallel_for(settings.count, common.jobs, [&](int i) {
      const int index = settings.first + i;
      const SyntheticPerson person = draw_person(face, common.seed, static_cast<std::uint64_t>(index), settings.draw);
      write_scan(settings, common.output, scan_id(index), face, person,
                 scan_person(face, person, common.seed, static_cast<std::uint64_t>(index), settings.scan));
      bar.update({"scanning", ++done, settings.count, scan_id(index)});
    });
    report(common, "generate-scans: wrote " + std::to_string(settings.count) + " scans to " + common.output.string());
    return ExitCode::ok;
  });
}
