// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// A reference face of one's own from any head mesh and its landmarks.
#include <cstdio>
#include <iostream>
#include <map>

#include "libmodel/core/errors.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/intake/scan.h"
#include "libregister/reference/remesh_half.h"
#include "pipelines/make_reference.h"
#include "pipelines/reference_file.h"
#include "tools/scan_flags.h"

using namespace facewright;

namespace {

std::string rounded(double x, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, x);
  return text;
}

void print_summary(const CommonOptions& common, const MakeReferenceSummary& s, double radius) {
  std::map<std::string, std::string> reasons;
  for (const auto& [name, reason] : s.left_out) reasons[reason] += " " + name;
  for (const auto& [reason, names] : reasons)
    std::cerr << "make-reference: landmarks left out (" << reason << "):" << names << "\n";
  if (radius > s.nearest_rim + 1)
    std::cerr << "make-reference: --radius " << rounded(radius, 0) << " was not reached"
              << (radius > s.farthest_rim + 1 ? "" : " everywhere") << ": the rim lies " << s.rim << ", "
              << rounded(s.nearest_rim, 0) << " to " << rounded(s.farthest_rim, 0) << " mm from the tip of the nose\n";
  if (s.off_mesh_percent > 10)
    std::cerr << "make-reference: " << rounded(s.off_mesh_percent, 0)
              << " % of the face lies off the mesh and was filled in; a smaller --radius leaves it out\n";
  const ReferenceCheck& c = s.check;
  int derived = 0;
  for (const ReferenceLandmark& l : s.landmarks) derived += l.derived;
  report(common, "make-reference: " + std::to_string(c.vertices) + " vertices, " + std::to_string(c.triangles) +
                     " triangles, " + std::to_string(c.boundary_edges) + " boundary edges, Euler characteristic " +
                     std::to_string(c.euler_characteristic) + (c.symmetric ? ", symmetric" : ", NOT symmetric"));
  report(common, "make-reference: angles from " + rounded(c.smallest_angle_deg, 1) + " degrees, sharpest fold " +
                     rounded(c.sharpest_fold_deg, 1) + " degrees, " + std::to_string(c.self_intersections) +
                     " self-intersections, rim " + rounded(s.nearest_rim, 0) + " to " + rounded(s.farthest_rim, 0) +
                     " mm from the tip of the nose (" + s.rim + ")");
  report(common, "make-reference: " + std::to_string(s.landmarks.size() - static_cast<size_t>(derived)) +
                     " landmarks as given, mean " + rounded(s.symmetric_mean, 2) + " mm, at most " +
                     rounded(s.symmetric_max, 2) + " mm off (before symmetry " + rounded(s.registered_mean, 2) + ", " +
                     rounded(s.registered_max, 2) + "); " + std::to_string(derived) +
                     " carried over from the built-in face; the face was " + rounded(s.asymmetry_rms, 2) +
                     " mm from symmetric");
  if (s.eyeballs_removed > 0) detail(common, "  eyeballs taken out: " + std::to_string(s.eyeballs_removed));
  for (const ReferenceLandmark& l : s.landmarks)
    detail(common, "  " + l.name +
                       (l.derived ? ": carried over"
                                  : ": " + rounded(l.symmetric_distance, 2) + " mm (before symmetry " +
                                        rounded(l.registered_distance, 2) + ")"));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Makes a symmetric reference face of any head mesh: cropped, triangulated anew, marked, for build-model.",
      "make-reference");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::units,
                     "make-reference head.obj --landmarks head.json -o head.reference");
  std::filesystem::path mesh, landmarks, save_mesh;
  MakeReferenceOptions options;
  bool no_slit = false;
  app.add_option("mesh", mesh, "Head mesh (OBJ, PLY, STL, OFF, glTF)")->required();
  app.add_option("--landmarks", landmarks,
                 "Its landmarks (.json, .pts, .pp, .mrk.json, .fcsv, .ljson), at least six of the built-in face's")
      ->required();
  app.add_option("--vertices", options.vertices, "Vertices of the reference")
      ->check(CLI::Range(least_reference_vertices, most_reference_vertices));
  app.add_option("--radius", options.radius,
                 "Geodesic distance from the tip of the nose to the rim, mm; 0: as far as the built-in face reaches")
      ->check(CLI::Range(0.0, 400.0));
  app.add_flag("--no-mouth-slit", no_slit, "Leave the mouth closed: no cut between the lips");
  app.add_flag("--keep-eyeballs", options.keep_eyeballs, "Lay the face over eyeballs instead of taking them out");
  app.add_option("--save-mesh", save_mesh, "Also write the reference as a mesh (.ply)");
  return run_program(argc, argv, app, common, [&] {
    options.mouth_slit = !no_slit;
    const Scan scan = load_scan({mesh.stem().string(), mesh, landmarks}, scan_options(common));
    ProgressBar bar(common);
    MakeReferenceResult result;
    try {
      result = make_reference(scan.mesh, scan.landmarks, options, bar.progress());
    } catch (const InvalidInput& e) {
      throw InvalidInput(mesh.string() + ": " + e.what());
    }
    save_reference_file(common.output, result.face);
    if (!save_mesh.empty()) write_ply(save_mesh, result.face.mesh);
    print_summary(common, result.summary, options.radius);
    report(common, "make-reference: wrote " + common.output.string());
    return ExitCode::ok;
  });
}
