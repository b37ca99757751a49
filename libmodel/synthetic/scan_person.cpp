// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/scan_person.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "libmodel/core/errors.h"
#include "libmodel/core/random.h"
#include "libmodel/core/topology.h"
#include "libmodel/synthetic/range_grid.h"
#include "libmodel/synthetic/smooth_noise.h"

namespace facewright {
namespace {

using Eigen::Vector3d;

constexpr double axis_z = -25;

void check(const ScannerOptions& o) {
  const auto within = [](double x, double lo, double hi, const char* name) {
    if (!(x >= lo && x <= hi))
      throw InvalidInput("scan_person: " + std::string(name) + " must be " + std::to_string(lo) + " .. " +
                         std::to_string(hi) + ", not " + std::to_string(x));
  };
  within(o.spacing, 0.5, 10, "spacing");
  within(o.noise, 0, 5, "noise");
  within(o.spikes, 0, 0.2, "spikes");
  within(o.holes, 0, 100, "holes");
  within(o.pose_deg, 0, 180, "pose_deg");
  within(o.landmark_noise, 0, 20, "landmark_noise");
  within(o.missing_landmarks, 0, 0.9, "missing_landmarks");
  within(o.unit, 1e-6, 1e6, "unit");
  within(o.field_of_view_deg, 40, 150, "field_of_view_deg");
}

/// A scan in the making: samples, their positions in the head frame, and which triangles are still there.
struct Draft {
  RangeSamples samples;
  Vertices V;
  std::vector<bool> keep;  ///< per triangle

  Vector3d corner(Eigen::Index f, int k) const { return V.row(samples.F(f, k)).transpose(); }
  Vector3d middle(Eigen::Index f) const { return (corner(f, 0) + corner(f, 1) + corner(f, 2)) / 3; }
};

/// A sensor on the cylinder sees no surface that it grazes, and none behind an edge.
void drop_grazing(Draft& d, double spacing) {
  for (Eigen::Index f = 0; f < d.samples.F.rows(); ++f) {
    const Vector3d a = d.corner(f, 0), b = d.corner(f, 1), c = d.corner(f, 2), n = (b - a).cross(c - a);
    Vector3d ray = (a + b + c) / 3 - Vector3d{0, 0, axis_z};
    ray.y() = 0;
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    if (n.dot(ray) < 0.17 * n.norm() * ray.norm() || longest > 5 * spacing) d.keep[static_cast<size_t>(f)] = false;
  }
}

/// The border wanders by some millimetres.
void fray_border(Draft& d, const ScannerOptions& o, const Landmarks& marks, Random& random) {
  const SmoothField coarse(random, 25, 70), fine(random, 5, 14);
  const double half_angle = o.field_of_view_deg * std::numbers::pi / 180;
  const double bottom = marks.at("menton").position.y() - random.uniform(14, 26);
  const double top = marks.at("trichion").position.y() + random.uniform(12, 36);
  for (Eigen::Index f = 0; f < d.samples.F.rows(); ++f) {
    const Vector3d p = d.middle(f);
    const double ragged = 4 * coarse(p) + 2 * fine(p);
    const double angle = std::abs(std::atan2(p.x(), p.z() - axis_z));
    // the lower border follows the jaw: higher at the sides
    const double lowest = bottom + 18 * std::pow(std::min(angle / 1.6, 1.0), 2);
    if (p.y() < lowest + ragged || p.y() > top + ragged || angle > half_angle - 0.07 + ragged / 95)
      d.keep[static_cast<size_t>(f)] = false;
  }
}

void punch_holes(Draft& d, const ScannerOptions& o, Random& random) {
  if (d.V.rows() == 0) return;
  for (int h = 0; h < o.holes; ++h) {
    const Vector3d centre = d.V.row(random.index(static_cast<int>(d.V.rows()))).transpose();
    const double radius = random.uniform(3, 12);
    const SmoothField rim(random, 6, 15);
    for (Eigen::Index f = 0; f < d.samples.F.rows(); ++f) {
      const double distance = (d.middle(f) - centre).norm();
      if (distance < 1.6 * radius && distance < radius * (1 + 0.2 * rim(d.middle(f))))
        d.keep[static_cast<size_t>(f)] = false;
    }
  }
}

/// Triangles of the largest connected piece, and of no other.
Faces largest_piece(const Draft& d) {
  Faces kept(std::count(d.keep.begin(), d.keep.end(), true), 3);
  Eigen::Index row = 0;
  for (Eigen::Index f = 0; f < d.samples.F.rows(); ++f)
    if (d.keep[static_cast<size_t>(f)]) kept.row(row++) = d.samples.F.row(f);
  const Components parts = connected_components(d.V.rows(), kept);
  std::vector<int> size(static_cast<size_t>(parts.count), 0);
  const auto label = [&](Eigen::Index f) {
    return static_cast<size_t>(parts.vertex_label[static_cast<size_t>(kept(f, 0))]);
  };
  for (Eigen::Index f = 0; f < kept.rows(); ++f) ++size[label(f)];
  const auto largest = static_cast<size_t>(std::max_element(size.begin(), size.end()) - size.begin());
  Faces result(kept.rows() ? size[largest] : 0, 3);
  row = 0;
  for (Eigen::Index f = 0; f < kept.rows(); ++f)
    if (label(f) == largest) result.row(row++) = kept.row(f);
  return result;
}

/// Takes away the triangles at vertices where the surface only touches itself; returns whether there were any.
bool drop_pinched(Draft& d, const Faces& F) {
  std::vector<std::pair<int, int>> half_edges;
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) half_edges.emplace_back(F(f, k), F(f, (k + 1) % 3));
  std::sort(half_edges.begin(), half_edges.end());
  std::vector<int> leaving(static_cast<size_t>(d.V.rows()), 0);
  for (const auto& [from, to] : half_edges)
    if (!std::binary_search(half_edges.begin(), half_edges.end(), std::pair{to, from}))
      ++leaving[static_cast<size_t>(from)];
  bool any = false;
  for (Eigen::Index f = 0; f < d.samples.F.rows(); ++f)
    for (int k = 0; k < 3; ++k)
      if (leaving[static_cast<size_t>(d.samples.F(f, k))] > 1) {
        d.keep[static_cast<size_t>(f)] = false;
        any = true;
      }
  return any;
}

/// Renumbers: only vertices in use stay, in their order. Returns the old index of each new vertex.
std::vector<int> compact(Eigen::Index vertex_count, Faces& F) {
  std::vector<int> renumbered(static_cast<size_t>(vertex_count), -1), old;
  for (Eigen::Index f = 0; f < F.rows(); ++f)
    for (int k = 0; k < 3; ++k) renumbered[static_cast<size_t>(F(f, k))] = 0;
  for (size_t v = 0; v < renumbered.size(); ++v)
    if (renumbered[v] == 0) {
      renumbered[v] = static_cast<int>(old.size());
      old.push_back(static_cast<int>(v));
    }
  for (Eigen::Index i = 0; i < F.size(); ++i) F.data()[i] = renumbered[static_cast<size_t>(F.data()[i])];
  return old;
}

Vertices vertex_normals(const Mesh& mesh) {
  Vertices N = Vertices::Zero(mesh.V.rows(), 3);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Vector3d a = mesh.V.row(mesh.F(f, 0)), b = mesh.V.row(mesh.F(f, 1)), c = mesh.V.row(mesh.F(f, 2));
    for (int k = 0; k < 3; ++k) N.row(mesh.F(f, k)) += (b - a).cross(c - a).transpose();
  }
  N.rowwise().normalize();
  return N;
}

