// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/error_picture.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "libmodel/core/errors.h"
#include "libmodel/core/similarity.h"
#include "libmodel/geometry/normals.h"
#include "libmodel/surface/nearest.h"
#include "libregister/reference/reference_face.h"
#include "pipelines/picture_text.h"
#include "pipelines/registration_report.h"

namespace facewright {
namespace {

const MultiresTemplate& reference() {
  static const MultiresTemplate r = build_template(default_reference_face(), {3448});
  return r;
}

// The reference as its own scan; the "registered" face lies `off` mm outside it everywhere.
RegistrationResult offset_face(double off) {
  const Mesh face = reference().level_mesh(1);
  RegistrationResult r;
  r.denoised = face;
  r.V = face.V + off * vertex_normals(face.V, face.F);
  r.origins.assign(static_cast<size_t>(face.V.rows()), MatchOrigin::matched);
  return r;
}

Image picture_of(RegistrationResult r, const ErrorPictureOptions& options = {}) {
  r.nearest = SurfaceIndex(r.denoised.V, r.denoised.F).nearest(r.V);
  return error_picture(r, reference(), options);
}

struct Shares {
  double red = 0, blue = 0, grey = 0;
};

// Of the pixels of the three views that show the face.
Shares shares(const Image& image, int height = ErrorPictureOptions{}.height) {
  Shares s;
  double face = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* p = image.pixel(x, y);
      if (p[0] == 255 && p[1] == 255 && p[2] == 255) continue;
      face += 1;
      s.red += p[0] > p[2] + 15;
      s.blue += p[2] > p[0] + 15;
      s.grey += std::abs(p[0] - p[2]) <= 15 && p[0] < 190;
    }
  s.red /= face, s.blue /= face, s.grey /= face;
  return s;
}

TEST(SignedDistances, TellTheOffsetOfAShellAndItsSide) {
  for (const double off : {0.2, -0.2}) {
    const RegistrationResult r = offset_face(off);
    const Eigen::VectorXd d = signed_distances(r.V, r.denoised, SurfaceIndex(r.denoised.V, r.denoised.F).nearest(r.V));
    // In creases the nearest place is another one than the vertex came from: nearer, on the same side.
    EXPECT_GT(((d.array() - off).abs() < 0.02).cast<double>().mean(), 0.95);
    EXPECT_GT((d.array() * off > 0).cast<double>().mean(), 0.99);
  }
}

TEST(SignedDistances, RefusePointsWithoutANearestPlace) {
  const RegistrationResult r = offset_face(0.2);
  EXPECT_THROW(signed_distances(r.V, r.denoised, {}), InvalidInput);
}

TEST(ErrorPicture, IsRedOutsideBlueInsideAndNeitherOnTheSurface) {
  EXPECT_GT(shares(picture_of(offset_face(0.6))).red, 0.9);
  EXPECT_GT(shares(picture_of(offset_face(-0.6))).blue, 0.9);
  const Shares on = shares(picture_of(offset_face(0)));
  EXPECT_LT(on.red + on.blue, 0.02);
}

TEST(ErrorPicture, GreysWhatFoundNoMatchWhateverItsDistance) {
  RegistrationResult r = offset_face(0.6);
  const double before = shares(picture_of(r)).grey;
  std::fill(r.origins.begin(), r.origins.end(), MatchOrigin::interpolated);
  const Shares after = shares(picture_of(r));
  EXPECT_LT(before, 0.05);
  EXPECT_GT(after.grey, 0.95);
  EXPECT_LT(after.red, 0.01);
}

TEST(ErrorPicture, TellsMirroredFromInterpolatedFromFree) {
  RegistrationResult r = offset_face(0);
  std::vector<Image> pictures;
  for (const MatchOrigin o : {MatchOrigin::mirrored, MatchOrigin::interpolated, MatchOrigin::free}) {
    std::fill(r.origins.begin(), r.origins.end(), o);
    pictures.push_back(picture_of(r));
  }
  EXPECT_NE(pictures[0].data, pictures[1].data);
  EXPECT_NE(pictures[0].data, pictures[2].data);
  EXPECT_NE(pictures[1].data, pictures[2].data);
}

TEST(ErrorPicture, HalvesTheColoursWhenTheRangeDoubles) {
  const Image narrow = picture_of(offset_face(0.3), {.range = 1}), wide = picture_of(offset_face(0.6), {.range = 2});
  int different = 0;  // the shells' silhouettes differ by less than a pixel
  for (size_t i = 0; i < narrow.data.size(); ++i) different += std::abs(narrow.data[i] - wide.data[i]) > 24;
  EXPECT_LT(different, static_cast<int>(narrow.data.size() / 25));
}

TEST(ErrorPicture, DoesNotDependOnWhereTheScanLies) {
  RegistrationResult r = offset_face(0.3);
  const Image before = picture_of(r);
  Similarity move;
  move.R = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  move.t = {300, -200, 50};
  r.V = move.apply(r.V), r.denoised.V = move.apply(r.denoised.V);
  const Image after = picture_of(r);
  int different = 0;  // rounding moves a silhouette pixel now and then
  for (size_t i = 0; i < before.data.size(); ++i) different += std::abs(before.data[i] - after.data[i]) > 8;
  EXPECT_LT(different, static_cast<int>(before.data.size() / 2000));
}

TEST(ErrorPicture, RefusesAnotherReferenceAndSizesThatDoNotFit) {
  RegistrationResult r = offset_face(0);
  EXPECT_THROW(error_picture(r, reference()), InvalidInput);  // nearest places are missing
  EXPECT_THROW(picture_of(r, {.range = 0}), InvalidInput);
  EXPECT_THROW(picture_of(r, {.height = 20}), InvalidInput);
  EXPECT_THROW(picture_of(r, {.side = 120}), InvalidInput);
  r.origins.pop_back();
  EXPECT_THROW(picture_of(r), InvalidInput);
}

TEST(PictureText, StaysInsideTheImageAndIsAsWideAsItSays) {
  Image image(60, 20, 3, 255);
  draw_text(image, {-7, -5}, "+0.5 mm", {0, 0, 0}, 3);
  draw_text(image, {50, 15}, "interpolated", {0, 0, 0}, 3);
  EXPECT_EQ(text_width("0.5", 2), 36);
  Image plain(60, 20, 3, 255);
  draw_text(plain, {2, 2}, "8", {0, 0, 0}, 1);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 60; ++x)
      EXPECT_TRUE((x >= 2 && x < 7 && y >= 2 && y < 9) || plain.pixel(x, y)[0] == 255) << x << ' ' << y;
}

TEST(RegistrationSummary, NamesWhatWasRejectedAndWhyVerticesFoundNoMatch) {
  RegisterSummary s;
  s.landmarks_used = 66, s.landmarks_rejected = {"12", "31"}, s.swapped_left_right = true;
  s.matched = 90, s.mirrored = 4, s.interpolated = 6;
  s.match_status[0] = 90;
  s.match_status[static_cast<size_t>(MatchStatus::on_border)] = 7;
  s.match_status[static_cast<size_t>(MatchStatus::not_mutual)] = 3;
  s.folds = 2;
  s.seconds = {{"denoise", 0.3}};
  const std::string text = summarise_registration(s);
  for (const char* part :
       {"66 used", "2 rejected", "12 31", "swapped", "matched 90 (90.0 %)", "mirrored 4", "interpolated 6",
        "7 at the scan's border", "3 nearer to another part", "2 edges", "denoise 0.30"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  EXPECT_EQ(text.find("too far"), std::string::npos);
}

}  // namespace
}  // namespace facewright
