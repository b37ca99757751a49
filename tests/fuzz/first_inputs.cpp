// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Writes the first inputs of the fuzz targets, small files by our own writers. usage: fuzz_first_inputs FOLDER
#include <nlohmann/json.hpp>

#include "libmodel/interop/eos_companions.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/interop/flame_npz.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/level_files.h"
#include "libmodel/interop/mesh_glb.h"
#include "libmodel/interop/npz.h"
#include "libmodel/interop/zip_archive.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/model/model_file.h"
#include "libregister/reference/reference_face.h"
#include "tests/libmodel/interop/foreign_files.h"
#include "tests/support/temporary_directory.h"

namespace {

using namespace facewright;
using namespace std::string_literals;
namespace fs = std::filesystem;

struct Corpus {
  fs::path folder;
  TemporaryDirectory scratch;

  void raw(const std::string& name, const std::string& bytes) const { write_file(folder / name, bytes); }
  void add(const std::string& name, int format, const std::string& bytes) const {
    raw(name, static_cast<char>('a' + format) + bytes);
  }
  std::string written(const std::string& name, const std::function<void(const fs::path&)>& write) const {
    write(scratch / name);
    return read_file(scratch / name);
  }
};

Mesh patch(bool colours) {
  Mesh mesh;
  mesh.V.resize(9, 3), mesh.F.resize(8, 3), mesh.uv.resize(9, 2);
  for (int i = 0; i < 9; ++i) {
    mesh.V.row(i) << 50.0 * (i % 3), 50.0 * (i / 3), 10.0 * (i == 4);
    mesh.uv.row(i) << 0.5 * (i % 3), 0.5 * (i / 3);
  }
  for (int r = 0, f = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c) {
      const int v = 3 * r + c;
      mesh.F.row(f++) << v, v + 1, v + 3;
      mesh.F.row(f++) << v + 1, v + 4, v + 3;
    }
  if (colours) mesh.colours = Eigen::MatrixXd::Constant(9, 3, 0.25);
  return mesh;
}

std::string stl_bytes(const Mesh& mesh) {
  ByteWriter out;
  const std::string header(80, ' ');
  out.array(header.data(), header.size());
  out.value(static_cast<std::uint32_t>(mesh.F.rows()));
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int k = 0; k < 3; ++k) out.value(0.0F);
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c) out.value(static_cast<float>(mesh.V(mesh.F(f, k), c)));
    out.value(std::uint16_t{0});
  }
  return out.take();
}

std::string off_text(const Mesh& mesh) {
  std::ostringstream out;
  out << "OFF\n" << mesh.V.rows() << " " << mesh.F.rows() << " 0\n" << mesh.V << "\n";
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) out << "3 " << mesh.F.row(f) << "\n";
  return out.str();
}