/// Range noise and spikes along the normals; a little noise in the colours too.
void disturb(SyntheticScan& scan, const ScannerOptions& o, Random& random) {
  const SmoothField correlated(random, 7, 14);
  const Vertices N = vertex_normals(scan.mesh);
  scan.spike.assign(static_cast<size_t>(scan.mesh.V.rows()), false);
  for (Eigen::Index v = 0; v < scan.mesh.V.rows(); ++v) {
    const Vector3d p = scan.mesh.V.row(v).transpose();
    double offset = o.noise * (random.normal() + 0.5 * correlated(p));
    const double chance = random.uniform(), length = random.uniform(4, 20), side = random.uniform() < 0.5 ? -1 : 1;
    if (chance < o.spikes) {
      offset += side * length;
      scan.spike[static_cast<size_t>(v)] = true;
    }
    scan.mesh.V.row(v) += offset * N.row(v);
    if (o.noise > 0)
      scan.mesh.colours.row(v) = (scan.mesh.colours.row(v) * (1 + 0.015 * random.normal())).cwiseMin(1.0);
  }
}

Similarity draw_pose(const ScannerOptions& o, Random& random) {
  Similarity pose;
  const Vector3d axis = Vector3d{random.normal(), random.normal(), random.normal()}.normalized();
  const double angle = random.uniform() * o.pose_deg * std::numbers::pi / 180;
  const Vector3d shift{random.normal(), random.normal(), random.normal()};
  if (o.pose_deg > 0) {
    pose.R = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    pose.t = 15 * shift;
  }
  return pose;
}

Landmarks mark(const Landmarks& truth, const ScannerOptions& o, Random& random) {
  Landmarks marks;
  for (const auto& [name, landmark] : truth) {
    const Vector3d error =
        o.landmark_noise / std::sqrt(3.0) * Vector3d{random.normal(), random.normal(), random.normal()};
    const bool missing = random.uniform() < o.missing_landmarks;
    if (!missing) marks[name].position = o.unit * (landmark.position + error);
  }
  return marks;
}

}  // namespace

