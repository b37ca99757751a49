// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/ply_header.h"

#include <array>
#include <limits>
#include <utility>

#include "libmodel/io/text_scanner.h"

namespace facewright {
namespace {

PlyType parse_type(std::string_view name, const TextScanner& scan) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 16> names = {{{"char", PlyType::int8},
                                                                                  {"int8", PlyType::int8},
                                                                                  {"uchar", PlyType::uint8},
                                                                                  {"uint8", PlyType::uint8},
                                                                                  {"short", PlyType::int16},
                                                                                  {"int16", PlyType::int16},
                                                                                  {"ushort", PlyType::uint16},
                                                                                  {"uint16", PlyType::uint16},
                                                                                  {"int", PlyType::int32},
                                                                                  {"int32", PlyType::int32},
                                                                                  {"uint", PlyType::uint32},
                                                                                  {"uint32", PlyType::uint32},
                                                                                  {"float", PlyType::float32},
                                                                                  {"float32", PlyType::float32},
                                                                                  {"double", PlyType::float64},
                                                                                  {"float64", PlyType::float64}}};
  for (const auto& [text, type] : names)
    if (text == name) return type;
  scan.fail("PLY header: unknown type '" + std::string(name) + "'");
}

PlyEncoding parse_encoding(std::string_view name, const TextScanner& scan) {
  if (name == "ascii") return PlyEncoding::ascii;
  if (name == "binary_little_endian") return PlyEncoding::little_endian;
  if (name == "binary_big_endian") return PlyEncoding::big_endian;
  scan.fail("PLY header: unknown format '" + std::string(name) + "'");
}

PlyElement parse_element(TextScanner& scan) {
  PlyElement element;
  element.name = scan.token();
  if (element.name.empty() || !scan.more_on_line()) scan.fail("PLY header: expected 'element NAME COUNT'");
  element.count = scan.integer();
  if (element.count < 0 || element.count > std::numeric_limits<int>::max())
    scan.fail("PLY header: " + std::to_string(element.count) + " of '" + element.name + "' is out of range");
  return element;
}

PlyProperty parse_property(TextScanner& scan) {
  PlyProperty property;
  std::string_view type = scan.token();
  if (type == "list") {
    property.is_list = true;
    property.count_type = parse_type(scan.token(), scan);
    if (property.count_type == PlyType::float32 || property.count_type == PlyType::float64)
      scan.fail("PLY header: a list's count must be a whole number");
    type = scan.token();
  }
  property.type = parse_type(type, scan);
  property.name = scan.token();
  if (property.name.empty()) scan.fail("PLY header: expected a property name");
  return property;
}

/// The fewest bytes one item can take: in text, one character and one separator per value.
std::int64_t least_size(const PlyElement& element, PlyEncoding encoding) {
  std::int64_t size = 0;
  for (const PlyProperty& p : element.properties)
    size += encoding == PlyEncoding::ascii ? 2 : static_cast<std::int64_t>(size_of(p.is_list ? p.count_type : p.type));
  return size;
}

void check_size(const PlyHeader& header, size_t body, const TextScanner& scan) {
  std::int64_t needed = header.encoding == PlyEncoding::ascii ? -1 : 0;  // no separator after the last value
  for (const PlyElement& e : header.elements) needed += e.count * least_size(e, header.encoding);
  if (needed > static_cast<std::int64_t>(body))
    scan.fail("PLY: the header promises at least " + std::to_string(needed) + " bytes, the file holds " +
              std::to_string(body) + " (truncated?)");
}

}  // namespace

size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      return 8;
  }
  return 0;
}

PlyHeader parse_ply_header(std::string_view bytes, const std::string& path) {
  TextScanner scan(bytes, path);
  if (scan.token() != "ply") scan.fail("not a PLY file (expected 'ply' in the first line)");
  PlyHeader header;
  bool has_format = false;
  for (scan.next_line(); !scan.at_end(); scan.next_line()) {
    const std::string_view keyword = scan.token();
    if (keyword == "format")
      header.encoding = parse_encoding(scan.token(), scan), has_format = true;
    else if (keyword == "element")
      header.elements.push_back(parse_element(scan));
    else if (keyword == "property" && header.elements.empty())
      scan.fail("PLY header: property before any element");
    else if (keyword == "property")
      header.elements.back().properties.push_back(parse_property(scan));
    else if (keyword == "end_header") {
      scan.next_line();
      if (!has_format) scan.fail("PLY header: no format line");
      header.body_offset = bytes.size() - scan.remaining();
      header.body_line = scan.line();
      check_size(header, scan.remaining(), scan);
      return header;
    } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      scan.fail("PLY header: unknown keyword '" + std::string(keyword.substr(0, 40)) + "'");
    }
  }
  scan.fail("PLY header: no end_header");
}

}  // namespace facewright
