// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/foreign_geometry.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <sstream>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr double kLowestFace = 120, kHighestHead = 350;  // mm, eyebrows to chin at least, shoulders left out at most

Eigen::Vector3d area_normal(const Vertices& V, const Faces& F, Eigen::Index f) {
  const Eigen::Vector3d a = V.row(F(f, 0)), b = V.row(F(f, 1)), c = V.row(F(f, 2));
  return (b - a).cross(c - a) / 2;
}

}  // namespace

double face_height(const Vertices& V) { return V.rows() == 0 ? 0 : V.col(1).maxCoeff() - V.col(1).minCoeff(); }

double millimetres_per(const std::string& unit) {
  if (unit == "um") return 1e-3;
  if (unit == "mm") return 1;
  if (unit == "cm") return 10;
  if (unit == "m") return 1000;
  throw InvalidInput("import: units are '" + unit + "'; expected auto, um, mm, cm or m");
}

std::string plausible_unit(double height) {
  for (const char* unit : {"um", "mm", "cm", "m"})
    if (const double mm = height * millimetres_per(unit); mm >= kLowestFace && mm <= kHighestHead) return unit;
  return "";
}

double outwardness(const Vertices& V, const Faces& F) {
  const Eigen::RowVector3d middle = V.colwise().mean();
  double sum = 0, size = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d n = area_normal(V, F, f);
    const Eigen::Vector3d out = ((V.row(F(f, 0)) + V.row(F(f, 1)) + V.row(F(f, 2))) / 3 - middle).transpose();
    sum += n.dot(out);
    size += n.norm() * out.norm();
  }
  return size > 0 ? sum / size : 0;
}

Eigen::Vector3d mean_normal(const Vertices& V, const Faces& F) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double area = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const Eigen::Vector3d n = area_normal(V, F, f);
    sum += n;
    area += n.norm();
  }
  return area > 0 ? Eigen::Vector3d(sum / area) : sum;
}

Eigen::Matrix3d axes_rotation(const std::string& axes) {
  std::istringstream words(axes);
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  int row = 0;
  for (std::string word; words >> word; ++row) {
    const bool negative = word.front() == '-';
    const std::string name = word.substr(word.find_first_of("xyz") == word.npos ? word.size() : word.size() - 1);
    const size_t axis = std::string("xyz").find(name);
    if (row > 2 || name.empty() || axis == std::string::npos || word.size() > 2 ||
        (word.size() == 2 && !negative && word.front() != '+'))
      throw InvalidInput("import: axes are '" + axes + "'; expected three such as \"x z -y\"");
    R(row, static_cast<Eigen::Index>(axis)) = negative ? -1 : 1;
  }
  if (row != 3 || std::abs(R.determinant()) < 0.5)
    throw InvalidInput("import: axes are '" + axes + "'; expected three different ones such as \"x z -y\"");
  if (R.determinant() < 0)
    throw InvalidInput("import: axes '" + axes + "' would make a mirror image; change the sign of one");
  return R;
}

void rotate_points(Eigen::Ref<Eigen::MatrixXd> columns, const Eigen::Matrix3d& rotation) {
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    auto points = columns.col(c).reshaped(3, columns.rows() / 3);
    points = (rotation * points).eval();
  }
}

}  // namespace facewright
