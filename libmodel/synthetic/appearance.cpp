// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/synthetic/appearance.h"

#include "libmodel/synthetic/mean_head_internal.h"
#include "libmodel/synthetic/smooth_noise.h"

namespace facewright {
namespace {

using Eigen::Vector3d;
using mean_head::gauss;
using mean_head::smooth_step;

Vector3d mix(const Vector3d& a, const Vector3d& b, double t) { return a + std::clamp(t, 0.0, 1.0) * (b - a); }
Vector3d tint(const Vector3d& c, double r, double g, double b) { return c.cwiseProduct(Vector3d{r, g, b}); }

double cloud(const Vector3d& p, double size, std::uint64_t seed) {
  return 0.6 * lattice_noise(p / size, seed) + 0.4 * lattice_noise(p / (0.45 * size), seed + 1);
}

/// Hairs as streaks: noise drawn out along `along` (unit, frontal plane).
double streaks(const Vector3d& p, const Eigen::Vector2d& along, double width, std::uint64_t seed) {
  const Eigen::Vector2d q = p.head<2>(), across{-along.y(), along.x()};
  const Vector3d s{q.dot(along) / (7 * width), q.dot(across) / width, p.z() / 30};
  return 0.65 * lattice_noise(s, seed) + 0.35 * lattice_noise(1.9 * s, seed + 7);
}

}  // namespace

struct SkinPainter::State {
  Appearance a;
  double pigment(const Vector3d& p) const;
  Vector3d skin(const Vector3d& p) const;
  Vector3d add_lips(const Vector3d& colour, const Vector3d& p) const;
  Vector3d add_brows(const Vector3d& colour, const Vector3d& p) const;
  Vector3d add_hair(const Vector3d& colour, const Vector3d& p) const;
  Vector3d add_eyes(const Vector3d& colour, const Vector3d& p) const;
  Vector3d eyeball(double x, double y) const;
};

SkinPainter::SkinPainter(const Appearance& appearance) : state_(std::make_unique<State>(State{appearance})) {}
SkinPainter::~SkinPainter() = default;

double SkinPainter::State::pigment(const Vector3d& p) const {
  const double uneven = a.mottling * (0.34 * (cloud(p, 32, a.seed) - 0.5) + 0.16 * (cloud(p, 6, a.seed + 3) - 0.5));
  return 1 + uneven + 0.05 * (lattice_noise(p / 1.1, a.seed + 5) - 0.5);
}

Vector3d SkinPainter::State::skin(const Vector3d& p) const {
  const double x = std::abs(p.x()), y = p.y(), z = p.z();
  Vector3d c = a.skin * pigment(p);
  const double cheek = gauss(std::hypot((x - 42) / 20, (y + 30) / 17)) * smooth_step(5, 25, z);
  const double tip = gauss(std::hypot(x / 13, (y + 37) / 10)) * smooth_step(50, 58, z);
  const double ear =
      smooth_step(66, 72, x) * smooth_step(-38, -46, z) * smooth_step(-55, -44, y) * smooth_step(26, 18, y);
  const double red =
      a.blush * (0.75 * cheek + 0.8 * tip + 0.6 * ear + 0.25 * gauss(std::hypot(x / 16, (y + 102) / 12)));
  c = mix(c, tint(c, 1.08, 0.74, 0.72), red);
  // thinner, bluish skin about the eyes; creases and nostrils lie in shadow
  const double socket = gauss(std::hypot((x - 28) / 15, (y + 4) / 12)) * smooth_step(10, 25, z);
  c = mix(c, tint(c, 0.80, 0.72, 0.76), 0.45 * socket);
  const double nostril =
      gauss(std::hypot((x - 6.9) / 3.4, (y + 45.0) / 2.6)) * smooth_step(68.5, 65.5, z) * smooth_step(52, 56, z);
  c = mix(c, tint(c, 0.12, 0.07, 0.06), 1.2 * nostril);
  const double beard = smooth_step(-30, -46, y - 0.35 * std::max(0.0, x - 34)) * smooth_step(-128, -108, y) *
                       smooth_step(-24, -8, z) * (1 - 0.8 * gauss(std::hypot(x / 9, (y + 44) / 5)));
  const double stubble = a.beard * beard * (0.35 + 0.65 * lattice_noise(p / 0.9, a.seed + 11));
  c = mix(c, mix(a.hair, tint(c, 0.55, 0.6, 0.68), 0.6), 0.75 * stubble);
  const double spots = smooth_step(0.70, 0.80, lattice_noise(p / 2.3, a.seed + 13)) *
                       gauss(std::hypot(x / 62, (y + 16) / 34)) * smooth_step(0, 20, z);
  return mix(c, tint(c, 0.62, 0.46, 0.36), 0.8 * a.freckles * spots);
}

Vector3d SkinPainter::State::add_lips(const Vector3d& c, const Vector3d& p) const {
  using namespace mean_head;
  const double x = std::abs(p.x()), y = p.y();
  if (x > mouth_half_width + 3 || y < -84 || y > -56 || p.z() < 20) return c;
  const double inside = std::min(upper_vermilion(x) - y, y - lower_vermilion(x));
  const double end = smooth_step(mouth_half_width + 0.4, mouth_half_width - 2.5, x);
  const double lip = smooth_step(-0.5, 0.9, inside) * end;
  const double folds = 1 + 0.10 * (lattice_noise({p.x() / 1.3, y / 6, 0.5}, a.seed + 17) - 0.5);
  const Vector3d vermilion = tint(c, 1.02 - 0.10 * a.lips, 0.72 - 0.30 * a.lips, 0.78 - 0.26 * a.lips) * folds;
  const double seam = gauss((y - lip_seam(x)) / 0.75) * smooth_step(mouth_half_width + 1.5, mouth_half_width - 1, x);
  const Vector3d painted = mix(c, vermilion, lip);
  return mix(painted, tint(painted, 0.30, 0.20, 0.20), 0.85 * seam);
}

Vector3d SkinPainter::State::add_brows(const Vector3d& c, const Vector3d& p) const {
  using namespace mean_head;
  const double x = std::abs(p.x()), y = p.y();
  if (x < 4 || x > 60 || y < 6 || y > 36 || p.z() < 10) return c;
  const double t = (x - brow_inner_x) / (brow_outer_x - brow_inner_x);
  const double off = (y - brow_line(x)) / brow_half_thickness(x);
  const double ends = smooth_step(-0.07, 0.10, t) * smooth_step(1.06, 0.86, t);
  // hairs rise at the inner end and lie along the brow further out
  const double lean = 1.05 - 1.35 * std::clamp(t, 0.0, 1.0);
  const Vector3d q{x, y, p.z() + (p.x() < 0 ? 400 : 0)};
  const double hair = streaks(q, {std::cos(lean), std::sin(lean)}, 0.75, a.seed + 19);
  const double cover = smooth_step(1.25, 0.45, std::abs(off)) * ends;
  return mix(c, a.hair, a.brows * cover * smooth_step(0.62 - 0.40 * cover, 0.80 - 0.40 * cover, hair + 0.12));
}

Vector3d SkinPainter::State::add_hair(const Vector3d& c, const Vector3d& p) const {
  const double x = std::abs(p.x()), y = p.y(), z = p.z();
  // hairline: trichion, receding at the temples, down before the ear, behind it to the nape
  const double hairline = 68 - 0.0012 * x * x * (1 - smooth_step(40, 60, x)) + 5 * gauss((x - 36) / 12);
  const double top =
      smooth_step(-2.5, 2.5, y - hairline + (cloud(p, 7, a.seed + 23) - 0.5) * 6 + 30 * smooth_step(22, -14, z));
  const double side = smooth_step(12, -4, z - 0.20 * (y - 20) + (cloud(p, 6, a.seed + 29) - 0.5) * 6) *
                      smooth_step(-2, 22, y + 0.5 * std::max(0.0, -z - 30));
  const double burn =
      smooth_step(-18, -24, z) * smooth_step(-44, -34, z) * smooth_step(-16, -4, y) * smooth_step(60, 64, x);
  const double nape = smooth_step(-66, -92, z + 0.35 * (y + 40)) * smooth_step(-76, -58, y);
  const bool near_ear = x > 60 && z < -30 && z > -100 && y > -60 && y < 34;
  const double ear = near_ear ? smooth_step(3.0, 0.8, mean_head::ear_distance(p)) : 0;
  const double cover = std::max(std::max(top, side), std::max(burn, nape)) * (1 - ear);
  const double strands = 0.55 + 0.45 * lattice_noise({p.x() / 1.2, y / 4.0, z / 1.6}, a.seed + 31);
  return mix(c, a.hair * (0.6 + 0.8 * strands), a.scalp_hair * cover * (0.75 + 0.25 * strands));
}

Vector3d SkinPainter::State::eyeball(double x, double y) const {
  using namespace mean_head;
  const double r = std::hypot(x - eye_centre.x(), y - 0.2);
  const double angle = std::atan2(y, x - eye_centre.x());
  const Vector3d white = Vector3d{0.70, 0.66, 0.63} * (0.80 + 0.20 * smooth_step(-0.2, 2.6, -eye_opening(x, y)));
  const double fibres = 0.75 + 0.5 * lattice_noise({5 * std::cos(angle), 5 * std::sin(angle), r / 3}, a.seed + 37);
  Vector3d iris = a.iris * fibres * (1.15 - 0.45 * smooth_step(3.8, 5.9, r));
  iris = mix(iris, Vector3d{0.008, 0.007, 0.007}, smooth_step(2.3, 1.9, r));
  return mix(iris, white, smooth_step(5.5, 6.2, r)) * (1 - 0.45 * smooth_step(2.2, 0.2, upper_lid(x) - y));
}

Vector3d SkinPainter::State::add_eyes(const Vector3d& c, const Vector3d& p) const {
  using namespace mean_head;
  const Vector3d q{std::abs(p.x()), p.y(), p.z()};
  if (q.x() < 10 || q.x() > 56 || std::abs(q.y()) > 16 || q.z() < 15) return c;
  const double opening = eye_opening(q.x(), q.y());
  const double along = smooth_step(en_x + 1, en_x + 6, q.x()) * smooth_step(ex_x + 4, ex_x - 1, q.x());
  const double crease =
      gauss((q.y() - lid_crease(q.x())) / 0.9) * smooth_step(15, 20, q.x()) * smooth_step(49, 43, q.x());
  Vector3d colour = mix(c, tint(c, 0.66, 0.55, 0.52), 0.6 * crease);
  // the lash line is strong above, faint below, strongest outwards
  const bool above = q.y() > canthal_line(q.x());
  const double lash = gauss((opening - (above ? 0.5 : 0.3)) / (above ? 0.95 : 0.6)) * along * (above ? 0.92 : 0.40);
  const double ball = (q - eye_centre).norm() < eye_radius + 1.35 ? smooth_step(-0.15, -0.75, opening) : 0;
  const double pink = smooth_step(0.2, -0.6, opening);
  colour = mix(colour, tint(a.skin, 0.85, 0.45, 0.42), 0.8 * pink);
  colour = mix(colour, eyeball(q.x(), q.y()), ball * smooth_step(en_x + 2.2, en_x + 4.2, q.x()));
  return mix(colour, 0.5 * a.hair + Vector3d{0.006, 0.004, 0.003}, lash);
}

Vector3d SkinPainter::operator()(const Vector3d& p) const {
  Vector3d c = state_->skin(p);
  c = state_->add_lips(c, p);
  c = state_->add_brows(c, p);
  c = state_->add_hair(c, p);
  c = state_->add_eyes(c, p);
  return c.cwiseMax(0).cwiseMin(1);
}

Appearance draw_appearance(Random& random, double dimorphism) {
  Appearance a;
  // from dark to light: one melanin axis with a little of undertone [jablonski2000 gives the spread; the ends are ours]
  const double light = std::pow(random.uniform(), 0.8), warm = random.normal();
  const Vector3d dark{0.085, 0.042, 0.024}, tan{0.36, 0.19, 0.105}, fair{0.68, 0.45, 0.35};
  a.skin = light < 0.5 ? mix(dark, tan, 2 * light) : mix(tan, fair, 2 * light - 1);
  a.skin = tint(a.skin, 1 + 0.03 * warm, 1, 1 - 0.06 * warm);
  const double blond = light > 0.55 ? std::pow(random.uniform(), 1.6) * (light - 0.55) / 0.45 : 0,
               red = random.uniform();
  a.hair = mix({0.012, 0.008, 0.006}, {0.22, 0.13, 0.055}, blond);
  if (light > 0.7 && red > 0.88) a.hair = {0.20, 0.065, 0.02};
  const double pale_eye = light > 0.6 ? random.uniform() : 0.15 * random.uniform(), hue = random.uniform();
  const Vector3d brown{0.055, 0.026, 0.012}, hazel{0.15, 0.10, 0.035}, blue{0.13, 0.22, 0.34}, grey{0.18, 0.22, 0.22};
  a.iris = pale_eye < 0.5 ? mix(brown, hazel, 2 * pale_eye)
                          : (hue < 0.6 ? mix(hazel, blue, 2 * pale_eye - 0.6) : mix(hazel, grey, 2 * pale_eye - 0.6));
  a.lips = 0.25 + 0.6 * random.uniform() - 0.1 * dimorphism;
  a.blush = (0.25 + 0.7 * random.uniform()) * (0.4 + 0.6 * light);
  a.mottling = 0.25 + 0.5 * random.uniform();
  a.freckles = light > 0.6 && random.uniform() > 0.65 ? random.uniform(0.3, 1) : 0;
  a.beard = dimorphism > 0.15 ? std::clamp(random.uniform(-0.1, 1.0), 0.0, 0.9) : 0;
  a.brows = std::clamp(0.72 + 0.12 * random.normal() + 0.1 * dimorphism, 0.4, 0.95);
  a.scalp_hair = random.uniform() < 0.08 ? 0.15 : 0.88;
  a.seed = random.bits();
  return a;
}

}  // namespace facewright
