// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/model/nesting.h"

#include <Eigen/SVD>
#include <algorithm>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

constexpr double kMissing = std::numeric_limits<double>::infinity();
constexpr double kRotated = 1e-5;  // of the largest entry: float32 products of some hundred modes

template <class A, class B>
double difference(const A& part, const B& whole) {
  if (part.rows() > whole.rows() || part.cols() != whole.cols()) return kMissing;
  if (part.size() == 0) return 0;
  return (part - whole.topRows(part.rows())).cwiseAbs().maxCoeff();
}

class Comparison {
 public:
  Comparison(const MorphableModel& coarse, const MorphableModel& fine)
      : coarse_(coarse), fine_(fine), n_(coarse.vertex_count()) {}

  std::vector<NestingRow> run() {
    compare(coarse_.shape(), fine_.shape(), "positions", "shape", "mm");
    if (coarse_.has_colour() || fine_.has_colour())
      compare(coarse_.colour(), fine_.colour(), "colours", "colour", "linear RGB");
    if (coarse_.expression() || fine_.expression())
      compare(coarse_.expression().value_or(PcaModel{}), fine_.expression().value_or(PcaModel{}), "expression mean",
              "expression", "mm");
    if (!coarse_.blendshapes().empty() || !fine_.blendshapes().empty())
      add("blendshapes", blendshape_difference(), 0, "mm");
    if (coarse_.uv().rows() > 0 || fine_.uv().rows() > 0)
      add("texture coordinates", coarse_.uv().rows() == n_ ? difference(coarse_.uv(), fine_.uv()) : kMissing);
    if (!coarse_.landmarks().empty() || !fine_.landmarks().empty()) {
      add("landmark vertices", landmark_vertices());
      add("landmark places", landmark_places());
    }
    if (!coarse_.regions().empty() || !fine_.regions().empty()) {
      add("regions", coarse_.regions() == below(fine_.regions()) ? 0 : region_difference());
      add("contours", contour_difference());
    }
    if (!coarse_.mirror().empty() || !fine_.mirror().empty())
      add("symmetry", leading_difference(coarse_.mirror(), fine_.mirror()));
    if (!coarse_.parents().empty() || !fine_.parents().empty()) add("parents", parent_difference());
    return std::move(rows_);
  }

 private:
  using Regions = std::map<std::string, std::vector<int>>;

  void add(const std::string& quantity, double deviation, double tolerance = 0, const std::string& unit = "") {
    rows_.push_back({n_, fine_.vertex_count(), quantity, deviation, tolerance, unit});
  }

  void compare(const PcaModel& part, const PcaModel& whole, const std::string& mean, const std::string& name,
               const std::string& unit) {
    add(mean, part.mean.size() == 3 * n_ ? difference(part.mean, whole.mean) : kMissing, 0, unit);
    if (part.mode_count() == 0 && whole.mode_count() == 0) return;
    if (part.mode_count() == 0 || part.basis.rows() > whole.basis.rows())
      return add(name + " basis rows", kMissing, 0, unit + " per standard deviation");
    const bool alike = part.basis.rows() == part.mean.size() && part.variances.size() == whole.variances.size() &&
                       part.variances == whole.variances;
    if (alike || !part.orthonormal || part.mode_count() > whole.mode_count()) {
      add(name + " basis rows",
          part.mode_count() == whole.mode_count() ? difference(part.basis, whole.basis) : kMissing);
      add(name + " variances",
          part.mode_count() == whole.mode_count() ? difference(part.variances, whole.variances) : kMissing);
      return;
    }
    compare_rotated(part.rescaled_basis(), whole.rescaled_basis().topRows(part.basis.rows()), name, unit);
  }

