// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.

// Skull, cheeks and jaw: a smooth radius over the directions from a point inside the head, interpolated through
// horizontal sections that we drew ourselves to published distances [farkas1994, farkas2005]; and the neck.

#include <Eigen/LU>
#include <array>
#include <numbers>
#include <vector>

#include "libmodel/synthetic/mean_head_internal.h"

namespace facewright::mean_head {
namespace {

const Vector3d centre{0, -8, -30};

/// Section points (x >= 0, y, z) of the face and jaw without nose, lips and eyeballs.
constexpr std::array<double, 3> section_points[] = {
    // forehead
    {0, 99, 14},
    {26, 97, 8},
    {46, 90, -6},
    {0, 108, -10},
    {30, 105, -16},
    {52, 94, -26},
    {0, 86, 34.5},
    {26, 83, 29},
    {45, 77, 14},
    {61, 74, -14},
    {0, 69, 47.5},
    {22, 67, 44.5},
    {40, 64, 34},
    {55, 61, 14},
    {67.5, 61, -14},
    {0, 48, 55},
    {20, 48, 53},
    {38, 48, 44.5},
    {52, 48, 30},
    {62, 48, 11},
    {69, 48, -10},
    {73, 48, -32},
    {0, 32, 57},
    {15, 32, 56.5},
    {30, 32, 52.5},
    {43, 32, 43.5},
    {54, 32, 29.5},
    {61, 32, 13},
    {66, 32, -5},
    {70, 32, -26},
    // brow ridge
    {0, 20, 56},
    {12, 20, 56},
    {25, 20, 53.5},
    {38, 20, 47.5},
    {48, 20, 38},
    {55, 20, 27},
    {61, 20, 12},
    {66, 20, -6},
    // orbit
    {0, 11, 50},
    {11, 10, 47},
    {20, 10, 43},
    {30, 11, 42},
    {40, 11, 40.5},
    {48, 10, 34.5},
    {54, 10, 25},
    {61, 10, 10},
    {67, 8, -8},
    {0, 1, 45},
    {12, 0, 40},
    {19, 0, 36.5},
    {31, 0, 34},
    {41, 0, 33},
    {48, 0, 29.5},
    {54, 0, 23},
    {61, -1, 10.5},
    {67.5, -2, -8},
    {0, -12, 45},
    {10, -12, 43.5},
    {18, -12, 42},
    {31, -12, 41.5},
    {42, -12, 38.5},
    {50, -12, 34},
    {57, -12, 26},
    {63.5, -12, 13},
    {67.5, -13, -4},
    {70, -14, -24},
    // cheek
    {0, -25, 47},
    {12, -25, 48.5},
    {20, -25, 48.5},
    {32, -25, 47.5},
    {43, -25, 43},
    {52, -25, 36},
    {59, -25, 26},
    {64.5, -25, 13},
    {67.5, -26, -4},
    {69, -28, -26},
    {0, -38, 53},
    {15, -38, 53},
    {25, -38, 50.5},
    {36, -38, 46},
    {46, -38, 38.5},
    {54, -38, 29.5},
    {60, -38, 20},
    {64, -38, 8},
    {65.5, -40, -8},
    {65.5, -42, -26},
    {0, -50, 58},
    {12, -50, 57.5},
    {22, -50, 54},
    {34, -50, 47.5},
    {44, -50, 38.5},
    {52, -50, 28},
    {57.5, -50, 17},
    {61, -50, 4},
    {62, -52, -12},
    {0, -61, 60.5},
    {12, -61, 59},
    {24, -61, 53},
    {34, -61, 46},
    {43, -61, 36},
    {50, -61, 25.5},
    {55, -61, 13.5},
    {58, -61, 0},
    {58.5, -63, -14},
    // mouth and chin
    {0, -75, 57.5},
    {12, -75, 56},
    {23, -75, 50},
    {33, -75, 41.5},
    {41, -75, 31},
    {47.5, -75, 19},
    {52, -75, 6},
    {53.5, -74, -8},
    {0, -86, 53.5},
    {11, -86, 52},
    {22, -86, 45.5},
    {31, -86, 36},
    {38, -86, 25},
    {43.5, -86, 12},
    {47, -83, -3},
    {0, -98, 55},
    {10, -98, 53},
    {19, -97.5, 45.5},
    {27, -97, 35.5},
    {34, -95, 23},
    {40, -91, 9},
    {0, -107, 52},
    {9, -106.5, 49.5},
    {17, -105, 42},
    {24, -103, 31},
    // under the jaw
    {0, -113, 43},
    {10, -112, 39},
    {0, -112.5, 28},
    {14, -110, 24},
    {0, -108, 8},
    {16, -106, 6},
    {30, -97, 6},
    {40, -86, -10},
    {46, -78, -22},
    {52, -62, -26},
    {0, -102, -14},
    {22, -98, -14},
    // behind the jaw, hidden in the neck
    {34, -88, -36},
    {0, -92, -50},
    {52, -66, -52},
    {30, -78, -75},
    {62, -44, -48},
    {55, -52, -80},
};

/// Cranium behind the face: an ellipsoid fitted to head breadth (eu-eu 149), length (g-op 191) and vertex height.
void append_cranium(std::vector<Vector3d>& points) {
  const Vector3d c{0, 22, -44}, radii{74.5, 90, 90};
  for (double elevation = -35; elevation <= 90; elevation += 25)
    for (double azimuth = 0; azimuth <= 180; azimuth += elevation > 60 ? 60 : 30) {
      const double e = elevation * std::numbers::pi / 180, a = azimuth * std::numbers::pi / 180;
      const Vector3d n{std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)};
      const double norm = std::pow(n.cwiseAbs().array().pow(2.35).sum(), 1 / 2.35);
      const Vector3d p = c + radii.cwiseProduct(n) / norm;
      if (p.z() < -34 && p.y() > -46) points.push_back(p);
    }
}

/// Radius over direction: sum of w |d - d_i|^3 over both sides plus a linear part, slightly smoothed.
class RadialSurface {
 public:
  RadialSurface() {
    std::vector<Vector3d> points;
    for (const auto& p : section_points) points.emplace_back(p[0], p[1], p[2]);
    append_cranium(points);
    const auto n = static_cast<Eigen::Index>(points.size());
    directions_.resize(n, 3);
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(n + 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Vector3d d = points[static_cast<size_t>(i)] - centre;
      rhs[i] = d.norm();
      directions_.row(i) = d.normalized().transpose().array();
    }
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + 3, n + 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      A.row(i).head(n) = kernels(directions_.row(i).matrix().transpose()).matrix().transpose();
      A(i, i) += smoothing;
      const Vector3d tail{1, directions_(i, 1), directions_(i, 2)};
      A.row(i).tail<3>() = tail.transpose();
      A.col(i).tail<3>() = tail;
    }
    const Eigen::VectorXd solution = A.partialPivLu().solve(rhs);
    weights_ = solution.head(n);
    tail_ = solution.tail<3>();
  }

