// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <string>

#include "libmodel/io/image_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/render_mesh.h"

// render_turn MESH.ply OUT_PREFIX: seven pictures of a mesh, from one side to the other.
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const facewright::Mesh mesh = facewright::read_mesh(argv[1]);
  for (int i = 0; i < 7; ++i) {
    const double yaw = (i - 3) * 0.4;  // radians
    const auto camera = facewright::frame_camera(mesh.V, 320, 320, yaw);
    facewright::write_png(argv[2] + std::to_string(i) + ".png",
                          facewright::render_mesh(mesh, camera, {.width = 320, .height = 320}));
  }
}
