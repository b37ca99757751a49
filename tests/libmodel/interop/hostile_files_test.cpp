// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "libmodel/core/errors.h"
#include "libmodel/interop/eos_model.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/interop/gltf.h"
#include "libmodel/interop/npz.h"
#include "libmodel/io/atomic_file.h"
#include "tests/libmodel/interop/resealed_zip.h"
#include "tests/libmodel/model/model_fixtures.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Files that say other things about their own size than are true: nothing may be read or written beyond it.
struct HostileFiles : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / (std::string("facewright_hostile_") +
                                                 ::testing::UnitTest::GetInstance()->current_test_info()->name());
  MorphableModel model = MorphableModel(testing::random_parts(11)).level(1);
  ~HostileFiles() override { fs::remove_all(folder); }

  fs::path file(const std::string& name, const std::string& bytes) const {
    write_file(folder / name, bytes);
    return folder / name;
  }
};

// The same bytes with another text of the same length (padded with spaces) in the place of `from`.
std::string with(std::string bytes, const std::string& from, std::string to) {
  const size_t at = bytes.find(from);
  if (at == bytes.npos || to.size() > from.size()) throw std::logic_error("cannot plant " + to + " for " + from);
  to.resize(from.size(), ' ');
  return bytes.replace(at, from.size(), to);
}

// Replaces one array's shape, making up the difference of length from the header's padding.
std::string with_shape(std::string bytes, const std::string& array, const std::string& shape) {
  const size_t name = bytes.find(array + ".npy"), start = bytes.find("'shape': (", name) + 10;
  const size_t end = bytes.find('\n', start);
  std::string rest = bytes.substr(start, end - start);
  const size_t width = rest.size();
  rest = shape + rest.substr(rest.find(')'));
  if (rest.size() > width) rest.resize(rest.find('}') + 1);
  rest.resize(width, ' ');
  return testing::resealed(bytes.replace(start, width, rest));
}

// The reader must refuse by itself, not by what happens to come later: the message names the array.
TEST_F(HostileFiles, NpzArraysOfAnotherShapeAreRefusedByName) {
  const std::string bytes = npz_bytes(model);
  EXPECT_NO_THROW(read_npz_model(file("good.npz", bytes)));
  const auto refuses = [&](const std::string& array, const std::string& shape, const std::string& what) {
    EXPECT_THAT([&] { read_npz_model(file("bad.npz", with_shape(bytes, array, shape))); },
                ThrowsMessage<IoError>(::testing::AllOf(HasSubstr("'" + array + "'"), HasSubstr(what))))
        << shape;
  };
  refuses("faces", "27,2", "2 columns; expected 3");  // 18 x 3 numbers in all
  refuses("faces", "54,", "1 columns; expected 3");
  refuses("faces", "1,54", "54 columns; expected 3");
  refuses("uv", "10,4", "4 columns; expected 2");
  refuses("uv", "40,1", "1 columns; expected 2");
  refuses("shape_mean", "60,", "1 columns; expected 3");
  refuses("shape_variances", "1,5", "5 columns; expected 1");
  refuses("mirror", "2,10", "10 columns; expected 1");
  refuses("landmark_vertices", "1,3", "3 columns; expected 1");
  refuses("faces", "3,6,3", "3 dimensions");
  refuses("faces", "19,3", "does not hold");
}

TEST_F(HostileFiles, NpzShapesThatOverflowAreRefused) {
  const std::string bytes = npz_bytes(model);
  // 2^32 x 2^32 is 0 in 64 bits, 2^62 x 4 as well; the last is more than 64 bits hold.
  for (const char* shape :
       {"4294967296,4294967296", "4611686018427387904,4", "99999999999999999999,3", "-18,3", "18;3"})
    EXPECT_THROW(read_npz_model(file("bad.npz", with_shape(bytes, "shape_basis", shape))), IoError) << shape;
}

TEST_F(HostileFiles, GlbCountsAreCheckedBeforeMemoryIsTaken) {
  const std::string bytes = glb_bytes(model, {.modes = 2, .texture_size = 16, .morph_normals = false});
  EXPECT_NO_THROW(read_glb_model(file("good.glb", bytes)));
  const auto refuses = [&](const std::string& from, const std::string& to, const std::string& what) {
    EXPECT_THAT([&] { read_glb_model(file("bad.glb", with(bytes, from, to))); },
                ThrowsMessage<IoError>(HasSubstr(what)))
        << to;
  };
  // The white space a JSON text may have makes room for the longer numbers.
  const std::string vertices = "\"componentType\":5126,\"count\":20,\"type\":\"VEC3\"";
  refuses(vertices, "\"componentType\":5126,\"count\":-1,\"type\":\"VEC3\"", "a whole number that counts");
  refuses("\"target\":34962},{\"buffer\":0,\"byteOffset\":480", "\"target\":0},{\"buffer\":0,\"byteOffset\":-1",
          "a whole number that counts");
  const std::string corners = "\"componentType\":5125,\"count\":54,\"type\":\"SCALAR\"";
  refuses(corners, "\"componentType\":5125,\"count\":-3,\"type\":\"SCALAR\"", "a whole number that counts");
  refuses(corners, "\"componentType\":5125,\"count\":53,\"type\":\"SCALAR\"", "multiple of 3");
  refuses(corners, "\"componentType\":5126,\"count\":54,\"type\":\"SCALAR\"", "another kind");
}

