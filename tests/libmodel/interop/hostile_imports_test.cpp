// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <gmock/gmock.h>

#include <cstring>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/interop/export_model.h"
#include "libmodel/interop/import_model.h"
#include "libmodel/interop/npy.h"
#include "libmodel/interop/zip_archive.h"
#include "tests/libmodel/interop/foreign_files.h"
#include "tests/libmodel/interop/resealed_zip.h"
#include "tests/support/temporary_directory.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

struct HostileImports : ::testing::Test {
  TemporaryDirectory folder;
  MorphableModelParts parts = testing::face_sheet_parts(2);

  // One good file of each format.
  std::map<std::string, std::string> good() const {
    const MorphableModel model(parts);
    for (const char* f : {"npz", "glb", "flame"})
      export_model(folder / f, model, 0, export_format(f), {.texture_size = 16});
    testing::write_mat(folder / "v5", testing::bfm_variables(parts));
    testing::write_mat(folder / "v5z", testing::bfm_variables(parts), MAT_FT_MAT5, MAT_COMPRESSION_ZLIB);
    testing::write_mat(folder / "v73", testing::bfm_variables(parts), MAT_FT_MAT73);
    write_file(folder / "scm", testing::scm_bytes(parts));
    std::map<std::string, std::string> files;
    for (const char* f : {"npz", "glb", "flame", "v5", "v5z", "v73", "scm"}) files[f] = read_file(folder / f);
    return files;
  }
  void survives(const std::string& bytes, const std::string& format = "auto") const {
    write_file(folder / "bad.mat", bytes);
    try {
      import_model(folder / "bad.mat", {.format = format});
    } catch (const IoError& error) {
      EXPECT_THAT(error.what(), HasSubstr("bad.mat")) << "names the file";
    }
  }
};

TEST_F(HostileImports, FilesCutShortAreRefused) {
  for (const auto& [format, bytes] : good())
    for (int i = 0; i < 23; ++i) {
      write_file(folder / "cut.mat", bytes.substr(0, bytes.size() * static_cast<size_t>(i) / 23));
      EXPECT_THROW(import_model(folder / "cut.mat"), IoError) << format << " " << i;
    }
}

TEST_F(HostileImports, MangledFilesAreReadOrRefusedButNothingElse) {
  Random random(8);
  for (const auto& [format, bytes] : good())
    for (int trial = 0; trial < 60; ++trial) {
      std::string bad = bytes;
      const auto header = static_cast<int>(std::min<size_t>(bad.size(), 1500));
      for (int k = 1 + random.index(5); k > 0; --k)
        bad[static_cast<size_t>(random.index(k % 2 ? header : static_cast<int>(bad.size())))] =
            static_cast<char>(random.index(256));
      survives(bad);
      if (bad.starts_with("PK")) survives(testing::resealed(bad));
    }
}

TEST_F(HostileImports, OneFormatsFileReadAsAnotherIsRefused) {
  for (const auto& [format, bytes] : good())
    for (const std::string& as : import_format_names()) {
      const bool own = as == format || (format.starts_with("v") && as == "bfm2009");
      if (own || as == "ict") continue;
      write_file(folder / "other.bin", bytes);
      EXPECT_THROW(import_model(folder / "other.bin", {.format = as}), IoError) << format << " as " << as;
    }
}

TEST_F(HostileImports, CompressedMatlabFilesMustHaveTheirChecksums) {
  const std::string bytes = good().at("v5z");
  Random random(11);
  int refused = 0;
  for (int trial = 0; trial < 40; ++trial) {
    std::string bad = bytes;
    char& byte = bad[static_cast<size_t>(200 + random.index(static_cast<int>(bad.size()) - 400))];
    byte = static_cast<char>(byte ^ (1 << random.index(8)));
    write_file(folder / "bit.mat", bad);
    try {
      import_model(folder / "bit.mat", {.format = "bfm2009"});
    } catch (const IoError&) {
      ++refused;
    }
  }
  EXPECT_EQ(refused, 40);
}

TEST_F(HostileImports, MatlabFilesMustEndWithTheirLastVariable) {
  const auto files = good();
  for (const char* format : {"v5", "v5z"})
    for (const size_t missing : {1, 8, 100}) {
      const std::string& bytes = files.at(format);
      write_file(folder / "cut.mat", bytes.substr(0, bytes.size() - missing));
      EXPECT_THAT([&] { import_model(folder / "cut.mat"); }, ThrowsMessage<IoError>(HasSubstr("does not end with")))
          << format << " " << missing;
    }
}

// matio takes the memory that a damaged size asks for.
TEST_F(HostileImports, MatlabFilesOfLevelFourAreWalkedToo) {
  testing::write_mat(folder / "v4.mat", testing::bfm_variables(parts), MAT_FT_MAT4);
  const std::string bytes = read_file(folder / "v4.mat");
  EXPECT_EQ(import_model(folder / "v4.mat").model.shape().mode_count(), 4);
  const auto refused = [&](size_t at, std::uint32_t value, const std::string& what) {
    std::string bad = bytes;
    std::memcpy(bad.data() + at, &value, sizeof value);
    write_file(folder / "bad.mat", bad);
    EXPECT_THAT([&] { import_model(folder / "bad.mat", {.format = "bfm2009"}); },
                ThrowsMessage<IoError>(HasSubstr(what)));
  };
  refused(0, 90, "save it again");
  refused(0, 0x0b000000, "save it again");
  refused(4, 0x7fffffff, "promises more numbers");
  refused(8, 0x7fffffff, "promises more numbers");
  refused(8, 0xffffffff, "damaged variable");
  refused(12, 2, "damaged variable");
  refused(16, 0x7fffffff, "damaged variable");
  refused(16, 0, "damaged variable");
  write_file(folder / "bad.mat", bytes.substr(0, bytes.size() - 1));
  EXPECT_THROW(import_model(folder / "bad.mat"), IoError);
}

