// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// What a file from elsewhere may lead to, and what not.
#include <gmock/gmock.h>

#include "libmodel/core/errors.h"
#include "libmodel/io/folder_bounds.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/jpeg_tables.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/landmark_names.h"
#include "libmodel/io/manifest.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/io/text_encoding.h"
#include "scratch_folder.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
namespace fs = std::filesystem;

struct UntrustedFiles : ScratchFolder {
  void SetUp() override {
    ScratchFolder::SetUp();
    file("in/skin.png", "x");
    file("skin.png", "x");
    file("secret.png", "x");
    fs::create_symlink(folder_ / "secret.png", folder_ / "in/link.png");
    fs::create_directory_symlink(folder_, folder_ / "in/up");
    fs::create_symlink(folder_ / "in/loop.png", folder_ / "in/loop.png");
  }
  std::optional<fs::path> texture(const std::string& name) const {
    file("in/a.ply", "ply\nformat ascii 1.0\ncomment TextureFile " + name + "\nend_header\n");
    file("in/a.obj", "mtllib a.mtl\n");
    file("in/a.mtl", "newmtl m\nmap_Kd " + name + "\n");
    EXPECT_EQ(texture_file(folder_ / "in/a.ply"), texture_file(folder_ / "in/a.obj")) << name;
    return texture_file(folder_ / "in/a.ply");
  }
};

TEST_F(UntrustedFiles, FoldersEndWhereTheyEndWhateverTheNameSays) {
  const fs::path in = folder_ / "in";
  for (const char* inside :
       {"skin.png", "./skin.png", "missing.png", "deep/er/skin.png", "../in/skin.png", "up/in/skin.png"})
    EXPECT_TRUE(lies_inside(in / inside, in)) << inside;
  for (const char* outside :
       {"../skin.png", "/etc/hosts", "link.png", "up/skin.png", "deep/../../skin.png", "loop.png", ".."})
    EXPECT_FALSE(lies_inside(in / outside, in)) << outside;
  EXPECT_FALSE(lies_inside(in / std::string(5000, 'a'), in)) << "a name that the system refuses";
  EXPECT_FALSE(is_file(in / std::string(5000, 'a')));
  EXPECT_FALSE(is_file(in / "loop.png"));
  EXPECT_TRUE(is_file(in / "skin.png"));
}

TEST_F(UntrustedFiles, TheFolderOneIsInIsAFolderToo) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_ / "in");
  EXPECT_TRUE(lies_inside("skin.png", ""));
  EXPECT_FALSE(lies_inside("../skin.png", ""));
  fs::current_path(before);
}

TEST_F(UntrustedFiles, TexturesComeFromTheFolderOfTheMesh) {
  EXPECT_EQ(texture("skin.png"), folder_ / "in/skin.png");
  EXPECT_EQ(texture("../skin.png"), folder_ / "in/skin.png") << "the one beside the mesh";
  for (const char* outside : {"../secret.png", "/etc/hosts", "link.png", "up/secret.png", "..\\secret.png"})
    EXPECT_FALSE(texture(outside)) << outside;
  EXPECT_FALSE(texture(std::string(5000, 'a')));
}

TEST_F(UntrustedFiles, MaterialsComeFromTheFolderOfTheMesh) {
  file("a.mtl", "newmtl m\nmap_Kd skin.png\n");
  EXPECT_FALSE(texture_file(file("in/a.obj", "mtllib ../a.mtl\n")));
  EXPECT_FALSE(texture_file(file("in/a.obj", "mtllib " + (folder_ / "a.mtl").string() + "\n")));
}

TEST_F(UntrustedFiles, ManifestsDoNotFollowLinksOut) {
  file("a.ply", "ply\n");
  fs::create_symlink(folder_ / "a.ply", folder_ / "in/b.ply");
  for (const std::string name : {"../a.ply", "b.ply", "up/a.ply", "/etc/hosts"}) {
    const fs::path manifest = file("in/people.csv", "file\n" + name + "\n");
    EXPECT_THAT([&] { read_manifest(manifest); }, ThrowsMessage<IoError>(HasSubstr("outside"))) << name;
    EXPECT_NO_THROW(read_manifest(manifest, true)) << name;
  }
  const fs::path manifest = file("in/people.csv", "file\n" + std::string(5000, 'a') + "\n");
  EXPECT_THROW(read_manifest(manifest), IoError);
}

