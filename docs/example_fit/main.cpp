// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <iostream>
#include <numbers>

#include "libmodel/fitting/fit_landmarks.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"

// Fits a model to the landmarks of a picture and writes the face as a mesh, coarse and fine.
int main(int argc, char** argv) {
  using namespace facewright;
  if (argc != 3) {
    std::cerr << "usage: example_fit model.h5 landmarks.pts\n";
    return 2;
  }
  try {
    const MorphableModel model = load_model(argv[1]);
    const FitResult fit = fit_landmarks(model, read_image_landmarks(argv[2]));
    std::cout << "landmark error " << fit.summary.rms_percent << " % of the outer eye distance after "
              << fit.summary.iterations << " rounds, head turned by " << fit.pose.yaw * 180 / std::numbers::pi
              << " degrees\n";
    for (int level = 0; level < model.level_count(); ++level)  // the same coefficients at every level
      write_ply("face_" + std::to_string(model.vertex_count(level)) + ".ply",
                model.instance(fit.shape_coefficients, {}, level));
  } catch (const std::exception& e) {  // InvalidInput, IoError: the message says it all
    std::cerr << "example_fit: " << e.what() << "\n";
    return 1;
  }
}
