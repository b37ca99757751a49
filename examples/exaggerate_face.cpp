// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/similarity.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/model/model_file.h"

// exaggerate_face MODEL.h5 FACE.ply OUT.ply: a caricature, what sets a registered face apart from the mean times 1.5.
int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const facewright::MorphableModel model = facewright::load_model(argv[1]);
  facewright::Mesh face = facewright::read_mesh(argv[2]);
  const auto model_from_face = facewright::fit_similarity(face.V, model.mean().V, facewright::Scaling::fixed);
  const Eigen::VectorXd shape = model.coefficients(model_from_face.apply(face.V));
  face.V = model.instance(1.5 * shape).V;
  facewright::write_ply(argv[3], face);
}