  // The rotation R that brings W R nearest to X, columns of W being fewer where a level lost a mode.
  void compare_rotated(const Eigen::MatrixXd& W, const Eigen::MatrixXd& X, const std::string& name,
                       const std::string& unit) {
    const Eigen::MatrixXd M = W.transpose() * X;
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(M, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const double left = (W * (svd.matrixU() * svd.matrixV().transpose()) - X).cwiseAbs().maxCoeff();
    add(name + " basis rows up to a rotation", left, kRotated * X.cwiseAbs().maxCoeff(),
        unit + " per standard deviation");
  }

  double blendshape_difference() const {
    const auto &part = coarse_.blendshapes(), &whole = fine_.blendshapes();
    if (part.size() != whole.size()) return kMissing;
    double worst = 0;
    for (size_t i = 0; i < part.size(); ++i)
      worst = std::max(
          worst, part[i].name == whole[i].name ? difference(part[i].displacement, whole[i].displacement) : kMissing);
    return worst;
  }

  double landmark_vertices() const {
    double worst = coarse_.landmarks().size() == fine_.landmarks().size() ? 0 : kMissing;
    for (const auto& [name, mark] : coarse_.landmarks()) {
      const auto other = fine_.landmarks().find(name);
      worst =
          std::max(worst, other == fine_.landmarks().end() ? kMissing : std::abs(mark.vertex - other->second.vertex));
    }
    return worst;
  }

  // Barycentric distance of the coarse places, carried to the fine triangles, from the fine places.
  double landmark_places() const {
    const LandmarkSet coarse = coarse_.landmarks(0), fine = fine_.landmarks(0);
    const int base = fine_.base_vertex_count();
    double worst = 0;
    for (const auto& [name, mark] : coarse) {
      const auto other = fine.find(name);
      if (other == fine.end() || (mark.vertex != other->second.vertex)) return kMissing;
      if (mark.vertex >= 0) continue;
      if (base > n_ || n_ > fine_.vertex_count()) return kMissing;
      const SurfacePoint& p = other->second.point;
      if (same_mesh()) {
        worst = std::max(worst, distance(mark.point, p));
        continue;
      }
      try {
        const SurfacePoint carried =
            carry_point(mark.point, coarse_.faces(), n_, {fine_.parents().begin() + (n_ - base), fine_.parents().end()},
                        fine_.faces());
        worst = std::max(worst, distance(carried, p));
      } catch (const InvalidInput&) {
        return kMissing;  // no fine triangle lies in the coarse one
      }
    }
    return worst;
  }

  bool same_mesh() const {
    const Faces &a = coarse_.faces(), &b = fine_.faces();
    return n_ == fine_.vertex_count() && a.rows() == b.rows() && a == b;
  }

  // As weights of vertices, since on a shared edge either triangle will do.
  double distance(const SurfacePoint& a, const SurfacePoint& b) const {
    std::map<int, double> weights;
    for (int k = 0; k < 3; ++k) {
      weights[fine_.faces()(a.triangle, k)] += a.barycentric[k];
      weights[fine_.faces()(b.triangle, k)] -= b.barycentric[k];
    }
    double worst = 0;
    for (const auto& [v, w] : weights) worst = std::max(worst, std::abs(w));
    return worst;
  }

  Regions below(const Regions& regions) const {
    Regions result;
    for (const auto& [name, vertices] : regions) {
      auto& kept = result[name];
      std::copy_if(vertices.begin(), vertices.end(), std::back_inserter(kept), [this](int v) { return v < n_; });
    }
    return result;
  }

  // Vertices in one of the two only.
  double region_difference() const {
    const Regions expected = below(fine_.regions());
    double count = expected.size() == coarse_.regions().size() ? 0 : kMissing;
    for (auto [name, vertices] : expected) {
      const auto own = coarse_.regions().find(name);
      if (own == coarse_.regions().end()) return kMissing;
      std::vector<int> other = own->second, apart;
      std::sort(vertices.begin(), vertices.end());
      std::sort(other.begin(), other.end());
      std::set_symmetric_difference(vertices.begin(), vertices.end(), other.begin(), other.end(),
                                    std::back_inserter(apart));
      count += static_cast<double>(apart.empty() && own->second != expected.at(name) ? 1 : apart.size());
    }
    return count;
  }

  double contour_difference() const {
    const FaceContours a = coarse_.contours(), b = fine_.contours();
    const Regions part = {{"l", a.left}, {"r", a.right}}, whole = {{"l", b.left}, {"r", b.right}};
    return part == below(whole) ? 0 : kMissing;
  }

  double leading_difference(const std::vector<int>& part, const std::vector<int>& whole) const {
    if (static_cast<int>(part.size()) != n_ || part.size() > whole.size()) return kMissing;
    double worst = 0;
    for (size_t i = 0; i < part.size(); ++i) worst = std::max<double>(worst, std::abs(part[i] - whole[i]));
    return worst;
  }

  double parent_difference() const {
    const auto &part = coarse_.parents(), &whole = fine_.parents();
    if (part.size() > whole.size() || coarse_.base_vertex_count() != fine_.base_vertex_count()) return kMissing;
    double worst = 0;
    for (size_t i = 0; i < part.size(); ++i)
      for (const auto& [p, q] : {std::pair(part[i].a, whole[i].a), {part[i].b, whole[i].b}, {part[i].c, whole[i].c}})
        worst = std::max<double>(worst, std::abs(p - q));
    return worst;
  }

  const MorphableModel &coarse_, &fine_;
  int n_;
  std::vector<NestingRow> rows_;
};

}  // namespace

std::vector<NestingRow> compare_levels(const MorphableModel& coarse, const MorphableModel& fine) {
  return Comparison(coarse, fine).run();
}

bool all_hold(const std::vector<NestingRow>& rows) {
  return std::all_of(rows.begin(), rows.end(), [](const NestingRow& r) { return r.holds(); });
}

double largest_deviation(const std::vector<NestingRow>& rows) {
  double worst = 0;
  for (const NestingRow& r : rows)
    if (r.tolerance == 0) worst = std::max(worst, r.deviation);
  return worst;
}

}  // namespace facewright
