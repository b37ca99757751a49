// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/image_files.h"

#include <gtest/gtest.h>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/io/atomic_file.h"
#include "tests/libmodel/io/scratch_folder.h"

namespace facewright {
namespace {

using ImageFiles = ScratchFolder;

TEST_F(ImageFiles, PngRoundTripIsExactInOneThreeAndFourChannels) {
  Random random(1);
  for (const int channels : {1, 3, 4}) {
    Image image(37, 23, channels);
    for (auto& byte : image.data) byte = static_cast<std::uint8_t>(random.index(256));
    write_png(folder_ / "a.png", image);
    const Image back = read_image(folder_ / "a.png");
    EXPECT_EQ(back.width, 37);
    EXPECT_EQ(back.height, 23);
    EXPECT_EQ(back.channels, channels);
    EXPECT_EQ(back.data, image.data);
  }
}

TEST_F(ImageFiles, JpegOfASmoothImageStaysCloseAndSharpensWithQuality) {
  Image image(64, 64, 3);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      for (int k = 0; k < 3; ++k) image.pixel(x, y)[k] = static_cast<std::uint8_t>(40 + x + y + 20 * k);
  const auto worst = [&](int quality) {
    write_jpeg(folder_ / "a.jpg", image, quality);
    const Image back = read_image(folder_ / "a.jpg");
    int error = 0;
    for (size_t i = 0; i < image.data.size(); ++i) error = std::max(error, std::abs(back.data[i] - image.data[i]));
    return error;
  };
  EXPECT_LE(worst(95), 6);
  EXPECT_LE(worst(95), worst(10));
}

TEST_F(ImageFiles, RefusesDamagedAndHugeImagesAndBadArguments) {
  write_file(folder_ / "a.png", "this is no image");
  EXPECT_THROW(read_image(folder_ / "a.png"), IoError);
  write_png(folder_ / "b.png", Image(50, 50, 3, 7));
  const std::string bytes = read_file(folder_ / "b.png");
  write_file(folder_ / "b.png", std::string_view(bytes).substr(0, 40));
  EXPECT_THROW(read_image(folder_ / "b.png"), IoError);
  std::string huge = bytes;  // IHDR width and height of 60000 each
  for (const size_t at : {16, 20}) huge.replace(at, 4, std::string("\0\0\xea\x60", 4));
  write_file(folder_ / "c.png", huge);
  EXPECT_THROW(read_image(folder_ / "c.png"), IoError);
  EXPECT_THROW(write_png(folder_ / "d.png", Image()), InvalidInput);
  EXPECT_THROW(write_png(folder_ / "d.png", Image(3, 3, 2)), InvalidInput);
  EXPECT_THROW(write_jpeg(folder_ / "d.jpg", Image(3, 3, 3), 0), InvalidInput);
}

TEST_F(ImageFiles, PngWithEmptyPiecesOfDataIsReadAsWithout) {
  Image image(9, 7, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<std::uint8_t>(i);
  const std::string bytes = png_bytes(image), empty("\0\0\0\0IDAT\x35\xaf\x06\x1e", 12);
  const size_t data = bytes.find("IDAT") - 4, end = bytes.find("IEND") - 4;
  std::string holed = bytes;
  holed.insert(end, empty + empty);
  holed.insert(data, empty);
  write_file(folder_ / "holed.png", holed);
  EXPECT_EQ(read_image(folder_ / "holed.png").data, image.data);
  write_file(folder_ / "nothing.png", bytes.substr(0, data) + empty + bytes.substr(end));
  EXPECT_THROW(read_image(folder_ / "nothing.png"), IoError);
  write_file(folder_ / "cut.png", bytes.substr(0, data) + empty.substr(0, 10));
  EXPECT_THROW(read_image(folder_ / "cut.png"), IoError);
}

}  // namespace
}  // namespace facewright
