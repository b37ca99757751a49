// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <iostream>

#include "libmodel/core/errors.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"

// Writes the mean face of every level of a model.
int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: example_fit model.h5\n";
    return 2;
  }
  try {
    const facewright::MorphableModel model = facewright::load_model(argv[1]);
    for (int level = 0; level < model.level_count(); ++level)
      facewright::write_ply("mean_" + std::to_string(model.vertex_count(level)) + ".ply", model.mean(level));
  } catch (const std::exception& e) {  // InvalidInput, IoError: the message says it all
    std::cerr << "example_fit: " << e.what() << "\n";
    return 1;
  }
}
