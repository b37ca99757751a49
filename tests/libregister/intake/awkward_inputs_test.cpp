// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// What people drop into a folder of scans: each is handled, or refused with the remedy. Nothing is guessed in silence.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>

#include "libmodel/core/errors.h"
#include "libmodel/io/atomic_file.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/mesh_files.h"
#include "libregister/intake/scan.h"
#include "tests/libregister/intake/frame_fixture.h"
#include "tests/support/matchers.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const Mesh& face_scan() { return FrameFixture::get().person.mesh; }

Mesh kept(const Mesh& mesh, const std::function<bool(const Eigen::Vector3d&)>& keep) {
  Mesh out = mesh;
  out.uv = TexCoords(), out.uv_faces = Faces();
  Eigen::Index n = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
    if (keep(mesh.V.row(mesh.F(f, 0)))) out.F.row(n++) = mesh.F.row(f);
  out.F.conservativeResize(n, 3);
  return out;
}

Mesh moved(Mesh mesh, const Eigen::Matrix3d& A, const Eigen::Vector3d& t = Eigen::Vector3d::Zero()) {
  mesh.V = ((mesh.V * A.transpose()).rowwise() + t.transpose()).eval();
  return mesh;
}

Mesh turned(Mesh mesh) {
  mesh.F.col(1).swap(mesh.F.col(2));
  if (mesh.uv_faces.rows() > 0) mesh.uv_faces.col(1).swap(mesh.uv_faces.col(2));
  return mesh;
}

Mesh without_texture(Mesh mesh) {
  mesh.uv = TexCoords(), mesh.uv_faces = Faces();
  return mesh;
}

Mesh both(const Mesh& a, const Mesh& b) {
  Mesh out;
  out.V.resize(a.V.rows() + b.V.rows(), 3), out.F.resize(a.F.rows() + b.F.rows(), 3);
  out.V << a.V, b.V;
  out.F << a.F, (b.F.array() + static_cast<int>(a.V.rows())).matrix();
  return out;
}

// Wedge coordinates and materials as scanners with two cameras write them: the left half skin, the right half cheek.
void write_two_textures(const TemporaryDirectory& folder, const std::string& stem) {
  const Mesh& mesh = face_scan();
  std::ostringstream obj;
  obj << "mtllib " << stem << ".mtl\n";
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i)
    obj << "v " << mesh.V(i, 0) << ' ' << mesh.V(i, 1) << ' ' << mesh.V(i, 2) << '\n';
  obj << "vt 0.25 0.25\nvt 0.75 0.25\nvt 0.25 0.75\n";
  for (const bool left : {true, false}) {
    obj << "usemtl " << (left ? "skin" : "cheek") << '\n';
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
      if ((mesh.V(mesh.F(f, 0), 0) < 0) == left)
        obj << "f " << mesh.F(f, 0) + 1 << "/1 " << mesh.F(f, 1) + 1 << "/2 " << mesh.F(f, 2) + 1 << "/3\n";
  }
  write_file(folder / (stem + ".obj"), obj.str());
  write_file(folder / (stem + ".mtl"), "newmtl skin\nmap_Kd -s 1 1 1 my skin.png\nnewmtl cheek\nmap_Kd cheek.png\n");
  write_png(folder / "my skin.png", Image(8, 8, 3, 50));
  write_png(folder / "cheek.png", Image(4, 16, 3, 200));
}

class AwkwardInputs : public ::testing::Test {
 protected:
  Scan load(const std::string& file, const FrameOptions& frame = {}) {
    ScanOptions options;
    options.reference = &FrameFixture::get().reference;
    options.axes = ScanAxes::head;
    options.frame = frame;
    return load_scan({"scan", folder_ / file, {}, Units::automatic}, options);
  }
  Scan load(const std::string& file, const Mesh& mesh, const FrameOptions& frame = {}) {
    write_ply(folder_ / file, mesh);
    return load(file, frame);
  }
  std::string refusal(const std::string& file) {
    try {
      load(file);
    } catch (const IoError& e) {
      return e.what();
    } catch (const InvalidInput& e) {
      return e.what();
    }
    return "accepted";
  }
  std::string refusal(const std::string& file, const Mesh& mesh) {
    write_ply(folder_ / file, mesh);
    return refusal(file);
  }
  std::string whole_file() {
    write_ply(folder_ / "whole.ply", face_scan());
    return read_file(folder_ / "whole.ply");
  }