TEST_F(HostileImports, MatlabFilesOfTheOtherByteOrderAreRefused) {
  std::string bytes = good().at("v5");
  std::swap(bytes[126], bytes[127]);
  write_file(folder / "big.mat", bytes);
  EXPECT_THAT([&] { import_model(folder / "big.mat", {.format = "lsfm"}); },
              ThrowsMessage<IoError>(HasSubstr("byte order")));
}

TEST_F(HostileImports, FlameArraysThatDoNotFitAreRefusedByName) {
  export_model(folder / "good", MorphableModel(parts), 0, ExportFormat::flame);
  const auto refused = [&](const std::string& array, const std::string& bytes, const std::string& what) {
    ZipWriter zip;
    for (const auto& [name, content] : read_zip(folder / "good"))
      if (name != array) zip.add(name, content);
    zip.add(array, bytes);
    write_file(folder / "bad.npz", zip.finish());
    EXPECT_THAT([&] { import_model(folder / "bad.npz", {.leading_vertices = 20}); },
                ThrowsMessage<IoError>(HasSubstr(what)));
  };
  refused("identity_count.npy", npy_bytes("<i4", "0,", ""), "identity_count");
  refused("texcoords.npy", npy_bytes(NpyMatrix<double>::Zero(10, 2).eval()), "texcoords");
  refused("v_template.npy", npy_bytes("<f8", "0,3", ""), "no vertices");
}

TEST_F(HostileImports, NotANumberIsRefusedByName) {
  parts.shape.basis(5, 1) = std::numeric_limits<double>::quiet_NaN();
  testing::write_mat(folder / "nan.mat", testing::bfm_variables(parts));
  EXPECT_THAT([&] { import_model(folder / "nan.mat"); }, ThrowsMessage<IoError>(HasSubstr("'shapePC' holds NaN")));
  write_file(folder / "nan.scm", testing::scm_bytes(parts));
  EXPECT_THAT([&] { import_model(folder / "nan.scm"); }, ThrowsMessage<IoError>(HasSubstr("NaN")));
}

TEST_F(HostileImports, ArchivesThatLeadElsewhereOrPromiseTooMuchAreRefused) {
  export_model(folder / "good.npz", MorphableModel(parts), 0, ExportFormat::flame);
  const std::string bytes = read_file(folder / "good.npz");
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string bad = bytes;
    for (size_t at = bad.find(from); at != bad.npos; at = bad.find(from, at + to.size()))
      bad.replace(at, from.size(), to);
    write_file(folder / "bad.npz", bad);
    return folder / "bad.npz";
  };
  const fs::path path = replaced("v_template.npy", "../../tmp/x.np");
  EXPECT_THAT([&] { import_model(path); }, ThrowsMessage<IoError>(HasSubstr("no plain name")));
  std::string bomb = bytes;  // a member that would unpack to 2 GB: method 8, size 0x7fffffff
  const size_t entry = bomb.find("PK\x01\x02");
  bomb[entry + 10] = 8;
  bomb.replace(entry + 24, 4, "\xff\xff\xff\x7f");
  write_file(folder / "bomb.npz", bomb);
  EXPECT_THAT([&] { import_model(folder / "bomb.npz"); }, ThrowsMessage<IoError>(HasSubstr("cannot unpack")));
  const fs::path pickled = replaced("'descr': '<f4'", "'descr': '|O'}");
  EXPECT_THROW(import_model(pickled), IoError);
}

TEST_F(HostileImports, OtherThingsAreToldFromModelsWithACure) {
  const auto refused = [&](const std::string& bytes, const std::string& what) {
    write_file(folder / "thing", bytes);
    EXPECT_THAT([&] { import_model(folder / "thing"); }, ThrowsMessage<IoError>(HasSubstr(what)));
  };
  refused("", "empty");
  refused("\x80\x04\x95", "pickle");
  refused("{\"a\": 1}", "JSON");
  refused("hello, this is a text", "no model file");
  testing::write_mat(folder / "other.mat", {{"a", Eigen::MatrixXd::Ones(2, 2)}});
  EXPECT_THAT([&] { import_model(folder / "other.mat"); }, ThrowsMessage<IoError>(HasSubstr("it has a;")));
  EXPECT_THAT([&] { import_model(folder.path()); }, ThrowsMessage<IoError>(HasSubstr("generic_neutral_mesh.obj")));
}

TEST_F(HostileImports, FoldersWhoseMeshesDifferAreRefusedByTheFile) {
  testing::write_ict(folder / "ict", parts);
  Mesh other;
  other.V = as_vertices(parts.shape.mean).topRows(50);
  write_obj(folder.path() / "ict/identity001.obj", other);
  EXPECT_THAT([&] { import_model(folder / "ict"); }, ThrowsMessage<IoError>(HasSubstr("identity001.obj")));
}

}  // namespace
}  // namespace facewright