TEST_F(UntrustedFiles, TextThatIsNoUtf8IsTakenForLatin1) {
  EXPECT_EQ(as_utf8("plain"), "plain");
  EXPECT_EQ(as_utf8("n\xc3\xa9z \xe2\x82\xac \xf0\x9f\x98\x80"), "n\xc3\xa9z \xe2\x82\xac \xf0\x9f\x98\x80");
  EXPECT_EQ(as_utf8("n\xe9z"), "n\xc3\xa9z");
  for (const char* bad : {"\xc3", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82", "\xff\xfe", "\x80"}) {
    const std::string text = as_utf8(bad);
    EXPECT_GT(text.size(), std::string(bad).size());
    EXPECT_EQ(as_utf8(text), text) << "is UTF-8 now";
  }
}

TEST_F(UntrustedFiles, LandmarkNamesOfOldProgramsAreReadMappedAndWritten) {
  const fs::path csv = file("l.csv", "name,x,y,z\nn\xe9z,1,2,3\n\xff,4,5,6\n");
  const Landmarks landmarks = read_landmarks(csv);
  ASSERT_TRUE(landmarks.count("n\xc3\xa9z"));
  for (const char* name : {"l.json", "l.mrk.json", "l.pp", "l.lm3"}) {
    write_landmarks(folder_ / name, landmarks);
    EXPECT_EQ(read_landmarks(folder_ / name).size(), 2u) << name;
  }
  const LandmarkNames names = read_landmark_names(file("names.toml", "\"n\xe9z\" = 31\n"));
  EXPECT_TRUE(rename_landmarks(landmarks, names).count("31"));
}

TEST_F(UntrustedFiles, JsonThatNestsWithoutEndIsRefused) {
  const std::string deep = std::string(3'000'000, '[');
  for (const std::string& text :
       {deep, "{\"markups\": [{\"controlPoints\": " + deep + std::string(3'000'000, ']') + "}]}"})
    for (const char* name : {"l.json", "l.ljson"})
      EXPECT_THAT([&] { read_landmarks(file(name, text)); }, ThrowsMessage<IoError>(HasSubstr("too deeply"))) << name;
}

TEST_F(UntrustedFiles, JpegTablesThatOverflowTheReaderAreRefused) {
  const Image image(16, 16, 3, 90);
  const std::string good = jpeg_bytes(image);
  EXPECT_TRUE(jpeg_tables_fit(good));
  std::string bad = good;
  const size_t table = bad.find("\xff\xc4");
  ASSERT_NE(table, bad.npos);
  for (size_t i = 0; i < 16; ++i) bad[table + 5 + i] = '\xff';
  EXPECT_FALSE(jpeg_tables_fit(bad));
  EXPECT_THAT([&] { read_image(file("bad.jpg", bad)); }, ThrowsMessage<IoError>(HasSubstr("Huffman")));
  EXPECT_FALSE(jpeg_tables_fit("\xff" + bad)) << "fill bytes";
  EXPECT_FALSE(jpeg_tables_fit(bad.substr(0, table + 8))) << "three counts and the end of the file";
  EXPECT_TRUE(jpeg_tables_fit(bad.substr(0, table + 5))) << "none";
  // The same bytes where they are no segment, as in a picture's own comment.
  std::string comment = good.substr(0, 2) + std::string("\xff\xfe\x00\x24", 4) + bad.substr(table, 34) + good.substr(2);
  EXPECT_TRUE(jpeg_tables_fit(comment));
  EXPECT_NO_THROW(read_image(file("comment.jpg", comment)));
}

TEST_F(UntrustedFiles, PicturesWithoutPixelsAreRefused) {
  for (const char* text : {"P5 0 2 255 ", "P5 2 0 255 ", "P5:\n# text\n2 2\n255\nabcd"}) {
    const fs::path picture = file("a.ppm", text);
    EXPECT_THROW(read_image(picture), IoError) << text;
  }
}

}  // namespace
}  // namespace facewright
