// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>

#include <fstream>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/mesh_files.h"
#include "tests/libmodel/io/scratch_folder.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

class MalformedMesh : public ScratchFolder {
 protected:
  /// Line of the IoError; -1 if the file was accepted.
  int error_line(const std::string& name, const std::string& text) {
    write_file(folder_ / name, text);
    try {
      read_mesh(folder_ / name);
    } catch (const IoError& e) {
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos);
      return e.line();
    }
    return -1;
  }
};

TEST_F(MalformedMesh, ObjErrorsCarryTheLine) {
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nv 1 x 0\n"), 2);
  EXPECT_EQ(error_line("a.obj", "v 0 0\n"), 1);
  EXPECT_EQ(error_line("a.obj", "v 0 0 nan\n"), 1);
  EXPECT_EQ(error_line("a.obj", "v 0 0 1e999\n"), 1);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nf 1 1\n"), 2);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\n\nf 1 1 2\n"), 3);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nf 0 1 1\n"), 2);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nf -2 1 1\n"), 2);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nf 1/1 1/1 1/1\n"), 2);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nf 99999999999999999999 1 1\n"), 2);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nf 4294967297 1 1\n"), 2);
  EXPECT_EQ(error_line("a.obj", "v 0 0 0\nf 1;1;1\n"), 2);
}

TEST_F(MalformedMesh, PlyErrorsCarryTheLine) {
  const std::string start =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  EXPECT_EQ(error_line("a.ply", "plx\n"), 1);
  EXPECT_EQ(error_line("a.ply", "ply\nformat ebcdic 1.0\n"), 2);
  EXPECT_EQ(error_line("a.ply", "ply\nformat ascii 1.0\nproperty float x\n"), 3);
  EXPECT_EQ(error_line("a.ply", start), 7);
  EXPECT_EQ(error_line("a.ply", start + "property quaternion q\nend_header\n"), 7);
  EXPECT_EQ(error_line("a.ply", start + "end_header\n1 2 z\n"), 8);
  EXPECT_EQ(error_line("a.ply", start + face + "1 2 3\n3 0 0 1\n"), 11);
  EXPECT_EQ(error_line("a.ply", start + face + "1 2 3\n2 0 0\n"), 11);
  EXPECT_EQ(error_line("a.ply", start + face + "1 2 3\n3 0 0 -1\n"), 11);
  EXPECT_GT(error_line("a.ply", start + face + "1 2 3\n3 0 0\n"), 0);
}

TEST_F(MalformedMesh, HostileSizesAreRefusedBeforeAllocation) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  for (const char* format : {"ascii", "binary_little_endian"}) {
    const std::string start = std::string("ply\nformat ") + format + " 1.0\n";
    EXPECT_GE(error_line("a.ply", start + "element vertex 2147483647\n" + xyz + "end_header\n1 2 3\n"), 0);
    EXPECT_GE(error_line("a.ply", start + "element vertex 99999999999\n" + xyz + "end_header\n1 2 3\n"), 0);
    EXPECT_GE(error_line("a.ply", start + "element vertex -1\n" + xyz + "end_header\n1 2 3\n"), 0);
    EXPECT_GE(error_line("a.ply", start + "element vertex 0\n" + xyz +
                                      "element face 1\nproperty list int int vertex_indices\nend_header\n2000000000 "),
              0);
  }
}

TEST_F(MalformedMesh, TruncatedOrMangledFilesNeverCrash) {
  Mesh mesh;
  mesh.V = Vertices::Random(30, 3);
  mesh.F = Faces::NullaryExpr(40, 3, [](Eigen::Index r, Eigen::Index c) { return static_cast<int>((r + 7 * c) % 30); });
  mesh.colours = Colours::Constant(30, 3, 0.5);
  write_ply(folder_ / "good.ply", mesh);
  write_ply(folder_ / "text.ply", mesh, PlyFormat::ascii);
  write_obj(folder_ / "good.obj", mesh);
  Random random(11);
  for (const std::string name : {"good.ply", "text.ply", "good.obj"}) {
    const std::string good = read_file(folder_ / name), extension = name.substr(name.size() - 4);
    for (int trial = 0; trial < 300; ++trial) {
      std::string bad = good.substr(0, static_cast<size_t>(random.index(static_cast<int>(good.size()) + 1)));
      for (int k = random.index(4); k > 0 && !bad.empty(); --k)
        bad[static_cast<size_t>(random.index(static_cast<int>(bad.size())))] = static_cast<char>(random.index(256));
      std::ofstream(folder_ / ("bad" + extension), std::ios::binary) << bad;
      try {
        validate(read_mesh(folder_ / ("bad" + extension)));
      } catch (const IoError&) {
      }
    }
  }
}

TEST_F(MalformedMesh, UnknownExtensionNamesTheKnownOnes) {
  write_file(folder_ / "a.xyz", "1 2 3");
  try {
    read_mesh(folder_ / "a.xyz");
    FAIL();
  } catch (const IoError& e) {
    EXPECT_NE(std::string(e.what()).find(".ply"), std::string::npos);
  }
}

TEST_F(MalformedMesh, PlacesWhoseDistancesAreNoNumbersAreRefused) {
  for (const char* x : {"1e308", "-1e200", "2e15"}) {
    const fs::path obj = file("far.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 ") + x + " 0\nf 1 2 3\n");
    EXPECT_THAT([&] { read_mesh(obj); }, ThrowsMessage<IoError>(HasSubstr("beyond 1e15"))) << x;
  }
  EXPECT_NO_THROW(read_mesh(file("near.obj", "v 0 0 0\nv 1 0 0\nv 0 1e14 0\nf 1 2 3\n")));
}

}  // namespace
}  // namespace facewright