void meshes(const Corpus& to) {
  const Mesh plain = patch(false), coloured = patch(true);
  const auto obj = to.written("scan.obj", [&](const fs::path& p) { write_obj(p, coloured, ObjMaterial{"skin.png"}); });
  to.add("obj", 0, obj + "\n--8<--\n" + read_file(to.scratch / "scan.mtl"));
  to.add("obj_quads", 0,
         "# text\nmtllib scan.mtl\nv 0 0 0\nv 90 0 0\nv 90 90 0\nv 0 90 5\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\ng a\n"
         "usemtl one\nf 1/1/1 2/2/1 3/3/1 4/1/1\nusemtl two\nf -4//1 -3//1 -2//1\ns off\nl 1 2\n\n--8<--\n"
         "newmtl one\nmap_Kd -s 1 1 1 -clamp on skin.png\nnewmtl two\nKd 1 0 0\nmap_Kd ../skin.png\n");
  for (const PlyFormat format : {PlyFormat::binary, PlyFormat::ascii})
    for (const Mesh& mesh : {plain, coloured})
      to.add(
          std::string("ply_") + (format == PlyFormat::ascii ? "text" : "binary") + (mesh.colours.size() ? "_rgb" : ""),
          1, to.written("m.ply", [&](const fs::path& p) { write_ply(p, mesh, format); }));
  to.add(
      "ply_other", 1,
      "ply\nformat ascii 1.0\ncomment TextureFile skin.png\nobj_info x\nelement vertex 3\nproperty double x\nproperty "
      "double y\nproperty double z\nproperty int tag\nelement face 1\nproperty list uchar uint "
      "vertex_indices\nproperty "
      "list uchar float texcoord\nelement edge 1\nproperty int a\nend_header\n0 0 0 1\n90 0 0 2\n0 90 5 3\n3 0 1 2 6 "
      "0 0 "
      "1 0 0 1\n7\n");
  to.add("stl", 2, stl_bytes(plain));
  to.add("stl_text", 2,
         "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 90 0 0\nvertex 0 90 "
         "0\nendloop\nendfacet\nendsolid a\n");
  to.add("off", 3, off_text(plain));
  to.add("glb", 4, mesh_glb_bytes(plain));
  to.add("gltf", 5,
         R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{
"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"bufferViews":[
{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAC0QgAAAAAAAAAAAAAAAAAAtEIAAAAA"}]})");
  to.add("dae", 6,
         R"(<?xml version="1.0"?><COLLADA version="1.4.1"><library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="9">0 0 0 90 0 0 0 90 0</float_array><technique_common><accessor source="#a" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="1"><input semantic="VERTEX" source="#v"
offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)");
  to.add("fbx", 7,
         "; FBX 7.3.0 project file\nFBXHeaderExtension:  {\n\tFBXVersion: 7300\n}\nObjects:  {\n\tGeometry: 1, "
         "\"Geometry::a\", "
         "\"Mesh\" {\n\t\tVertices: *9 {\n\t\t\ta: 0,0,0,90,0,0,0,90,0\n\t\t}\n\t\tPolygonVertexIndex: *3 {\n\t\t\ta: "
         "0,1,-3\n\t\t}\n\t}\n}\nConnections:  {\n}\n");
  to.add("3ds", 8,
         "MM\x2a\0\0\0==\x24\0\0\0\0@\x1e\0\0\0a\0\0A\x16\0\0\0\x10"
         "A\x10\0\0\0\0\0"s);
  to.add("x", 9, "xof 0303txt 0032\nMesh a {\n 3;\n 0;0;0;,\n 90;0;0;,\n 0;90;0;;\n 1;\n 3;0,1,2;;\n}\n");
  to.add("wrl", 10,
         "#VRML V2.0 utf8\nShape { geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 90 0 0, 0 90 0 ] } "
         "coordIndex [ 0, 1, 2, -1 ] } }\n");
}

void landmarks(const Corpus& to) {
  const Landmarks numbered = {{"1", {{10.5, 20, 30}}}, {"2", {{-1e-3, 4, 5.25}}}, {"3", {{0, 0, 1}}}};
  const Landmarks bnd = {{"bnd_1", {{1, 2, 3}}}, {"bnd_2", {{4, 5, 6}}}};
  const std::vector<std::string> extensions = {".json",  ".pts",  ".pp",  ".mrk.json", ".fcsv",
                                               ".ljson", ".tlms", ".csv", ".bnd",      ".lm3"};
  for (size_t i = 0; i < extensions.size(); ++i)
    to.add("landmarks" + extensions[i], static_cast<int>(i), to.written("l" + extensions[i], [&](const fs::path& p) {
      write_landmarks(p, extensions[i] == ".bnd" ? bnd : numbered);
    }));
  to.add("detailed.json", 0, R"({"31": {"position": [1, 2, 3], "stddev": 0.5}, "Nose \u00e9": [1e2, -4, 5]})");
  to.add("pixels.pts", 1, "version: 1\nn_points: 2\n{\n1.5 2\n3 4\n}\n");
  to.add("menpo1.ljson", 5,
         R"({"version":1,"groups":[{"label":"a","landmarks":[{"point":[1,2,3]},{"point":[null,null,null]}]}]})");
  to.add(
      "menpo3.ljson", 5,
      R"({"version":3,"groups":{"LJSON":{"labels":[{"label":"n","mask":[0]},{"label":"c","mask":[1]}],"landmarks":{"points":[[1,2],[3,4]],"connectivity":[[0,1]]}}}})");
  to.add("stddev.csv", 7, "label,x,y,z,stddev\n\"a, b\",1,2,3,0.5\nc,4,5,6,1\n");
  to.add("names.json", 10, R"({"Nose tip": "31", "Chin": "9"})");
  to.add("names.csv", 11, "theirs,ours\nNose tip,31\n\"a \"\"b\"\"\",9\n");
  to.add("names.toml", 12, "# of a scanner\n[names]\n\"Nose tip\" = \"31\"\nchin = 9\n");
  to.add("mapping.txt", 13,
         "[landmark_mappings]\n9 = 33 # chin\n31 = \"nose\"\n[contour_landmarks]\nright = [ \"1\", 2 ]\nleft = [ 3,\n "
         "4 ]\n");
  to.add("manifest.csv", 14,
         "id,file,landmarks,subject,expression,group,age,units,site\r\none,a.ply,,anna,Neutral,\"b, "
         "c\",33.5,mm,x\r\ntwo,./a.ply,,,smile,,,auto,\r\n");
  to.add("manifest.tsv", 14,
         "\xef\xbb\xbf"
         "file\tid\na.ply\tone\n../a.ply\ttwo\n/etc/hosts\tthree\n");
}

void documents(const Corpus& to) {
  ReferenceFace face;
  face.mesh = patch(false);
  face.mesh.uv.resize(0, 2);
  face.landmarks["31"] = mark_vertex(face.mesh.F, 4);
  face.regions["rim"] = {0, 1, 2, 3, 5, 6, 7, 8};
  to.add("reference", 0, format_reference(face));
  to.add("journal_of_others", 1, R"({"parents": [[0, 1], [0, 1, 2], [5, 9]], "vertices": [9, 12]})");
  face.regions.clear();
  const MultiresTemplate levels = build_template(face, {25, 40});
  nlohmann::json journal;
  journal["vertices"] = {9, levels.levels[1].vertex_count, levels.levels[2].vertex_count};
  for (const VertexParents& p : levels.parents)
    journal["parents"].push_back(p.is_midpoint() ? nlohmann::json{p.a, p.b} : nlohmann::json{p.a, p.b, p.c});
  to.add("journal", 1, journal.dump());
  to.add("record", 2, R"({"key": "k", "sha256": "00", "reason": "no face"})");
  to.add("table", 3, "a;b\r\n\"c \"\"d\"\"\n\";e\r\n\n");
  to.add(
      "hdf5.json", 4,
      R"({"apiVersion":"1.1.1","datasets":{"i":{"alias":["/shape/model/mean"],"type":{"class":"H5T_FLOAT"},"shape":{"dims":[2,1]},"value":[1,2.5]},"s":{"alias":["/a/b"],"type":{"class":"H5T_STRING"},"value":"text"},"n":{"alias":["/n"],"type":{"class":"H5T_INTEGER"},"shape":{},"value":9}}})");
}

void model_files(const Corpus& to) {
  MorphableModelParts parts = testing::random_parts(21);
  parts.expression.reset();
  parts.blendshapes.clear();
  const MorphableModel model(parts);
  to.raw("level", serialise_model(model.level(0)));
  to.raw("statismo", to.written("s.h5", [&](const fs::path& p) { export_model(p, model, 0, ExportFormat::statismo); }));
  parts.levels.erase(parts.levels.begin());
  to.raw("levels", serialise_model(MorphableModel(parts)));
  to.raw("scalismo.json",
         R"({"apiVersion":"1.1.1","datasets":{
"a":{"alias":["/model/mean"],"type":{"class":"H5T_FLOAT"},"shape":{"dims":[9]},"value":[0,0,0,90,0,0,0,90,0]},
"b":{"alias":["/model/pcaBasis"],"type":{"class":"H5T_FLOAT"},"shape":{"dims":[9,1]},"value":[[1],[0],[0],[0],[0],[0],[0],[0],[0]]},
"c":{"alias":["/model/pcaVariance"],"type":{"class":"H5T_FLOAT"},"shape":{"dims":[1]},"value":[4]},
"d":{"alias":["/representer/points"],"type":{"class":"H5T_FLOAT"},"shape":{"dims":[3,3]},"value":[[0,90,0],[0,0,90],[0,0,0]]},
"e":{"alias":["/representer/cells"],"type":{"class":"H5T_INTEGER"},"shape":{"dims":[3,1]},"value":[[0],[1],[2]]},
"f":{"alias":["/version/majorVersion"],"type":{"class":"H5T_INTEGER"},"shape":{},"value":0},
"g":{"alias":["/version/minorVersion"],"type":{"class":"H5T_INTEGER"},"shape":{},"value":9}}})");
}