TEST_F(HostileFiles, AGlbOfListsInListsIsRefused) {
  constexpr size_t kDeep = 1'000'000;
  std::string text = R"({"meshes":[{"primitives":[],"extras":{"targetNames":)" + std::string(kDeep, '[') +
                     std::string(kDeep, ']') + "}}]}";
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  const auto number = [&](size_t x) {
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(x >> shift & 0xff);
  };
  number(2);
  number(12 + 8 + text.size() + 8);
  number(text.size());
  bytes += "JSON" + text;
  number(0);
  bytes += std::string("BIN\0", 4);
  EXPECT_THAT([&] { read_glb_model(file("bad.glb", bytes)); }, ThrowsMessage<IoError>(HasSubstr("too deeply")));
}

TEST_F(HostileFiles, AGlbMorphTargetShorterThanTheMeshIsRefused) {
  const std::string bytes = glb_bytes(model, {.modes = 1, .texture_size = 16, .morph_normals = false});
  const std::string target = "\"componentType\":5126,\"count\":20,\"type\":\"VEC3\"";
  std::string bad = bytes;
  const size_t at = bad.rfind(target);  // the mean comes first, the morph target last
  bad.replace(at + target.find("20"), 2, "7 ");
  EXPECT_THAT([&] { read_glb_model(file("bad.glb", bad)); },
              ThrowsMessage<IoError>(HasSubstr("a morph target of 7 vertices for a mesh of 20")));
}

TEST_F(HostileFiles, AnEosFileEndsWithItsModel) {
  for (const int version : {1, 4}) {
    const std::string bytes = eos_model_bytes(model, version);
    EXPECT_NO_THROW(read_eos_model(file("good.bin", bytes)));
    EXPECT_THAT([&] { read_eos_model(file("bad.bin", bytes + "x")); }, ThrowsMessage<IoError>(HasSubstr("goes on")));
    for (size_t length = 0; length < bytes.size(); length += 1 + bytes.size() / 97)
      EXPECT_THROW(read_eos_model(file("bad.bin", bytes.substr(0, length))), IoError) << length;
    EXPECT_THROW(read_eos_model(file("bad.bin", bytes.substr(0, bytes.size() - 1))), IoError);
  }
}

// Version 4 may have triangles of its own for the texture: the model's again, or others.
TEST_F(HostileFiles, EosTextureTrianglesAreTakenToTheVerticesUnlessThereIsASeam) {
  const std::string bytes = eos_model_bytes(model), whole = bytes.substr(0, bytes.size() - 8);
  const auto with_triangles = [&](const Faces& own) {
    const auto count = static_cast<std::uint64_t>(own.rows());
    return whole + std::string(reinterpret_cast<const char*>(&count), 8) +
           std::string(reinterpret_cast<const char*>(own.data()), static_cast<size_t>(own.size()) * sizeof(int));
  };
  Faces own = model.faces();
  EXPECT_EQ(read_eos_model(file("same.bin", with_triangles(own))).uv(), read_eos_model(file("a.bin", bytes)).uv());
  const auto refuses = [&](const std::string& what) {
    EXPECT_THAT([&] { read_eos_model(file("bad.bin", with_triangles(own))); }, ThrowsMessage<IoError>(HasSubstr(what)));
  };
  own(0, 0) = (own(0, 0) + 1) % 20;
  refuses("per triangle corner");
  own(0, 0) = 20;
  refuses("without coordinates");
  own.conservativeResize(1, 3);
  refuses("1 texture triangles");
}

TEST(EosLandmarkMapping, LeavesOutALandmarkWithoutName) {
  MorphableModelParts p = testing::random_parts(12);
  p.landmarks[""] = p.landmarks["31"];
  const std::string text = eos_landmark_mapping(MorphableModel(p));
  EXPECT_THAT(text, HasSubstr("\n31 = 0\n"));
  EXPECT_EQ(text.find("\n = "), text.npos);
}

// Any byte of any file may be anything.
TEST_F(HostileFiles, MangledFilesAreReadOrRefusedButNothingElse) {
  const std::string npz = npz_bytes(model),
                    glb = glb_bytes(model, {.modes = 3, .texture_size = 16, .morph_normals = false}),
                    eos = eos_model_bytes(model);
  Random random(13);
  const auto mangled = [&](std::string bytes) {
    const auto header = static_cast<int>(std::min<size_t>(bytes.size(), 2000));
    for (int k = 1 + random.index(6); k > 0; --k)
      bytes[static_cast<size_t>(random.index(k % 2 ? header : static_cast<int>(bytes.size())))] =
          static_cast<char>(random.index(256));
    return bytes;
  };
  const auto survives = [](auto read) {
    try {
      read();
    } catch (const IoError&) {
    }
  };
  for (int trial = 0; trial < 100; ++trial) {
    survives([&] { read_npz_model(file("bad.npz", mangled(npz))); });
    survives([&] { read_npz_model(file("bad.npz", testing::resealed(mangled(npz)))); });
    survives([&] { read_glb_model(file("bad.glb", mangled(glb))); });
    survives([&] { read_eos_model(file("bad.bin", mangled(eos))); });
  }
}

}  // namespace
}  // namespace facewright
