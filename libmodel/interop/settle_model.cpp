// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <algorithm>
#include <cmath>

#include "libmodel/core/errors.h"
#include "libmodel/interop/foreign_geometry.h"
#include "libmodel/interop/foreign_model.h"
#include "libmodel/model/surface_points.h"

namespace facewright {
namespace {

constexpr double kSureWinding = 0.05;  // of outwardness; faces and heads have 0.4 to 0.95
constexpr double kOpenFace = 0.3;      // length of the mean normal above which a surface looks somewhere
constexpr double kLeastSpread = 0.3, kMostSpread = 30;  // mm, rms over vertices and people; published models: 2 to 8

std::string text(double x) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", x);
  return buffer;
}

// One model on its way; every step adds what it decided.
class Settlement {
 public:
  Settlement(ForeignModel model, const ImportOptions& options)
      : m_(std::move(model)), options_(options), decisions_(std::move(m_.notes)) {}

  ImportResult run() {
    crop();
    turn_axes();
    scale_units();
    turn_triangles();
    check_front();
    choose_values();
    MorphableModelParts p;
    p.shape = settled(std::move(m_.shape), "shape");
    if (!m_.colour.empty()) p.colour = settled_colours();
    if (m_.expression) p.expression = settled(std::move(*m_.expression), "expression");
    p.blendshapes = std::move(m_.blendshapes);
    if (!p.blendshapes.empty()) note("blendshapes: " + std::to_string(p.blendshapes.size()) + ", kept by name");
    p.uv = std::move(m_.uv);
    if (count_ < p.shape.vertex_count()) cut(p);
    for (const auto& [name, v] : m_.landmarks)
      if (v >= 0 && v < count_) p.landmarks[name] = {point_at_vertex(m_.F, v), v};
    p.levels = {{count_, m_.F}};
    std::string all;
    for (const std::string& d : decisions_) all += d + "\n";
    p.provenance = {{"imported_from", std::filesystem::path(m_.path).filename().string()},
                    {"import_format", m_.format},
                    {"import_decisions", all}};
    try {
      return {MorphableModel(std::move(p)), m_.format, decisions_};
    } catch (const InvalidInput& error) {
      fail(error.what());
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw IoError(m_.path, what); }
  void note(const std::string& decision) { decisions_.push_back(decision); }
  Vertices mean() const { return as_vertices(m_.shape.mean.head(3 * Eigen::Index{count_})); }

  void crop() {
    if (m_.shape.mean.size() == 0 || m_.shape.mean.size() % 3 != 0) fail("holds no shape");
    const int n = static_cast<int>(m_.shape.mean.size() / 3);
    count_ = options_.leading_vertices > 0 ? options_.leading_vertices : n;
    if (count_ > n) fail("has " + std::to_string(n) + " vertices, not the " + std::to_string(count_) + " asked for");
    if (!m_.shape.mean.allFinite() || !m_.shape.columns.allFinite() || !m_.shape.values.allFinite())
      fail("holds NaN or infinity in its shape");
    if (count_ == n) return;
    Faces kept(m_.F.rows(), 3);
    Eigen::Index rows = 0;
    for (Eigen::Index f = 0; f < m_.F.rows(); ++f)
      if (m_.F.row(f).maxCoeff() < count_) kept.row(rows++) = m_.F.row(f);
    m_.F = kept.topRows(rows);
    note("vertices: the first " + std::to_string(count_) + " of " + std::to_string(n) + " as asked, and the " +
         std::to_string(rows) + " triangles among them");
  }

  template <class Change>
  void change_lengths(Change change) {
    change(m_.shape);
    if (m_.expression) change(*m_.expression);
  }

  void turn_axes() {
    if (options_.axes == "auto") return;
    const Eigen::Matrix3d R = axes_rotation(options_.axes);
    change_lengths([&](ForeignModes& m) {
      rotate_points(m.mean, R);
      rotate_points(m.columns, R);
    });
    for (Blendshape& b : m_.blendshapes) rotate_points(b.displacement, R);
    note("axes: '" + options_.axes + "' of the file are x y z, as asked");
  }

  void scale_units() {
    const double height = face_height(mean());
    const auto millimetres = [&](const std::string& unit) { return text(height * millimetres_per(unit)) + " mm"; };
    const std::string found = plausible_unit(height);
    std::string unit = options_.units;
    if (unit != "auto") {
      note("units: " + unit + " as asked; the face is " + millimetres(unit) + " high" +
           (unit == found ? "" : ", which is not the height of a face or head"));
    } else if (found.empty()) {
      fail("the face is " + text(height) + " units high, which is no head's 120 to 350 mm in um, mm, cm or m; say " +
           "with --units which it is" + (m_.units.empty() ? "" : " (the format's is " + m_.units + ")") +
           ", or with --axes which axis is up");
    } else {
      unit = found;
      note("units: " + unit +
           (m_.units.empty()   ? ", found from the height of "
            : m_.units == unit ? " as the format defines; the face is "
                               : ", though the format's are " + m_.units + ": only so the face is ") +
           millimetres(unit) + (m_.units.empty() ? "" : " high"));
    }
    const double f = millimetres_per(unit);
    if (f == 1) return;
    note(unit + " to mm: lengths times " + text(f));
    change_lengths([&](ForeignModes& m) {
      m.mean *= f;
      if (m.scale == ModeScale::columns)
        m.columns *= f;
      else
        m.values *= m.scale == ModeScale::sigmas ? f : f * f;
    });
    value_factor_ = f;
    for (Blendshape& b : m_.blendshapes) b.displacement *= f;
  }

  void turn_triangles() {
    const double out = outwardness(mean(), m_.F);
    bool turn = options_.winding == "turn";
    if (options_.winding == "auto") {
      if (m_.F.rows() == 0) return note("triangles: there are none");
      if (std::abs(out) < kSureWinding)
        fail("its triangles point neither outward nor inward (" + text(out) +
             " of 1); choose with --winding keep or --winding turn" +
             (m_.inward ? " (the format's are inward)" : " (the format's are outward)"));
      turn = out < 0;
    }
    if (turn) {
      const Eigen::VectorXi second = m_.F.col(1);
      m_.F.col(1) = m_.F.col(2);
      m_.F.col(2) = second;
    }
    note(std::string(turn ? "triangles turned: clockwise seen from outside"
                          : "triangles kept: counter-clockwise seen from outside") +
         (options_.winding == "auto"
              ? (m_.inward == turn ? ", as the format defines" : ", unlike what the format defines")
              : ", as asked") +
         " (outward by " + text(turn ? -out : out) + " of 1)");
  }

  void check_front() {
    const Eigen::Vector3d n = mean_normal(mean(), m_.F);
    if (n.norm() < kOpenFace)
      return note("axes: a closed head; +y up and +z out of the face as the format defines, not checked");
    Eigen::Index axis = 0;
    n.cwiseAbs().maxCoeff(&axis);
    if (axis == 2 && n[2] > 0) return note("axes: the face looks along +z");
    const std::string seen = std::string(n[axis] > 0 ? "+" : "-") + "xyz"[axis];
    if (options_.axes != "auto") return note("axes: the face looks along " + seen + " after the turn asked for");
    fail("the face looks along " + seen +
         ", not +z; say with --axes which axes of the file are left, up and out of the " + "face, such as \"x z -y\"");
  }

  PcaModel settled(ForeignModes modes, const std::string& what) {
    const Eigen::VectorXd& values = modes.values;
    if (modes.scale != ModeScale::columns && modes.columns.cols() > 0 &&
        (values.size() != modes.columns.cols() || !(values.minCoeff() >= 0)))
      fail("has negative or missing variances of " + what);
    return settled_modes(std::move(modes), what, options_.keep_columns, decisions_);
  }

  // Whether the numbers beside the basis are variances or standard deviations: as asked, else as the format has them if
  // people then differ as people do.
  void choose_values() {
    ForeignModes& s = m_.shape;
    if (options_.values != "auto") return set_values();
    if (s.scale == ModeScale::columns || s.columns.cols() == 0) return;
    if (s.values.size() != s.columns.cols() || s.values.minCoeff() < 0) fail("has negative or missing variances");
    if (const double length = s.columns.col(0).norm(); std::abs(length - 1) > 0.01)
      fail("the first column of its basis has length " + text(length) +
           ", not 1; say with --values what stands beside " +
           "the basis: variance, sigma, or columns (each column is one standard deviation already)");
    const double n = static_cast<double>(s.mean.size()) / 3;
    const double of_sigmas =
        std::sqrt(s.values.cwiseAbs2().sum() / n) * (s.scale == ModeScale::sigmas ? 1 : 1 / value_factor_);
    const double of_variances =
        std::sqrt(s.values.sum() / n) * (s.scale == ModeScale::variances ? 1 : std::sqrt(value_factor_));
    const auto plausible = [](double x) { return x >= kLeastSpread && x <= kMostSpread; };
    const bool sigmas = s.scale == ModeScale::sigmas;
    const double declared = sigmas ? of_sigmas : of_variances, other = sigmas ? of_variances : of_sigmas;
    if (!plausible(declared) && plausible(other))
      fail("as " + std::string(sigmas ? "standard deviations" : "variances") +
           ", what stands beside its basis would move a " + "vertex by " + text(declared) + " mm, as " +
           (sigmas ? "variances" : "standard deviations") + " by " + text(other) +
           " mm; say with --values variance or --values sigma which it is");
    note("people differ by " + text(declared) + " mm (rms over vertices)");
  }

  void set_values() {
    ForeignModes& s = m_.shape;
    const ModeScale asked = options_.values == "variance" ? ModeScale::variances
                            : options_.values == "sigma"  ? ModeScale::sigmas
                                                          : ModeScale::columns;
    const auto reread = [&](ForeignModes& m, double f) {
      if (m.scale == asked || m.columns.cols() == 0) return;
      if (m.scale == ModeScale::columns) fail("has nothing beside its basis that could be a " + options_.values);
      if (asked == ModeScale::columns)
        m.columns *= f;
      else
        m.values *= asked == ModeScale::sigmas ? 1 / f : f;
      m.scale = asked;
    };
    reread(s, value_factor_);
    if (m_.expression) reread(*m_.expression, value_factor_);
    if (!m_.colour.empty()) reread(m_.colour, 1);
    note("values beside the basis: " + options_.values + " as asked");
  }

  PcaModel settled_colours() {
    ForeignModes& c = m_.colour;
    if (!c.mean.allFinite() || !c.columns.allFinite() || !c.values.allFinite())
      fail("holds NaN or infinity in its colours");
    if (m_.colour_range == 1 && c.mean.maxCoeff() > 2) m_.colour_range = 255;
    if (m_.colour_range != 1) {
      note("colours: 0.." + text(m_.colour_range) + " to 0..1");
      const double f = 1 / m_.colour_range;
      c.mean *= f;
      if (c.scale == ModeScale::columns)
        c.columns *= f;
      else
        c.values *= c.scale == ModeScale::sigmas ? f : f * f;
    }
    const bool srgb = options_.colours == "auto" ? m_.colour_space == ColourSpace::srgb : options_.colours == "srgb";
    PcaModel pca = settled(std::move(c), "colour");
    if (srgb) return linearised_colours(pca, decisions_);
    note("colours: taken as linear RGB" + std::string(options_.colours == "auto" ? "" : " as asked"));
    return pca;
  }

  void cut(MorphableModelParts& p) {
    const bool keep = options_.keep_columns;
    if (!keep) note("bases: the rows that are left made orthonormal, other coefficients than the whole model's");
    const auto leading = [&](const PcaModel& pca) {
      return pca.mode_count() > 0 && !keep ? pca.leading_rows(count_).orthonormalised() : pca.leading_rows(count_);
    };
    p.shape = leading(p.shape);
    if (!p.colour.empty()) p.colour = leading(p.colour);
    if (p.expression) p.expression = leading(*p.expression);
    for (Blendshape& b : p.blendshapes) b.displacement = b.displacement.head(3 * Eigen::Index{count_}).eval();
    if (p.uv.rows() > 0) p.uv = p.uv.topRows(count_).eval();
  }

  ForeignModel m_;
  const ImportOptions& options_;
  std::vector<std::string> decisions_;
  int count_ = 0;
  double value_factor_ = 1;  // millimetres per unit of the file
};

}  // namespace

Faces zero_based(Faces F, int n, int base, ForeignModel& model) {
  if (F.rows() == 0) return F;
  const int low = F.minCoeff(), high = F.maxCoeff();
  const int found = low == 0 ? 0 : high == n ? 1 : base;
  if (low < 0 || high - found >= n)
    throw IoError(model.path, "has triangles of vertices " + std::to_string(low) + " to " + std::to_string(high) +
                                  "; there are " + std::to_string(n) + " vertices");
  model.notes.push_back("triangles count from " + std::to_string(found) +
                        (found == base ? ", as the format defines" : ", unlike what the format defines"));
  if (found == 1) F.array() -= 1;
  return F;
}

ForeignModel foreign_model(const MorphableModel& model, const std::string& path, const std::string& format) {
  const auto modes = [](const PcaModel& pca) {
    return pca.orthonormal ? ForeignModes{pca.mean, pca.basis, pca.variances, ModeScale::variances}
                           : ForeignModes{pca.mean, pca.rescaled_basis(), {}, ModeScale::columns};
  };
  if (model.level_count() != 1) throw IoError(path, "has several levels; it is a Facewright model already");
  ForeignModel m;
  m.path = path;
  m.format = format;
  m.shape = modes(model.shape());
  if (model.has_colour()) m.colour = modes(model.colour());
  if (model.expression()) m.expression = modes(*model.expression());
  m.blendshapes = model.blendshapes();
  m.F = model.faces();
  m.uv = model.uv();
  for (const auto& [name, mark] : model.landmarks()) m.landmarks[name] = mark.vertex;
  m.units = "mm";
  return m;
}

ImportResult settle(ForeignModel model, const ImportOptions& options) {
  return Settlement(std::move(model), options).run();
}

}  // namespace facewright