// Arrays as tests/fuzz/foreign_models.cpp takes them.
std::string arrays_of(const std::string& archive, const Corpus& to) {
  write_file(to.scratch / "z", archive);
  ByteWriter out;
  for (const auto& [name, content] : read_zip(to.scratch / "z")) {
    const std::string stem = name.substr(0, name.size() - 4);
    out.array(stem.data(), stem.size());
    out.value('\0');
    out.value(static_cast<std::uint32_t>(content.size()));
    out.array(content.data(), content.size());
  }
  return out.take();
}

void foreign_models(const Corpus& to) {
  MorphableModelParts parts = testing::face_sheet_parts(2);
  for (PcaModel* p : {&parts.shape, &*parts.expression, &parts.colour}) {  // fewer modes: smaller files
    p->basis = p->basis.leftCols(1).eval();
    p->variances = p->variances.head(1).eval();
  }
  parts.blendshapes.pop_back();
  const MorphableModel model(parts), tiny = MorphableModel(testing::random_parts(4)).level(0);
  to.add("eos", 0, eos_model_bytes(model, 4));
  to.add("eos_1", 0, eos_model_bytes(tiny, 1));
  to.add("scm", 1, testing::scm_bytes(parts));
  to.add("npz", 2, npz_bytes(tiny));
  to.add("flame", 3, flame_npz_bytes(tiny));
  to.add("glb", 4, glb_bytes(tiny, {.modes = 1, .texture_size = 16, .morph_normals = false}));
  to.add("arrays", 5, arrays_of(npz_bytes(tiny), to));
  to.add("arrays_flame", 6, arrays_of(flame_npz_bytes(model), to));
  MorphableModelParts plain = parts;
  plain.blendshapes.clear();
  testing::write_ict(to.scratch / "ict", plain);
  to.add("ict", 7,
         read_file(to.scratch / "ict/generic_neutral_mesh.obj") + "\n--8<--\n" +
             read_file(to.scratch / "ict/identity000.obj"));
  to.add("blendshapes", 8, eos_blendshapes_bytes(parts.blendshapes));
  to.add("contours", 9, R"({"model_contour": {"right_contour": [1, 2], "left_contour": [3]}})");
  to.add("edges", 10, edge_topology_json(tiny.faces()));
  to.add("marks", 11, "[contour_landmarks]\nright = [ 1, \"2\" ]\nleft = [ 3 ]\n");
  to.add("sniffed", 12,
         "\x80\x04"
         "pickle");
}

