// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/mesh_files.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/image.h"
#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "tests/libmodel/io/scratch_folder.h"

namespace facewright {
namespace {

class MeshFiles : public ScratchFolder {
 protected:
  Mesh parse(const std::string& name, const std::string& text) {
    write_file(folder_ / name, text);
    return read_mesh(folder_ / name);
  }
};

Mesh random_mesh(int vertices, int faces) {
  Random random(5);
  Mesh mesh;
  mesh.V = Vertices::NullaryExpr(vertices, 3, [&] { return 100 * random.normal(); });
  mesh.F = Faces::NullaryExpr(faces, 3, [&] { return random.index(vertices); });
  return mesh;
}

/// Colours that sRGB bytes can hold.
Colours byte_colours(int n) {
  Random random(6);
  return Colours::NullaryExpr(n, 3, [&] { return linear_from_srgb8(static_cast<std::uint8_t>(random.index(256))); });
}

TEST_F(MeshFiles, TextFormatsRoundTripExactlyInOrder) {
  Mesh mesh = random_mesh(200, 300);
  mesh.colours = byte_colours(200);
  mesh.uv = TexCoords::Random(200, 2);
  write_ply(folder_ / "a.ply", mesh, PlyFormat::ascii);
  write_obj(folder_ / "a.obj", mesh);
  for (const char* name : {"a.ply", "a.obj"}) {
    const Mesh back = read_mesh(folder_ / name);
    EXPECT_EQ(back.V, mesh.V) << name;
    EXPECT_EQ(back.F, mesh.F) << name;
    EXPECT_EQ(back.uv, mesh.uv) << name;
    EXPECT_EQ(back.uv_faces.rows(), 0) << name;
    ASSERT_TRUE(back.has_colours()) << name;
    EXPECT_LT((back.colours - mesh.colours).cwiseAbs().maxCoeff(), 1e-6) << name;  // float text in OBJ
  }
}

TEST_F(MeshFiles, BinaryPlyRoundTripsToFloatPrecision) {
  Mesh mesh = random_mesh(200, 300);
  mesh.colours = byte_colours(200);
  write_ply(folder_ / "a.ply", mesh);
  const Mesh back = read_mesh(folder_ / "a.ply");
  EXPECT_EQ(back.V, Vertices(mesh.V.cast<float>().cast<double>()));
  EXPECT_EQ(back.F, mesh.F);
  EXPECT_LT((back.colours - mesh.colours).cwiseAbs().maxCoeff(), 1e-12);
  write_ply(folder_ / "b.ply", back);
  EXPECT_EQ(read_file(folder_ / "b.ply"), read_file(folder_ / "a.ply"));
}

TEST_F(MeshFiles, WedgeCoordinatesSurviveEveryFormat) {
  Mesh mesh = random_mesh(20, 30);
  mesh.uv = TexCoords::Random(90, 2).cast<float>().cast<double>();
  mesh.uv_faces = Faces::NullaryExpr(30, 3, [](Eigen::Index r, Eigen::Index c) { return static_cast<int>(3 * r + c); });
  write_ply(folder_ / "binary.ply", mesh);
  write_ply(folder_ / "ascii.ply", mesh, PlyFormat::ascii);
  write_obj(folder_ / "a.obj", mesh);
  for (const char* name : {"binary.ply", "ascii.ply", "a.obj"}) {
    const Mesh back = read_mesh(folder_ / name);
    ASSERT_EQ(back.uv_faces.rows(), 30) << name;
    for (int f = 0; f < 30; ++f)
      for (int k = 0; k < 3; ++k) EXPECT_EQ(back.uv.row(back.uv_faces(f, k)), mesh.uv.row(mesh.uv_faces(f, k))) << name;
  }
}

TEST_F(MeshFiles, ObjFansPolygonsResolvesNegativeIndicesAndKeepsUnusedVertices) {
  const Mesh mesh = parse("a.obj",
                          "# a comment\no thing\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\ns off\n"
                          "f 1//1 2//1 3//1 4//1\nf -5 -4 -3\n");
  EXPECT_EQ(mesh.V.rows(), 5);
  ASSERT_EQ(mesh.F.rows(), 3);
  EXPECT_EQ(mesh.F.row(0), Eigen::RowVector3i(0, 1, 2));
  EXPECT_EQ(mesh.F.row(1), Eigen::RowVector3i(0, 2, 3));
  EXPECT_EQ(mesh.F.row(2), Eigen::RowVector3i(0, 1, 2));
}

TEST_F(MeshFiles, ObjColoursMayRunToOneOrTo255) {
  const Mesh unit = parse("a.obj", "v 0 0 0 0.5 0 1\n"), bytes = parse("b.obj", "v 0 0 0 127.5 0 255\n");
  EXPECT_NEAR(unit.colours(0, 0), linear_from_srgb(0.5), 1e-12);
  EXPECT_NEAR((unit.colours - bytes.colours).norm(), 0, 1e-12);
}

TEST_F(MeshFiles, ObjCornersWithoutCoordinatesGetAPlaceholder) {
  const Mesh mesh = parse("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt .5 .25\nf 1/1 2/1 3/1\nf 3 2 1\r\n");
  ASSERT_EQ(mesh.uv_faces.rows(), 2);
  EXPECT_EQ(mesh.uv.row(mesh.uv_faces(0, 0)), Eigen::RowVector2d(.5, .25));
  EXPECT_EQ(mesh.uv.row(mesh.uv_faces(1, 0)), Eigen::RowVector2d(0, 0));
}

TEST_F(MeshFiles, BigEndianPlyReadsLikeLittleEndian) {
  const std::string header =
      "format binary_big_endian 1.0\nelement vertex 3\nproperty double x\nproperty float y\nproperty short z\n"
      "element face 1\nproperty list uint8 uint32 vertex_index\nend_header\n";
  const auto big = [](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    return std::string(bytes.rbegin(), bytes.rend());
  };
  std::string body;
  for (int i = 0; i < 3; ++i)
    body += big(1.5 * i) + big(-2.25f * static_cast<float>(i)) + big(static_cast<short>(i - 300));
  body += big(static_cast<std::uint8_t>(3)) + big(2u) + big(1u) + big(0u);
  const Mesh mesh = parse("a.ply", "ply\n" + header + body);
  EXPECT_EQ(mesh.V.row(2), Eigen::RowVector3d(3, -4.5, -298));
  EXPECT_EQ(mesh.F.row(0), Eigen::RowVector3i(2, 1, 0));
}

TEST_F(MeshFiles, PlySkipsWhatItDoesNotKnow) {
  const Mesh mesh =
      parse("a.ply",
            "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement vertex 3\r\nproperty float nx\r\n"
            "property float x\r\nproperty float y\r\nproperty list uchar int extra\r\nproperty float z\r\n"
            "element edge 1\r\nproperty int vertex1\r\nproperty int vertex2\r\nelement face 1\r\n"
            "property uchar flags\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
            "0 1 2 2 7 7 3\r\n0 4 5 0 6\r\n0 7 8 1 1 9\r\n0 1\r\n255 3 0 1 2\r\n");
  EXPECT_EQ(mesh.V.row(1), Eigen::RowVector3d(4, 5, 6));
  EXPECT_EQ(mesh.F.row(0), Eigen::RowVector3i(0, 1, 2));
}

TEST_F(MeshFiles, TextureIsFoundThroughTheMaterialFile) {
  Mesh mesh = random_mesh(4, 2);
  mesh.uv = TexCoords::Zero(4, 2);
  write_obj(folder_ / "a.obj", mesh, ObjMaterial{"a_isomap.png"});
  EXPECT_FALSE(texture_file(folder_ / "a.obj"));
  write_file(folder_ / "a_isomap.png", "x");
  EXPECT_EQ(texture_file(folder_ / "a.obj"), folder_ / "a_isomap.png");
  write_ply(folder_ / "a.ply", mesh);
  EXPECT_FALSE(texture_file(folder_ / "a.ply"));
}

TEST_F(MeshFiles, WritersRefuseInconsistentMeshes) {
  Mesh mesh = random_mesh(4, 2);
  mesh.F(0, 0) = 4;
  EXPECT_THROW(write_ply(folder_ / "a.ply", mesh), InvalidInput);
  EXPECT_THROW(write_obj(folder_ / "a.obj", mesh), InvalidInput);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.ply"));
}

}  // namespace
}  // namespace facewright
