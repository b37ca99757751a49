// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/zip_archive.h"

#define STBI_NO_STDIO
#include <stb/stb_image.h>

#include <array>
#include <limits>

#include "libmodel/core/errors.h"
#include "libmodel/interop/byte_reader.h"
#include "libmodel/io/atomic_file.h"

namespace facewright {
namespace {

constexpr std::uint32_t kLocalHeader = 0x04034b50, kDirectoryEntry = 0x02014b50, kEndRecord = 0x06054b50;
constexpr size_t kEndSize = 22;             // bytes of the record that ends an archive without comment
constexpr std::uint64_t kBestRatio = 1032;  // of deflate

std::uint32_t crc32(const std::string& bytes) {
  static const auto table = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      t[i] = i;
      for (int k = 0; k < 8; ++k) t[i] = t[i] & 1 ? 0xedb88320u ^ (t[i] >> 1) : t[i] >> 1;
    }
    return t;
  }();
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) crc = table[(crc ^ static_cast<unsigned char>(c)) & 0xff] ^ (crc >> 8);
  return crc ^ 0xffffffffu;
}

void describe(ByteWriter& out, const std::string& name, const std::string& content, std::uint32_t crc) {
  out.value(std::uint16_t{20});                       // needs version 2.0
  out.value(std::uint16_t{0});                        // flags
  out.value(std::uint16_t{0});                        // stored
  out.value(std::uint16_t{0});                        // time
  out.value(std::uint16_t{(0 << 9) | (1 << 5) | 1});  // date: 1 January 1980, so that equal content is equal bytes
  out.value(crc);
  out.value(static_cast<std::uint32_t>(content.size()));
  out.value(static_cast<std::uint32_t>(content.size()));
  out.value(static_cast<std::uint16_t>(name.size()));
  out.value(std::uint16_t{0});  // extra field
}

struct Member {
  std::string name;
  std::uint16_t flags = 0, method = 0;
  std::uint32_t crc = 0, packed = 0, size = 0, offset = 0;
};

Member read_entry(ByteReader& in) {
  if (in.value<std::uint32_t>() != kDirectoryEntry) in.fail("has a damaged directory");
  Member m;
  in.text(4);  // versions
  m.flags = in.value<std::uint16_t>();
  m.method = in.value<std::uint16_t>();
  in.text(4);  // time, date
  m.crc = in.value<std::uint32_t>();
  m.packed = in.value<std::uint32_t>();
  m.size = in.value<std::uint32_t>();
  const auto name = in.value<std::uint16_t>(), extra = in.value<std::uint16_t>(), comment = in.value<std::uint16_t>();
  in.text(8);  // disk, attributes
  m.offset = in.value<std::uint32_t>();
  m.name = in.text(name);
  in.text(extra);
  in.text(comment);
  return m;
}

std::string inflated(const std::string& packed, const Member& m, const ByteReader& in) {
  constexpr std::uint64_t kMost = std::numeric_limits<int>::max();
  if (m.size > kMost || packed.size() > kMost - 8 || m.size > kBestRatio * (packed.size() + 1))
    in.fail("member '" + m.name + "' cannot unpack to the " + std::to_string(m.size) + " bytes it promises");
  std::string content(m.size, '\0');
  const std::string padded = packed + std::string(8, '\0');  // the decoder looks a few bytes ahead
  const int size = stbi_zlib_decode_noheader_buffer(content.data(), static_cast<int>(m.size), padded.data(),
                                                    static_cast<int>(padded.size()));
  if (size < 0 || static_cast<std::uint32_t>(size) != m.size) in.fail("member '" + m.name + "' is damaged");
  return content;
}

std::string content_of(const Member& m, ByteReader& in) {
  const auto fail = [&](const std::string& what) { in.fail("member '" + m.name + "' " + what); };
  if (m.flags & 1) fail("is encrypted");
  if (m.method != 0 && m.method != 8) fail("is compressed in an unknown way; save it with numpy.savez");
  if (m.size == 0xffffffffu || m.packed == 0xffffffffu) fail("is larger than 4 GB");
  in.seek(m.offset);
  if (in.value<std::uint32_t>() != kLocalHeader) fail("is not where the directory says");
  in.text(22);
  const auto name = in.value<std::uint16_t>(), extra = in.value<std::uint16_t>();
  if (in.text(name) != m.name) fail("has another name than the directory says");
  in.text(extra);
  std::string content = in.text(m.packed);
  if (m.method == 8) content = inflated(content, m, in);
  if (content.size() != m.size || crc32(content) != m.crc) fail("is damaged: its checksum does not match");
  return content;
}

}  // namespace

void ZipWriter::add(const std::string& name, const std::string& content) {
  if (content.size() > 0xfffffff0u || out_.size() + content.size() > 0xfffffff0u)
    throw InvalidInput("npz: '" + name + "' makes the archive larger than 4 GB");
  const auto offset = static_cast<std::uint32_t>(out_.size());
  const std::uint32_t crc = crc32(content);
  out_.value(kLocalHeader);
  describe(out_, name, content, crc);
  out_.text(name);
  out_.text(content);
  directory_.value(kDirectoryEntry);
  directory_.value(std::uint16_t{20});  // made by version 2.0
  describe(directory_, name, content, crc);
  for (int i = 0; i < 3; ++i) directory_.value(std::uint16_t{0});  // comment, disk, internal attributes
  directory_.value(std::uint32_t{0});                              // external attributes
  directory_.value(offset);
  directory_.text(name);
  ++count_;
}

std::string ZipWriter::finish() {
  const auto offset = static_cast<std::uint32_t>(out_.size()), size = static_cast<std::uint32_t>(directory_.size());
  out_.text(directory_.bytes());
  out_.value(kEndRecord);
  out_.value(std::uint32_t{0});  // disks
  out_.value(count_);
  out_.value(count_);
  out_.value(size);
  out_.value(offset);
  out_.value(std::uint16_t{0});  // comment
  return out_.take();
}

std::map<std::string, std::string> read_zip(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  ByteReader in(bytes, path.string());
  if (bytes.size() < kEndSize) in.fail("is no zip archive, or is cut short");
  in.seek(bytes.size() - kEndSize);
  if (in.value<std::uint32_t>() != kEndRecord) in.fail("is no zip archive, or is cut short");
  in.text(6);  // disks
  const auto count = in.value<std::uint16_t>();
  in.text(4);  // size of the directory
  size_t entry = in.value<std::uint32_t>();
  std::uint64_t total = 0;
  std::map<std::string, std::string> members;
  for (int i = 0; i < count; ++i) {
    in.seek(entry);
    const Member m = read_entry(in);
    entry = in.position();
    if (m.name.empty() || m.name.find_first_of("/\\:") != m.name.npos || m.name.front() == '.')
      in.fail("has a member '" + m.name + "', which is no plain name; such archives are refused");
    if (members.count(m.name)) in.fail("has two members '" + m.name + "'");
    total += m.packed;  // members that overlap would multiply what is in the file
    if (total > bytes.size()) in.fail("promises more than it holds");
    members[m.name] = content_of(m, in);
  }
  return members;
}

}  // namespace facewright