  double radius(const Vector3d& d) const {
    return (kernels(d) * weights_).sum() + tail_[0] + tail_[1] * d.y() + tail_[2] * d.z();
  }

 private:
  static constexpr double smoothing = 1e-3;

  Eigen::ArrayXd kernels(const Vector3d& d) const {
    const Eigen::ArrayXd yz = (directions_.col(1) - d.y()).square() + (directions_.col(2) - d.z()).square();
    const Eigen::ArrayXd a = yz + (directions_.col(0) - d.x()).square(), b = yz + (directions_.col(0) + d.x()).square();
    return a * a.sqrt() + b * b.sqrt();
  }

  Eigen::Array<double, Eigen::Dynamic, 3> directions_;
  Eigen::ArrayXd weights_;
  Vector3d tail_ = Vector3d::Zero();
};

/// The radial surface tabulated over azimuth and elevation, read by cubic convolution [keys1981]: 30 times faster.
class RadiusTable {
 public:
  RadiusTable() : values_(azimuths + 3, elevations + 3) {
    const RadialSurface surface;
    for (Eigen::Index a = 0; a < values_.rows(); ++a)
      for (Eigen::Index e = 0; e < values_.cols(); ++e) {
        const double azimuth = static_cast<double>(a - 1) * step,
                     elevation = static_cast<double>(e - 1) * step - pi / 2;
        const double c = std::cos(elevation);
        values_(a, e) = surface.radius({c * std::sin(azimuth), std::sin(elevation), c * std::cos(azimuth)});
      }
  }

  double radius(const Vector3d& d) const {
    const double a = std::atan2(d.x(), d.z()) / step, e = (std::asin(std::clamp(d.y(), -1.0, 1.0)) + pi / 2) / step;
    const auto i = std::min(static_cast<Eigen::Index>(a), azimuths - 1),
               j = std::min(static_cast<Eigen::Index>(e), elevations - 1);
    const Eigen::Vector4d u = cubic(a - static_cast<double>(i)), v = cubic(e - static_cast<double>(j));
    return u.dot(values_.block<4, 4>(i, j) * v);
  }

 private:
  static constexpr double pi = std::numbers::pi;
  static constexpr Eigen::Index azimuths = 120, elevations = 120;
  static constexpr double step = std::numbers::pi / 120;

  static Eigen::Vector4d cubic(double t) {
    const double t2 = t * t, t3 = t2 * t;
    return {(-t + 2 * t2 - t3) / 2, (2 - 5 * t2 + 3 * t3) / 2, (t + 4 * t2 - 3 * t3) / 2, (t3 - t2) / 2};
  }
  Eigen::MatrixXd values_;
};

double neck_distance(const Vector3d& p) {
  const double t = std::clamp((-60 - p.y()) / 110, 0.0, 1.3), z = -60 - 12 * t;
  const double radius = 50 + 4 * t * t, stretched = std::hypot(p.x() * 1.06, (p.z() - z) * 0.97);
  double d = (stretched - radius) * 0.97;
  // the slanting neck muscle and the larynx
  d -= 2.2 * gauss((p.x() - 42 + 26 * t) / 9) * smooth_step(-80, -40, p.z()) * smooth_step(-70, -95, p.y());
  d -= 3.0 * gauss(p.x() / 9) * gauss((p.y() + 138) / 13) * smooth_step(-60, -30, p.z());
  return smooth_max(d, p.y() + 40, 20);
}

}  // namespace

double base_distance(const Vector3d& p) {
  static const RadiusTable table;
  const Vector3d q{std::abs(p.x()), p.y(), p.z()}, d = q - centre;
  const double r = d.norm();
  const double head = r < 20 ? r - 80 : (r - table.radius(d / r)) * 0.94;
  return smooth_min(head, neck_distance(q), 13);
}

}  // namespace facewright::mean_head