  TemporaryDirectory folder_;
};

TEST_F(AwkwardInputs, ThingsThatAreNoWholeFaceAreRefused) {
  EXPECT_THAT(refusal("ball.ply", icosphere(4, 100)), AllOf(HasSubstr("no"), HasSubstr("face"), HasSubstr("Check")));
  EXPECT_THAT(refusal("wall.ply", plane_grid(30, 30, 250, 250)), HasSubstr("face"));
  Mesh cube = icosphere(5, 100);
  for (Eigen::Index i = 0; i < cube.V.rows(); ++i) cube.V.row(i) *= 100 / cube.V.row(i).cwiseAbs().maxCoeff();
  EXPECT_THAT(refusal("cube.ply", cube), HasSubstr("face"));
  const Similarity head_from_scan = FrameFixture::get().person.scanner_from_head.inverse();
  const auto head = [&](const Eigen::Vector3d& x) -> Eigen::Vector3d { return head_from_scan * x; };
  EXPECT_THAT(refusal("half.ply", kept(face_scan(), [&](const auto& x) { return head(x)[0] > 0; })), HasSubstr("face"));
  EXPECT_THAT(refusal("ear.ply", kept(face_scan(), [&](const auto& x) { return head(x)[0] > 55; })), HasSubstr("face"));
  EXPECT_THAT(refusal("brow.ply", kept(face_scan(), [&](const auto& x) { return head(x)[1] > 10; })),
              HasSubstr("face"));
}

// The search for the face draws maps of the scan's depth, whose cells have a size.
TEST_F(AwkwardInputs, AScanOfKilometresIsRefusedBeforeMemoryIsTakenForIt) {
  for (const double far : {1e6, 1e12, 1e37}) {
    Mesh mesh = icosphere(2, 100);
    mesh.V.col(0) *= far / 100;
    mesh.V.col(1) *= far / 100;
    write_ply(folder_ / "far.ply", mesh);
    ScanFiles files = files_of_scan(folder_ / "far.ply");
    files.units = Units::mm;
    ScanOptions options;
    options.reference = &FrameFixture::get().reference;
    EXPECT_THROW(load_scan(files, options), InvalidInput) << far;
  }
}

TEST_F(AwkwardInputs, TwoFacesInOneScanAreAnAmbiguityWithTheCandidates) {
  const Mesh one = without_texture(face_scan());
  EXPECT_THAT(refusal("two.ply", both(one, moved(one, Eigen::Matrix3d::Identity(), {300, 10, 0}))),
              AllOf(HasSubstr("ambiguous"), HasSubstr("two faces"), HasSubstr("millimetres, y up, facing z")));
}

TEST_F(AwkwardInputs, OddUnitsAreConvertedOrRefusedWithTheirSize) {
  EXPECT_EQ(load("m.ply", moved(face_scan(), Eigen::Matrix3d::Identity() / 1000)).mm_per_unit, 1000);
  EXPECT_EQ(load("cm.ply", moved(face_scan(), Eigen::Matrix3d::Identity() / 10)).mm_per_unit, 10);
  EXPECT_EQ(load("inch.ply", moved(face_scan(), Eigen::Matrix3d::Identity() / 25.4)).mm_per_unit, 25.4);
  EXPECT_THAT(refusal("tiny.ply", moved(face_scan(), Eigen::Matrix3d::Identity() / 80000)),
              AllOf(HasSubstr("none of mm"), HasSubstr("its shape is a face's"), HasSubstr("Scale the scan")));
  EXPECT_THAT(refusal("huge.ply", moved(face_scan(), Eigen::Matrix3d::Identity() * 100)), HasSubstr("none of mm"));
}

TEST_F(AwkwardInputs, UpsideDownLyingAndFarAwayScansComeUpright) {
  const Eigen::Matrix3d upside_down = Eigen::Vector3d(-1, -1, 1).asDiagonal();
  const Scan scan = load("upside down.ply", moved(face_scan(), upside_down));
  EXPECT_THAT(scan.units_reason, HasSubstr("-y up, facing z"));
  EXPECT_EQ(
      load("back.ply", moved(face_scan(), Eigen::Vector3d(1, -1, -1).asDiagonal())).frame->summary.candidates[0].up,
      FileAxis::minus_y);
  EXPECT_THAT(load("far.ply", moved(face_scan(), Eigen::Matrix3d::Identity(), {20000, -5000, 9000})).units_reason,
              HasSubstr("y up, facing z"));
}

