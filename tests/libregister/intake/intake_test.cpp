// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <fstream>

#include "libmodel/core/errors.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/intake/mesh_import.h"
#include "libregister/intake/repair.h"
#include "libregister/intake/scan.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

void write_text(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

TEST(ImportMesh, PlyKeepsPositionsAndColours) {
  const TemporaryDirectory folder;
  Mesh m = icosphere(3, 80);
  m.colours = (m.V.array() / 160 + 0.5).matrix();
  write_ply(folder / "a.ply", m);
  const Mesh back = import_mesh(folder / "a.ply").mesh;
  ASSERT_EQ(back.V.rows(), m.V.rows());
  EXPECT_EQ(back.F.rows(), m.F.rows());
  EXPECT_THAT(back.V, VerticesNear(m.V, 1e-5));              // float32 on disk
  EXPECT_THAT(back.colours, VerticesNear(m.colours, 0.01));  // 8-bit sRGB on disk
}

TEST(ImportMesh, WeldsTheSeamsOfATexturedObjAndFindsItsImage) {
  const TemporaryDirectory folder;
  write_png(folder / "skin.png", Image(4, 4, 3, 100));
  write_text(folder / "a.mtl", "newmtl skin\nmap_Kd skin.png\n");
  write_text(folder / "a.obj",
             "mtllib a.mtl\nv 0 0 0\nv 100 0 0\nv 0 100 0\nv 100 100 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 1 1\nvt 0.5 0.5\n"
             "usemtl skin\nf 1/1 2/2 3/3\nf 2/5 4/4 3/3\n");
  const ImportedMesh a = import_mesh(folder / "a.obj");
  EXPECT_EQ(a.mesh.V.rows(), 4);  // vertex 2 carries two texture coordinates but is one vertex
  EXPECT_EQ(a.mesh.F.rows(), 2);
  EXPECT_EQ(a.mesh.uv_faces.rows(), 2);
  EXPECT_EQ(a.texture.filename(), "skin.png");
}

TEST(ImportMesh, RefusesATextureOutsideTheFolder) {
  const TemporaryDirectory folder;
  std::filesystem::create_directories(folder / "scan");
  write_png(folder / "secret.png", Image(4, 4, 3, 100));
  write_text(folder / "scan/a.mtl", "newmtl skin\nmap_Kd ../secret.png\n");
  write_text(folder / "scan/a.obj",
             "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3\n");
  const ImportedMesh a = import_mesh(folder / "scan/a.obj");
  EXPECT_TRUE(a.texture.empty());
  EXPECT_EQ(a.warnings.size(), 1u);
}

TEST(ImportMesh, TexturesThatNoSystemCanNameAreMissingAndLinksOutAreNotFollowed) {
  const TemporaryDirectory folder;
  std::filesystem::create_directories(folder / "scan");
  write_png(folder / "secret.png", Image(4, 4, 3, 100));
  std::filesystem::create_symlink(folder / "secret.png", folder / "scan/link.png");
  for (const std::string& name : {std::string(5000, 'a'), std::string("link.png"), (folder / "secret.png").string()}) {
    write_text(folder / "scan/a.mtl", "newmtl skin\nmap_Kd " + name + "\n");
    write_text(folder / "scan/a.obj",
               "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3\n");
    const ImportedMesh a = import_mesh(folder / "scan/a.obj");
    EXPECT_TRUE(a.texture.empty()) << name;
    EXPECT_EQ(a.warnings.size(), 1u) << name;
  }
}

TEST(ImportMesh, ADamagedFileThatCrashesAssimpIsAnErrorThatNamesIt) {
  const TemporaryDirectory folder;
  write_text(folder / "a.off", "OFF\n" + std::string(40, '9') + " 8 0\n0 0 0\n");
  try {
    import_mesh(folder / "a.off");
    ADD_FAILURE() << "was read";
  } catch (const IoError& error) {
    EXPECT_NE(std::string(error.what()).find("a.off"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("damaged"), std::string::npos) << error.what();
  }
}

TEST(ImportMesh, ReadsStlAndOff) {
  const TemporaryDirectory folder;
  write_text(folder / "a.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n");
  write_text(
      folder / "a.stl",
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
      "facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
  for (const char* name : {"a.off", "a.stl"}) {
    const Mesh m = import_mesh(folder / name).mesh;
    EXPECT_EQ(m.V.rows(), 4) << name;  // STL repeats its vertices
    EXPECT_EQ(m.F.rows(), 2) << name;
  }
}

TEST(ImportMesh, ExplainsFilesThatAreNoMesh) {
  const TemporaryDirectory folder;
  write_text(folder / "empty.ply", "");
  write_text(folder / "noise.obj", "this is no mesh\n");
  write_text(folder / "points.ply",
             "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float "
             "z\nend_header\n0 0 0\n1 1 1\n");
  for (const char* name : {"empty.ply", "noise.obj", "points.ply", "missing.obj"})
    EXPECT_THROW(import_mesh(folder / name), IoError) << name;
}

TEST(ImportMesh, BinaryDataThatBeginsLikeALineEndIsReadAsData) {
  const TemporaryDirectory folder;
  for (const std::uint32_t first : {0x3f80000au, 0x3f800a0au, 0x3f800a0du, 0x3f800020u}) {
    Mesh m = icosphere(1, 10);
    m.V(0, 0) = std::bit_cast<float>(first);
    write_ply(folder / "a.ply", m);
    const Mesh back = import_mesh(folder / "a.ply").mesh;
    EXPECT_EQ(back.F, m.F);
    EXPECT_LT((back.V - m.V).cwiseAbs().maxCoeff(), 1e-5);  // float32
    EXPECT_EQ(back.V(0, 0), m.V(0, 0));
  }
}

TEST(ImportMesh, CountsThatTheFileCannotHoldAreRefusedInWords) {
  const TemporaryDirectory folder;
  const auto message = [&](const std::string& format, const std::string& vertices) {
    write_text(folder / "a.PLY", "ply\nformat " + format + " 1.0\nelement vertex " + vertices +
                                     "\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n" +
                                     "property list uchar int vertex_indices\nend_header\n1 2 3\n");
    try {
      import_mesh(folder / "a.PLY");
    } catch (const IoError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"})
    for (const char* count : {"4000000000", "2147483647", "99999999999999999999999", "-1"})
      EXPECT_THAT(message(format, count), ::testing::AllOf(::testing::HasSubstr("a.PLY:"),
                                                           ::testing::AnyOf(::testing::HasSubstr(count),
                                                                            ::testing::HasSubstr("the file holds 6")),
                                                           ::testing::Not(::testing::HasSubstr("alloc"))));
}

TEST(RepairMesh, LeavesAGoodMeshAlone) {
  const Mesh m = icosphere(3, 50);
  const RepairResult r = repair_mesh(m);
  EXPECT_FALSE(r.summary.anything());
  EXPECT_THAT(r.mesh.F, SameBytes(m.F));
}

TEST(RepairMesh, CountsAndDropsWhatIsWrong) {
  const Mesh good = icosphere(3, 50);
  Mesh m = good;
  const Eigen::Index n = good.V.rows();
  m.V.conservativeResize(n + 5, 3);
  m.V.bottomRows(5).setRandom();
  m.F.conservativeResize(good.F.rows() + 4, 3);
  m.F.row(good.F.rows()) << 0, 0, 1;                                              // degenerate
  m.F.row(good.F.rows() + 1) = good.F.row(7);                                     // duplicate
  m.F.row(good.F.rows() + 2) << good.F(3, 0), good.F(3, 1), static_cast<int>(n);  // a third triangle on an edge
  m.F.row(good.F.rows() + 3) << static_cast<int>(n + 1), static_cast<int>(n + 2), static_cast<int>(n + 3);  // a crumb
  const RepairResult r = repair_mesh(m);
  EXPECT_EQ(r.summary.degenerate, 1);
  EXPECT_EQ(r.summary.duplicate, 1);
  EXPECT_EQ(r.summary.non_manifold, 1);
  EXPECT_EQ(r.summary.island_triangles, 1);
  EXPECT_EQ(r.summary.unused_vertices, 5);
  EXPECT_THAT(r.mesh.F, SameBytes(good.F));
}

TEST(RepairMesh, RefusesAMeshOfNothing) { EXPECT_THROW(repair_mesh(Mesh{}), InvalidInput); }

TEST(DetectUnits, TellsMillimetresCentimetresAndMetres) {
  std::string reason;
  for (const auto& [size, expected] : {std::pair{90.0, 1.0}, {9.0, 10.0}, {0.09, 1000.0}}) {
    Landmarks l;
    l["37"].position = Eigen::Vector3d(-size / 2, 0, 0);
    l["46"].position = Eigen::Vector3d(size / 2, 0, 0);
    EXPECT_EQ(detect_mm_per_unit(Mesh{}, l, &reason), expected);
    EXPECT_FALSE(reason.empty());
  }
  Landmarks absurd;
  absurd["37"].position = Eigen::Vector3d(-20, 0, 0);
  absurd["46"].position = Eigen::Vector3d(3, 0, 0);
  EXPECT_THROW(detect_mm_per_unit(Mesh{}, absurd, &reason), InvalidInput);
}

TEST(LoadScan, ConvertsMetresToMillimetresWithItsLandmarks) {
  const TemporaryDirectory folder;
  Mesh m = icosphere(3, 0.1);
  write_ply(folder / "a.ply", m);
  write_landmarks(folder / "a.json",
                  {{"37", {{-0.045, 0, 0.09}, 0}}, {"46", {{0.045, 0, 0.09}, 0}}, {"31", {{0, -0.03, 0.1}, 0}}});
  const auto files = find_scans(folder.path());
  ASSERT_EQ(files.size(), 1u);
  const Scan scan = load_scan(files[0]);
  EXPECT_EQ(scan.mm_per_unit, 1000);
  EXPECT_NEAR(scan.mesh.V.rowwise().norm().maxCoeff(), 100, 1e-3);
  EXPECT_NEAR(scan.landmarks.at("46").position[0], 45, 1e-9);
}

TEST(FindScans, SortsByIdAndRefusesTwoOfAName) {
  const TemporaryDirectory folder;
  EXPECT_THROW(find_scans(folder.path()), InvalidInput);
  EXPECT_THROW(find_scans(folder / "missing"), IoError);
  for (const char* name : {"b.ply", "a.ply"}) write_ply(folder / name, icosphere(1, 10));
  write_text(folder / "b.pts", "");
  const auto files = find_scans(folder.path());
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].id, "a");
  EXPECT_FALSE(files[0].landmarks.has_value());
  EXPECT_TRUE(files[1].landmarks.has_value());
  write_text(folder / "a.obj", "");
  EXPECT_THROW(find_scans(folder.path()), InvalidInput);
}

TEST(FindScans, IdsAreUtf8WhateverTheFilesAreCalled) {
  const TemporaryDirectory folder;
  write_text(folder / "M\xfcller.ply", "ply\n");
  write_text(folder / "M\xfcller.json", "{}");
  const std::vector<ScanFiles> scans = find_scans(folder.path());
  ASSERT_EQ(scans.size(), 1u);
  EXPECT_EQ(scans[0].id, "M\xc3\xbcller");
  EXPECT_EQ(scans[0].mesh, folder / "M\xfcller.ply");
  EXPECT_EQ(scans[0].landmarks, folder / "M\xfcller.json");
}

TEST(FindScans, AManifestNamesScansLandmarksAndUnits) {
  const TemporaryDirectory folder;
  for (const char* name : {"b.ply", "a.ply"}) write_ply(folder / name, icosphere(2, 10));  // 10 cm as centimetres
  write_landmarks(folder / "marks.json", {{"31", {{0, 0, 10}, 0}}});
  write_text(folder / "people.csv", "file,id,landmarks,units\nb.ply,second,marks.json,cm\na.ply,first,,\n");
  const auto files = find_scans(read_manifest(folder / "people.csv"));
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].id, "first");
  EXPECT_FALSE(files[0].landmarks.has_value());
  const Scan scan = load_scan(files[1]);
  EXPECT_EQ(scan.id, "second");
  EXPECT_EQ(scan.mm_per_unit, 10);
  EXPECT_EQ(scan.landmarks.at("31").position, Eigen::Vector3d(0, 0, 100));
  write_text(folder / "people.csv", "file\nmarks.json\n");
  EXPECT_THROW(find_scans(read_manifest(folder / "people.csv")), InvalidInput);
}

}  // namespace
}  // namespace facewright
