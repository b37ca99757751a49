// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/core/similarity.h"
#include "libmodel/io/mesh_files.h"

// average_faces A.ply B.ply OUT.ply: the face half way between two registered ones. A row of both is the same place,
// so nothing has to be searched: B is moved onto A, and the rows are averaged.
int main(int argc, char** argv) {
  if (argc != 4) return 2;
  facewright::Mesh a = facewright::read_mesh(argv[1]);
  const facewright::Mesh b = facewright::read_mesh(argv[2]);
  const facewright::Similarity a_from_b = facewright::fit_similarity(b.V, a.V, facewright::Scaling::fixed);
  a.V = (a.V + a_from_b.apply(b.V)) / 2;
  a.colours = (a.colours + b.colours) / 2;
  facewright::write_ply(argv[3], a);
}
