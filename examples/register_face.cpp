// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <iostream>

#include "libmodel/io/mesh_files.h"
#include "libregister/intake/scan.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/register_scan.h"

// register_face SCAN.ply OUT.ply: brings a scan with landmarks beside it into correspondence with the reference face.
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const facewright::Scan scan = facewright::load_scan(facewright::files_of_scan(argv[1]));
  const facewright::MultiresTemplate reference = facewright::default_reference();
  const auto result = facewright::register_scan(scan.mesh, scan.landmarks, reference);
  std::cout << result.summary.matched << " vertices found their place\n";
  facewright::write_ply(argv[2], {result.V, reference.levels.back().F, {}, {}, {}});
}
