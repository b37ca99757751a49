// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"

// make_face MODEL.h5 OUT.ply: a face by its coefficients, here two standard deviations out along the first mode.
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const facewright::MorphableModel model = facewright::load_model(argv[1]);
  Eigen::VectorXd shape = Eigen::VectorXd::Zero(model.shape().mode_count());
  shape[0] = 2;
  facewright::write_ply(argv[2], model.instance(shape));
}
