// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/texture_stage.h"

#include <gtest/gtest.h>

#include "libmodel/io/atomic_file.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

// A bent sheet of 9 x 9 vertices with one more level: the midpoint of its first edge.
MultiresTemplate small_reference() {
  MultiresTemplate t;
  const int m = 9;
  t.V.resize(m * m + 1, 3);
  Faces F(2 * (m - 1) * (m - 1), 3);
  for (int j = 0, f = 0; j < m; ++j)
    for (int i = 0; i < m; ++i) {
      const double x = 10 * (i - 4), y = 10 * (j - 4) + 0.3 * i;
      t.V.row(j * m + i) << x, y, 40 - 0.01 * (x * x + y * y);
      if (i + 1 == m || j + 1 == m) continue;
      F.row(f++) << j * m + i, j * m + i + 1, j * m + m + i + 1;
      F.row(f++) << j * m + i, j * m + m + i + 1, j * m + m + i;
    }
  t.V.row(m * m) = 0.5 * (t.V.row(0) + t.V.row(1));
  t.levels = {{m * m, F}, {m * m + 1, F}};
  t.parents = {{0, 1, -1}};
  return t;
}

TEST(TextureStage, TheSameInputIsFlattenedOnceAndGivesTheSameBytes) {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "isomap.json";
  const MultiresTemplate reference = small_reference();
  const TextureStage first = texture_stage(reference, reference.V, file);
  const std::string bytes = read_file(file);
  const TextureStage second = texture_stage(reference, reference.V, file, {.threads = 1});
  EXPECT_FALSE(first.reused);
  EXPECT_TRUE(second.reused);
  EXPECT_EQ(first.texture.uv, second.texture.uv);
  EXPECT_EQ(first.texture.uv, isomap_texture(reference, reference.V).uv);
  EXPECT_EQ(first.texture.base.final_stress, second.texture.base.final_stress);
  EXPECT_EQ(first.texture.base.distortion.l2, second.texture.base.distortion.l2);
  EXPECT_EQ(read_file(file), bytes);
}

TEST(TextureStage, AnotherShapeTopologyOrOptionIsFlattenedAnew) {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "isomap.json";
  MultiresTemplate reference = small_reference();
  texture_stage(reference, reference.V, file);
  Vertices moved = reference.V;
  moved(40, 2) += 1e-9;
  EXPECT_FALSE(texture_stage(reference, moved, file).reused);
  EXPECT_FALSE(texture_stage(reference, moved, file, {.stretch_weight = 0.01}).reused);
  EXPECT_TRUE(texture_stage(reference, moved, file, {.stretch_weight = 0.01}).reused);
  const Eigen::RowVector3i last = reference.levels[0].F.row(0);
  reference.levels[0].F.row(0) << last[1], last[2], last[0];
  EXPECT_FALSE(texture_stage(reference, moved, file, {.stretch_weight = 0.01}).reused);
}

TEST(TextureStage, AFileThatIsNotOursIsWrittenAnew) {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "isomap.json";
  const MultiresTemplate reference = small_reference();
  const TexCoords uv = texture_stage(reference, reference.V, file).texture.uv;
  const std::string bytes = read_file(file);
  for (const std::string& broken : {std::string("{"), std::string("[1, 2]"), bytes.substr(0, bytes.size() / 2),
                                    std::string(bytes).replace(bytes.find("\"uv\":[["), 7, "\"uv\":[[null,")}) {
    write_file(file, broken);
    const TextureStage stage = texture_stage(reference, reference.V, file);
    EXPECT_FALSE(stage.reused);
    EXPECT_EQ(stage.texture.uv, uv);
    EXPECT_EQ(read_file(file), bytes);
  }
}

}  // namespace
}  // namespace facewright
