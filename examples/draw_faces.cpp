// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <string>

#include "libmodel/core/random.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"

// draw_faces MODEL.h5 COUNT OUT_PREFIX: random faces at the coarsest level; the same ones every time.
int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const facewright::MorphableModel model = facewright::load_model(argv[1]);
  facewright::Random random(/*seed=*/1);
  for (int i = 0; i < std::stoi(argv[2]); ++i)
    facewright::write_ply(argv[3] + std::to_string(i) + ".ply", model.sample(random, /*level=*/0, /*sigma=*/0.75));
}
