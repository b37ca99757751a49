// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/model_card.h"

#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "pipelines/json_text.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNotStated = "not stated";

struct AgeClass {
  const char* name;
  double below;  // years
};
constexpr std::array<AgeClass, 5> kAgeClasses = {
    {{"0-19", 20}, {"20-29", 30}, {"30-44", 45}, {"45-59", 60}, {"60+", 1000}}};

const char* age_class(const std::optional<double>& age) {
  if (!age) return kNotStated;
  for (const AgeClass& c : kAgeClasses)
    if (*age < c.below) return c.name;
  return kNotStated;
}

struct People {
  std::map<std::string, int> groups, expressions;  // expressions count scans, the rest people
  std::vector<std::pair<std::string, int>> ages;   // in order
  int people = 0;
};

// A person counts once, by the first scan that states something.
People count_people(const std::vector<ManifestEntry>& scans) {
  std::map<std::string, ManifestEntry> of;
  People result;
  for (const ManifestEntry& scan : scans) {
    ManifestEntry& person = of[scan.subject];
    if (person.group.empty()) person.group = scan.group;
    if (!person.age) person.age = scan.age;
    ++result.expressions[scan.expression];
  }
  std::map<std::string, int> ages;
  for (const auto& [name, person] : of) {
    ++result.groups[person.group.empty() ? kNotStated : person.group];
    ++ages[age_class(person.age)];
  }
  for (const AgeClass& c : kAgeClasses)
    if (ages.count(c.name)) result.ages.emplace_back(c.name, ages[c.name]);
  if (ages.count(kNotStated)) result.ages.emplace_back(kNotStated, ages[kNotStated]);
  result.people = static_cast<int>(of.size());
  return result;
}

// Which colours are no measurements.
Json filled_colours(const ModelCardInput& input) {
  const FillUnseenSummary& f = input.fill;
  Json j = {{"share", f.filled_share},
            {"vertices_nobody_saw", f.never_seen},
            {"modes", f.modes},
            {"noise", f.noise},
            {"uncertain_share", f.uncertain_share},
            {"held_out_rms", f.held_out.filled},
            {"held_out_rms_of_mean", f.held_out.mean},
            {"converged", f.converged}};
  for (size_t s = 0; s < f.sample_shares.size() && s < input.coloured.size(); ++s)
    j["scans"][input.coloured[s]] = f.sample_shares[s];
  return j;
}

Json gains_of(const ModelCardInput& input) {
  Json j;
  for (Eigen::Index s = 0; s < input.gains.rows() && s < static_cast<Eigen::Index>(input.coloured.size()); ++s)
    j[input.coloured[static_cast<size_t>(s)]] = {input.gains(s, 0), input.gains(s, 1), input.gains(s, 2)};
  return j;
}

Json card(const MorphableModel& model, const ModelCardInput& input) {
  const People people = count_people(input.scans);
  Json j;
  j["people"] = people.people;
  j["scans"] = input.scans.size();
  j["manifest"] = input.has_manifest;
  j["groups"] = people.groups;
  for (const auto& [name, count] : people.ages) j["ages"][name] = count;
  j["expressions"] = people.expressions;
  j["left_out"] = input.left_out;
  j["terms"] = input.terms.empty() ? kNotStated : input.terms;
  for (int l = 0; l < model.level_count(); ++l)
    j["levels"].push_back({{"vertices", model.vertex_count(l)}, {"triangles", model.faces(l).rows()}});
  const auto part = [](const PcaModel& pca, double total) {
    return Json{{"modes", pca.mode_count()}, {"variance_kept", total > 0 ? pca.variances.sum() / total : 0}};
  };
  j["shape"] = part(model.shape(), input.shape_variance);
  if (model.has_colour()) j["colour"] = part(model.colour(), input.colour_variance);
  if (!input.coloured.empty()) j["colour"]["scans"] = input.coloured.size();
  if (!input.fill.sample_shares.empty()) j["filled_colours"] = filled_colours(input);
  if (input.gains.rows() > 0) j["colour_gains"] = gains_of(input);
  if (model.expression()) j["expression_modes"] = model.expression()->mode_count();
  for (const Blendshape& b : model.blendshapes()) j["blendshapes"].push_back(b.name);
  j["units"] = "mm";
  j["axes"] = "+x the subject's left, +y up, +z out of the face";
  j["colour_space"] = "linear RGB, sRGB primaries, 0 to 1";
  j["coefficients"] = "standard deviations, N(0, 1) over the scans";
  return j;
}