void matlab(const Corpus& to) {
  MorphableModelParts parts = testing::face_sheet_parts(2);
  parts.shape.basis = parts.shape.basis.leftCols(1).eval();
  parts.shape.variances = parts.shape.variances.head(1).eval();
  const auto variables = testing::bfm_variables(parts);
  testing::write_mat(to.scratch / "v5", variables);
  testing::write_mat(to.scratch / "v5z", variables, MAT_FT_MAT5, MAT_COMPRESSION_ZLIB);
  testing::write_mat(to.scratch / "v4", variables, MAT_FT_MAT4);
  const Eigen::MatrixXd F = parts.levels[0].F.cast<double>();
  testing::write_mat(to.scratch / "lsfm", {{"mean", parts.shape.mean},
                                           {"components", parts.shape.basis},
                                           {"eigenvalues", parts.shape.variances},
                                           {"trilist", F}});
  testing::write_mat(to.scratch / "v73", {{"shapeMU", parts.shape.mean.head(9)}, {"tl", F.topRows(2)}}, MAT_FT_MAT73);
  for (const char* name : {"v5", "v5z", "v4", "lsfm", "v73"}) to.raw(name, read_file(to.scratch / name));
}

void images(const Corpus& to) {
  Image rgb(5, 4, 3, 100), grey(3, 3, 1, 7), rgba(4, 4, 4, 200);
  for (size_t i = 0; i < rgb.data.size(); ++i) rgb.data[i] = static_cast<std::uint8_t>(4 * i);
  to.raw("rgb.png", png_bytes(rgb));
  to.raw("grey.png", png_bytes(grey));
  to.raw("rgba.png", png_bytes(rgba));
  to.raw("rgb.jpg", jpeg_bytes(rgb));
  to.raw("grey.jpg", jpeg_bytes(grey, 50));
  to.raw("text.ppm", "P5\n# text\n2 2\n255\nabcd");
  to.raw("rgb.ppm", "P6 1 2 255 abcdef");
  std::string gif = "GIF89a";
  gif += "\2\0\2\0\x80\0\0\0\0\0\xff\xff\xff,\0\0\0\0\2\0\2\0\0\2\2D\x0a\0;"s;
  to.raw("two.gif", gif);
  to.raw("one.bmp",
         "BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\1\0\0\0\1\0\0\0\1\0\x18\0\0\0\0\0\4\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"
         "\0\0\0"
         "\1\2\3\0"s);
  to.raw("run.tga", "\0\0\x0a\0\0\0\0\0\0\0\0\0\4\0\1\0\x18\0\x83\1\2\3"s);
  to.raw("one.psd", "8BPS\0\1\0\0\0\0\0\0\0\3\0\0\0\1\0\0\0\1\0\x08\0\3\0\0\0\0\0\0\0\0\0\0\0\0\0\0abc"s);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const fs::path folder = argv[1];
  meshes({folder / "meshes", {}});
  landmarks({folder / "landmarks", {}});
  documents({folder / "documents", {}});
  model_files({folder / "model_file", {}});
  foreign_models({folder / "foreign_models", {}});
  matlab({folder / "matlab", {}});
  images({folder / "images", {}});
  return 0;
}
