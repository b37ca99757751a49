// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <iostream>

#include "libmodel/io/mesh_files.h"
#include "libregister/intake/scan.h"
#include "libregister/registration/denoise.h"

// denoise_scan SCAN.ply OUT.ply: takes spikes and noise off a scan.
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const facewright::Scan scan = facewright::load_scan(facewright::files_of_scan(argv[1]));
  const auto result = facewright::denoise(scan.mesh);
  std::cout << "noise of " << result.summary.noise << " mm\n";
  facewright::write_ply(argv[2], result.mesh);
}