std::string cell(std::string text) {
  for (size_t at = 0; (at = text.find('|', at)) != text.npos; at += 2) text.replace(at, 1, "\\|");
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  return text;
}

template <class Counts>
std::string table(const std::string& what, const std::string& unit, const Counts& counts) {
  std::string text = "\n| " + what + " | " + unit + " |\n|---|---|\n";
  for (const auto& [name, count] : counts) text += "| " + cell(name) + " | " + std::to_string(count) + " |\n";
  return text;
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100 * share);
  return text;
}

std::string statistics(const Json& j) {
  std::string text = "\n## The numbers\n\n";
  for (const char* part : {"shape", "colour"})
    if (j.contains(part))
      text += std::string("- ") + part + ": " + std::to_string(j[part]["modes"].get<int>()) + " modes, " +
              percent(j[part]["variance_kept"].get<double>()) + " of the variance\n";
  if (j.contains("filled_colours"))
    text +=
        "- colours filled in, because no camera saw them well: " + percent(j["filled_colours"]["share"].get<double>()) +
        "; the model card's JSON has each scan's share\n";
  if (j.contains("colour_gains")) text += "- colours were balanced: each scan divided by gains towards the mean\n";
  if (j.contains("expression_modes"))
    text += "- expression: " + std::to_string(j["expression_modes"].get<int>()) + " modes\n";
  if (j.contains("blendshapes")) {
    text += "- blendshapes:";
    for (const auto& name : j["blendshapes"]) text += " " + name.get<std::string>() + ",";
    text.back() = '\n';
  }
  text += "- levels:";
  for (const auto& level : j["levels"]) text += " " + std::to_string(level["vertices"].get<int>()) + ",";
  text.back() = ' ';
  text += "vertices; a coarser level is the first vertices of the finer ones\n";
  for (const char* key : {"units", "axes", "colour_space", "coefficients"})
    text += std::string("- ") + (key == std::string("colour_space") ? "colours" : key) + ": " +
            j[key].get<std::string>() + "\n";
  return text;
}

constexpr const char* kUse = R"(
## Use and limits

For research and production of 3D faces: fitting images and scans, synthesis, statistics of shape.

- The model knows the people above. Faces unlike them, by origin, age, or expression, are fitted towards them.
- Groups and ages are those the manifest states; nobody verified them.
- Colours hold the light of the recording: they are not albedo unless the scanner took care of that.
- Coefficients describe a person. Where the law protects biometric data, they are such data.
- Not meant to identify people, or to judge anybody by their face.
)";

}  // namespace

std::string model_card_json(const MorphableModel& model, const ModelCardInput& input) {
  return json_text(card(model, input), 1) + "\n";
}

std::string model_card_markdown(const MorphableModel& model, const ModelCardInput& input) {
  const People people = count_people(input.scans);
  const Json j = card(model, input);
  std::string text = "# Model card\n\n" + std::to_string(people.people) + " people, " +
                     std::to_string(input.scans.size()) + " scans.\n\n**Terms:** " + j["terms"].get<std::string>() +
                     "\n\n## People\n";
  if (input.has_manifest) {
    text += table("group", "people", people.groups) + table("age, years", "people", people.ages) +
            table("expression", "scans", people.expressions);
  } else {
    text += "\nNothing is stated about them: the scans came without a manifest.\n";
  }
  text += "\n## Left out\n\n";
  if (input.left_out.empty()) text += "No scan.\n";
  for (const auto& [id, reason] : input.left_out) text += "- " + id + ": " + cell(reason) + "\n";
  return text + statistics(j) + kUse;
}

}  // namespace facewright