TEST_F(AwkwardInputs, MirroredAndInsideOutScansAreToldApartOrRefusedWithBothCauses) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(-1, 1, 1).asDiagonal();
  EXPECT_TRUE(load("mirrored.ply", moved(face_scan(), mirror)).frame->mirrored);
  EXPECT_TRUE(load("inside out.ply", turned(face_scan())).frame->flip_triangles);
  EXPECT_THAT(refusal("plain.ply", turned(without_texture(face_scan()))),
              AllOf(HasSubstr("turned over"), HasSubstr("mirror")));
  FrameOptions told;
  told.handedness = Handedness::right;
  EXPECT_TRUE(load("plain.ply", turned(without_texture(face_scan())), told).frame->flip_triangles);
}

TEST_F(AwkwardInputs, FilesThatAreNoMeshAreRefusedInWords) {
  write_file(folder_ / "empty.ply", "");
  EXPECT_THAT(refusal("empty.ply"), HasSubstr("empty"));
  EXPECT_THAT(refusal("absent.ply"), HasSubstr("cannot be opened"));
  write_png(folder_ / "picture.png", Image(64, 64, 3, 7));
  std::filesystem::rename(folder_ / "picture.png", folder_ / "picture.obj");
  EXPECT_THAT(refusal("picture.obj"), AllOf(HasSubstr("PNG"), HasSubstr("export")));
  write_file(folder_ / "archive.stl", std::string("PK\x03\x04", 4) + std::string(100, 'x'));
  EXPECT_THAT(refusal("archive.stl"), HasSubstr("ZIP"));
  write_file(folder_ / "letter.obj", "Dear Sir or Madam,\nplease find enclosed\n");
  EXPECT_THAT(refusal("letter.obj"), ::testing::Not(HasSubstr("accepted")));
  write_file(folder_ / "cut.ply", whole_file().substr(0, 40000));
  EXPECT_THAT(refusal("cut.ply"), HasSubstr("cut.ply"));
  Mesh points = without_texture(face_scan());
  points.F.resize(0, 3);
  EXPECT_THAT(refusal("points.ply", points), HasSubstr("point clouds must be meshed"));
  write_file(folder_ / "points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  EXPECT_THAT(refusal("points.obj"), HasSubstr("point clouds must be meshed"));
  write_file(folder_ / "one.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n");
  EXPECT_THAT(refusal("one.obj"), HasSubstr("face"));
}

TEST_F(AwkwardInputs, NamesAndExtensionsDoNotMatter) {
  EXPECT_EQ(load("Zoë Ångström's 3. scan (neu).ply", face_scan()).mm_per_unit, 1);
  write_file(folder_ / "wrong.obj", whole_file());
  const Scan wrong = load("wrong.obj");
  ASSERT_FALSE(wrong.warnings.empty());
  EXPECT_THAT(wrong.warnings.front(), AllOf(HasSubstr(".obj"), HasSubstr("holds ply")));
  write_obj(folder_ / "right.obj", without_texture(face_scan()));
  std::filesystem::rename(folder_ / "right.obj", folder_ / "wrong.STL");
  EXPECT_EQ(load("wrong.STL").mesh.F.rows(), wrong.mesh.F.rows());
}

TEST_F(AwkwardInputs, MissingPicturesAreAWarning) {
  write_obj(folder_ / "bare.obj", face_scan(), ObjMaterial{"nowhere.png"});
  const Scan bare = load("bare.obj");
  EXPECT_TRUE(bare.texture.empty());
  EXPECT_THAT(bare.warnings, ::testing::Contains(AllOf(HasSubstr("nowhere.png"), HasSubstr("missing"))));
  std::filesystem::remove(folder_ / "bare.mtl");
  EXPECT_THAT(load("bare.obj").warnings, ::testing::Contains(AllOf(HasSubstr("bare.mtl"), HasSubstr("missing"))));
}

TEST_F(AwkwardInputs, SeveralTexturesBecomeOneAndEachTriangleKeepsItsOwn) {
  write_two_textures(folder_, "two");
  const Scan scan = load("two.obj");
  ASSERT_FALSE(scan.texture.empty());
  ASSERT_EQ(scan.mesh.uv_faces.rows(), scan.mesh.F.rows());
  int checked = 0;
  for (Eigen::Index f = 0; f < scan.mesh.F.rows(); f += 50) {
    const Eigen::RowVector2d uv =
        (scan.mesh.uv.row(scan.mesh.uv_faces(f, 0)) + scan.mesh.uv.row(scan.mesh.uv_faces(f, 1)) +
         scan.mesh.uv.row(scan.mesh.uv_faces(f, 2))) /
        3;
    const int x = static_cast<int>(uv[0] * scan.texture.width), y = static_cast<int>((1 - uv[1]) * scan.texture.height);
    const double across = scan.mesh.V(scan.mesh.F(f, 0), 0);
    if (std::abs(across) < 20) continue;  // the file's x = 0 lies near here
    EXPECT_EQ(scan.texture.pixel(x, y)[0], across < 0 ? 50 : 200) << f;
    ++checked;
  }
  EXPECT_GT(checked, 20);
}

TEST_F(AwkwardInputs, BrokenMeshesAreMendedAndCounted) {
  Mesh nan = without_texture(face_scan());
  for (int i = 0; i < 50; ++i) nan.V(i * 37, i % 3) = std::numeric_limits<double>::quiet_NaN();
  std::ostringstream obj;
  for (Eigen::Index i = 0; i < nan.V.rows(); ++i)
    obj << "v " << nan.V(i, 0) << ' ' << nan.V(i, 1) << ' ' << nan.V(i, 2) << '\n';
  for (Eigen::Index f = 0; f < nan.F.rows(); ++f)
    obj << "f " << nan.F(f, 0) + 1 << ' ' << nan.F(f, 1) + 1 << ' ' << nan.F(f, 2) + 1 << '\n';
  write_file(folder_ / "nan.obj", obj.str());
  EXPECT_THAT(refusal("nan.obj"), ::testing::AnyOf(HasSubstr("accepted"), HasSubstr("finite number")));

  std::string bytes = whole_file();
  const size_t first = bytes.find("end_header\n") + 11;
  const float not_a_number = std::numeric_limits<float>::quiet_NaN();
  bytes.replace(first, 4, reinterpret_cast<const char*>(&not_a_number), 4);
  write_file(folder_ / "nan.ply", bytes);
  const Scan mended = load("nan.ply");
  EXPECT_GT(mended.repair.non_finite, 0);
  EXPECT_TRUE(mended.mesh.V.allFinite());

  Mesh mixed = without_texture(face_scan());
  int count = 0;
  for (Eigen::Index f = 0; f < mixed.F.rows(); f += 5, ++count) std::swap(mixed.F(f, 1), mixed.F(f, 2));
  const Scan consistent = load("mixed.ply", mixed);
  EXPECT_EQ(consistent.repair.flipped, count);
  EXPECT_EQ(consistent.repair.non_manifold, 0);

  const Scan crumbs = load("crumbs.ply", both(without_texture(face_scan()),
                                              moved(icosphere(1, 5), Eigen::Matrix3d::Identity(), {0, 0, 300})));
  EXPECT_EQ(crumbs.repair.island_triangles, 80);
  EXPECT_THAT(crumbs.repair.words(), HasSubstr("80 triangles of small islands dropped"));
}

TEST_F(AwkwardInputs, TwoScansOfOneNameAreRefusedAndAnotherScansResultDoesNotDependOnThem) {
  const Scan alone = load("good.ply", face_scan());
  EXPECT_EQ(load("other.ply", moved(face_scan(), Eigen::Matrix3d::Identity() / 10)).mm_per_unit, 10);
  const Scan again = load("good.ply");
  EXPECT_THAT(again.mesh.V, SameBytes(alone.mesh.V));
  EXPECT_EQ(again.units_reason, alone.units_reason);
  write_file(folder_ / "good.obj", "");
  EXPECT_THROW(find_scans(folder_.path()), InvalidInput);
}

}  // namespace
}  // namespace facewright
