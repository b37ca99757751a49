// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/sample_index.h"

#include <fstream>
#include <iomanip>
#include <limits>
#include <set>
#include <sstream>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr int kVersion = 1;

}  // namespace

// Numbers in full, and the id last on its line, for it may hold blanks.
std::string to_text(const SampleIndex& index) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::setprecision(std::numeric_limits<double>::max_digits10);
  out << "facewright-samples " << kVersion << "\ncols " << index.cols << "\ngeneration " << index.generation
      << "\nslots " << index.slots << "\nproduct_rows " << index.product_rows << "\nsamples " << index.samples.size()
      << '\n';
  for (const IndexedSample& sample : index.samples) {
    out << sample.slot << ' ' << sample.mean_from_scan.s;
    for (const double value : sample.mean_from_scan.R.reshaped()) out << ' ' << value;
    for (const double value : sample.mean_from_scan.t) out << ' ' << value;
    out << ' ' << sample.id << '\n';
  }
  out << "end\n";
  return out.str();
}

SampleIndex read_index(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(path.string(), "cannot be opened");
  int number = 0;
  const auto expect = [&](bool ok, const std::string& what) {
    if (!ok) throw IoError(path.string(), number, what);
  };
  const auto line = [&] {
    std::string text;
    ++number;
    expect(static_cast<bool>(std::getline(in, text)), "the index ends too early: truncated?");
    std::istringstream fields(text);
    fields.imbue(std::locale::classic());
    return fields;
  };
  const auto count = [&](const std::string& name) {
    std::istringstream fields = line();
    std::string found;
    long long value = -1;
    expect(fields >> found >> value && found == name && value >= 0, "expected '" + name + "' and a number");
    return static_cast<Eigen::Index>(value);
  };
  const Eigen::Index version = count("facewright-samples");
  expect(version == kVersion,
         "version " + std::to_string(version) + " of a sample store; this program reads " + std::to_string(kVersion));
  SampleIndex index;
  index.cols = count("cols");
  expect(index.cols > 0, "there are no columns");
  index.generation = static_cast<int>(count("generation"));
  index.slots = count("slots");
  index.product_rows = count("product_rows");
  const Eigen::Index samples = count("samples");
  expect(index.product_rows <= index.slots && samples <= index.slots, "the counts contradict each other");
  std::set<std::string> ids;
  for (Eigen::Index i = 0; i < samples; ++i) {
    std::istringstream fields = line();
    IndexedSample sample;
    bool ok = static_cast<bool>(fields >> sample.slot >> sample.mean_from_scan.s);
    for (double& value : sample.mean_from_scan.R.reshaped()) ok = ok && fields >> value;
    for (double& value : sample.mean_from_scan.t) ok = ok && fields >> value;
    ok = ok && fields.get() == ' ' && std::getline(fields, sample.id) && !sample.id.empty();
    expect(ok, "expected a row, a transform of 13 numbers and an id");
    expect(sample.slot < index.slots && sample.slot > (i == 0 ? -1 : index.samples.back().slot),
           "row " + std::to_string(sample.slot) + " is out of order");
    expect(ids.insert(sample.id).second, "'" + sample.id + "' comes twice");
    index.samples.push_back(sample);
  }
  std::string end;
  line() >> end;
  expect(end == "end", "expected 'end'");
  return index;
}

}  // namespace facewright