SyntheticScan scan_person(const ParametricFace& face, const SyntheticPerson& person, std::uint64_t seed,
                          std::uint64_t index, const ScannerOptions& o) {
  check(o);
  Random random = Random::stream(seed ^ 0x7363616eULL, index);
  SyntheticScan scan;
  scan.truth = face.mesh(person, 1);
  const Mesh& canonical = face.mean();

  RangeGridLayout layout;
  layout.axis_z = axis_z;
  layout.spacing = o.spacing;
  layout.half_angle = o.field_of_view_deg * std::numbers::pi / 180;
  const Landmarks marks = face.locate_landmarks(person);
  layout.bottom = marks.at("menton").position.y() - 45;
  layout.top = marks.at("vertex").position.y();
  layout.seed = random.bits();
  Draft draft{sample_outermost(scan.truth.V, scan.truth.F, layout), {}, {}};
  draft.V.resize(static_cast<Eigen::Index>(draft.samples.points.size()), 3);
  for (size_t i = 0; i < draft.samples.points.size(); ++i)
    draft.V.row(static_cast<Eigen::Index>(i)) =
        position(draft.samples.points[i], scan.truth.V, scan.truth.F).transpose();
  draft.keep.assign(static_cast<size_t>(draft.samples.F.rows()), true);
  drop_grazing(draft, o.spacing);
  fray_border(draft, o, marks, random);
  punch_holes(draft, o, random);

  do scan.mesh.F = largest_piece(draft);
  while (drop_pinched(draft, scan.mesh.F));
  const std::vector<int> old = compact(draft.V.rows(), scan.mesh.F);
  scan.mesh.V.resize(static_cast<Eigen::Index>(old.size()), 3);
  scan.mesh.colours.resize(scan.mesh.V.rows(), 3);
  scan.mesh.uv.resize(scan.mesh.V.rows(), 2);
  const SkinPainter paint(person.appearance);
  for (size_t v = 0; v < old.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    scan.source.push_back(draft.samples.points[static_cast<size_t>(old[v])]);
    scan.mesh.V.row(row) = draft.V.row(old[v]);
    const Eigen::Vector2d& place = draft.samples.place[static_cast<size_t>(old[v])];
    scan.mesh.uv.row(row) << 0.5 + 0.49 * place.x() / (layout.half_angle + 0.05),
        0.01 + 0.98 * (place.y() - layout.bottom) / (layout.top - layout.bottom + 5);
    scan.mesh.colours.row(row) = paint(position(scan.source.back(), canonical.V, canonical.F)).transpose();
  }
  disturb(scan, o, random);

  const Similarity pose = scan.scanner_from_head = draw_pose(o, random);
  scan.mesh.V = o.unit * pose.apply(scan.mesh.V);
  scan.truth.V = pose.apply(scan.truth.V);
  for (const auto& [name, landmark] : marks) scan.true_landmarks[name].position = pose * landmark.position;
  scan.landmarks = mark(scan.true_landmarks, o, random);
  return scan;
}

namespace {

/// Calls texel(x, y, barycentric) for the pixel centres in a triangle given in pixels, y down.
template <class Texel>
void for_each_texel(const std::array<Eigen::Vector2d, 3>& p, int size, const Texel& texel) {
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  const double area = cross(p[1] - p[0], p[2] - p[0]);
  if (std::abs(area) < 1e-12) return;
  const auto [left, right] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
  const auto [top, bottom] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
  const int x0 = std::max(0, static_cast<int>(left) - 1), x1 = std::min(size - 1, static_cast<int>(right) + 2);
  const int y0 = std::max(0, static_cast<int>(top) - 1), y1 = std::min(size - 1, static_cast<int>(bottom) + 2);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const Eigen::Vector2d c{x, y};
      const double b1 = cross(c - p[0], p[2] - p[0]) / area, b2 = cross(p[1] - p[0], c - p[0]) / area;
      // a pixel beyond the edge too, so that bilinear look-ups at a border find colour
      const double slack = -0.35;
      if (b1 < slack || b2 < slack || 1 - b1 - b2 < slack) continue;
      texel(x, y, Vector3d{1 - b1 - b2, b1, b2});
    }
}

}  // namespace

Image paint_texture(const ParametricFace& face, const SyntheticPerson& person, const SyntheticScan& scan, int size) {
  if (size < 64 || size > 8192)
    throw InvalidInput("paint_texture: size must be 64 .. 8192, not " + std::to_string(size));
  const SkinPainter paint(person.appearance);
  const Mesh& canonical = face.mean();
  Image image(size, size, 3, 128);
  for (Eigen::Index f = 0; f < scan.mesh.F.rows(); ++f) {
    std::array<Eigen::Vector2d, 3> at;
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) {
      const int v = scan.mesh.F(f, k);
      at[static_cast<size_t>(k)] = {scan.mesh.uv(v, 0) * size - 0.5, (1 - scan.mesh.uv(v, 1)) * size - 0.5};
      corners.col(k) = position(scan.source[static_cast<size_t>(v)], canonical.V, canonical.F);
    }
    for_each_texel(at, size, [&](int x, int y, const Vector3d& barycentric) {
      const Vector3d colour = paint(corners * barycentric);
      for (int k = 0; k < 3; ++k) image.pixel(x, y)[k] = srgb8_from_linear(colour[k]);
    });
  }
  return image;
}

}  // namespace facewright
