// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// Real scans lie beside the source tree where they are available; elsewhere these tests are skipped.
#include <gtest/gtest.h>

#include "libregister/intake/scan.h"
#include "libregister/reference/reference_face.h"
#include "libregister/registration/register_scan.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

class RealScan : public ::testing::TestWithParam<const char*> {};

TEST_P(RealScan, RegistersWithoutFoldsOnItsSurface) {
  const fs::path folder = fs::path(FACEWRIGHT_SOURCE_DIR) / "../shared/data/real" / GetParam();
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const Scan scan = load_scan(find_scans(folder).at(0));
  EXPECT_FALSE(scan.texture.empty());
  const RegistrationResult r = register_scan(scan.mesh, scan.landmarks, default_reference());
  EXPECT_EQ(r.summary.folds, 0);
  EXPECT_LT(r.summary.surface_mean, 0.05);  // mm
  EXPECT_TRUE(r.summary.acceptable) << r.summary.concern;
  EXPECT_GT(r.summary.matched, 0.9 * static_cast<double>(r.V.rows()));
}

INSTANTIATE_TEST_SUITE_P(Heads, RealScan, ::testing::Values("james", "lps"));

}  // namespace
}  // namespace facewright
