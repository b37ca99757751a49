// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/interop/mat_elements.h"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

constexpr std::uint32_t kDimensions = 5, kFlags = 6, kMatrix = 14, kCompressed = 15;      // types of elements
constexpr int kCell = 1, kStruct = 2, kObject = 3, kFirstNumeric = 6, kLastNumeric = 15;  // classes of arrays
constexpr int kDeepest = 16;  // structures within each other
constexpr size_t kBlock = 1 << 16;

struct Damaged {
  const char* what;
};

// Bytes one after the other.
class Source {
 public:
  virtual ~Source() = default;
  virtual void read(char* to, size_t bytes) = 0;  // throws Damaged
  virtual void skip(std::uint64_t bytes) = 0;
};

class FileSource : public Source {
 public:
  explicit FileSource(std::ifstream& in) : in_(in) {}
  void read(char* to, size_t bytes) override {
    if (!in_.read(to, static_cast<std::streamsize>(bytes))) throw Damaged{"is cut short or damaged"};
  }
  void skip(std::uint64_t bytes) override { in_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur); }

 private:
  std::ifstream& in_;
};

// What a compressed element of `packed` bytes unpacks to.
class PackedSource : public Source {
 public:
  PackedSource(std::ifstream& in, std::uint64_t packed) : in_(in), left_(packed), input_(kBlock), scratch_(kBlock) {
    if (inflateInit(&stream_) != Z_OK) throw Damaged{"cannot be unpacked"};
  }
  ~PackedSource() override { inflateEnd(&stream_); }
  PackedSource(const PackedSource&) = delete;
  PackedSource& operator=(const PackedSource&) = delete;

  void read(char* to, size_t bytes) override {
    stream_.next_out = reinterpret_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(bytes);
    while (stream_.avail_out > 0)
      if (!step()) throw Damaged{"has a variable that unpacks to less than it promises"};
  }
  void skip(std::uint64_t bytes) override {
    while (bytes > 0) {
      const size_t some = static_cast<size_t>(std::min<std::uint64_t>(bytes, kBlock));
      read(scratch_.data(), some);
      bytes -= some;
    }
  }
  // Unpacks what is left, up to its checksum.
  void finish() {
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(scratch_.data());
      stream_.avail_out = static_cast<uInt>(kBlock);
    } while (!ended_ && step());
    if (!ended_) throw Damaged{"has a variable that is cut short"};
  }

 private:
  // One call of inflate; false at the end.
  bool step() {
    if (ended_) return false;
    if (stream_.avail_in == 0 && left_ > 0) {
      const size_t some = static_cast<size_t>(std::min<std::uint64_t>(left_, kBlock));
      if (!in_.read(input_.data(), static_cast<std::streamsize>(some))) throw Damaged{"is cut short"};
      left_ -= some;
      stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
      stream_.avail_in = static_cast<uInt>(some);
    }
    const int result = inflate(&stream_, Z_NO_FLUSH);
    ended_ = result == Z_STREAM_END;
    if (result == Z_BUF_ERROR) return false;  // nothing left to unpack
    if (result != Z_OK && !ended_) throw Damaged{"has a variable whose compressed bytes are damaged"};
    return true;
  }

  std::ifstream& in_;
  std::uint64_t left_;
  std::vector<char> input_, scratch_;
  z_stream stream_{};
  bool ended_ = false;
};

// Type and length of an element; a small one holds its bytes in the tag itself.
struct Tag {
  std::uint32_t type = 0;
  std::uint64_t bytes = 0, padded = 0;  // of data, and with what fills up to 8
  char small[4] = {};
  bool is_small = false;
};

// Reads within one matrix element, and no farther.
class Matrix {
 public:
  Matrix(Source& source, std::uint64_t bytes) : source_(source), left_(bytes) {}

  std::uint64_t left() const { return left_; }
  void take(char* to, size_t bytes) {
    claim(bytes);
    source_.read(to, bytes);
  }
  void skip(std::uint64_t bytes) {
    claim(bytes);
    source_.skip(bytes);
  }
  void claim(std::uint64_t bytes) {
    if (bytes > left_) throw Damaged{"has a variable whose parts are longer than itself"};
    left_ -= bytes;
  }
  Source& source() { return source_; }

  Tag tag() {
    std::uint32_t words[2];
    take(reinterpret_cast<char*>(words), sizeof words);
    Tag t;
    t.is_small = words[0] >> 16 != 0;
    t.type = words[0] & 0xffff;
    t.bytes = t.is_small ? words[0] >> 16 : words[1];
    t.padded = t.is_small ? 0 : (t.bytes + 7) / 8 * 8;
    std::memcpy(t.small, &words[1], sizeof t.small);
    if (t.is_small && t.bytes > sizeof t.small) throw Damaged{"has a damaged variable"};
    if (t.type == kMatrix) t.padded = t.bytes;
    return t;
  }
  // The bytes of a short element.
  std::vector<char> data(const Tag& t, std::uint64_t most) {
    if (t.bytes > most) throw Damaged{"has a damaged variable"};
    if (t.is_small) return {t.small, t.small + t.bytes};
    std::vector<char> out(static_cast<size_t>(t.padded));
    take(out.data(), out.size());
    out.resize(static_cast<size_t>(t.bytes));
    return out;
  }

 private:
  Source& source_;
  std::uint64_t left_;
};

std::uint64_t size_of_type(std::uint32_t type) {
  switch (type) {
    case 1:
    case 2:
      return 1;
    case 3:
    case 4:
      return 2;
    case 5:
    case 6:
    case 7:
      return 4;
    case 9:
    case 12:
    case 13:
      return 8;
    default:
      throw Damaged{"has a variable of a kind of numbers that there is not"};
  }
}

// Of rows times columns and so on.
std::uint64_t product(const std::vector<char>& dimensions) {
  std::uint64_t items = 1;
  for (size_t i = 0; i + 4 <= dimensions.size(); i += 4) {
    std::int32_t d = 0;
    std::memcpy(&d, dimensions.data() + i, sizeof d);
    if (d < 0 || (d > 0 && items > (std::uint64_t{1} << 40) / static_cast<std::uint64_t>(d)))
      throw Damaged{"has a variable of impossible dimensions"};
    items *= static_cast<std::uint64_t>(d);
  }
  return items;
}

void check_matrix(Source& source, std::uint64_t bytes, int depth);

void check_numbers(Matrix& m, std::uint64_t items) {
  const Tag t = m.tag();
  if (t.bytes != items * size_of_type(t.type))
    throw Damaged{"has a variable with fewer numbers than its dimensions say"};
  m.skip(std::min(t.padded, m.left()));  // some writers leave the last one's padding out
}

void check_nested(Matrix& m, std::uint64_t count, int depth) {
  for (std::uint64_t i = 0; i < count; ++i) {
    const Tag t = m.tag();
    if (t.type != kMatrix) throw Damaged{"has a structure whose fields are damaged"};
    m.claim(t.bytes);
    check_matrix(m.source(), t.bytes, depth + 1);
  }
}

void check_matrix(Source& source, std::uint64_t bytes, int depth) {
  if (bytes == 0) return;  // an empty field
  if (depth > kDeepest) throw Damaged{"nests its structures too deeply"};
  Matrix m(source, bytes);
  const Tag flag_tag = m.tag();
  const std::vector<char> flags = m.data(flag_tag, 8);
  if (flag_tag.type != kFlags || flags.size() != 8) throw Damaged{"has a damaged variable"};
  const int kind = static_cast<unsigned char>(flags[0]);
  const bool complex = (flags[1] & 8) != 0;
  if (kind <= kLastNumeric) {  // others are opaque
    const Tag size_tag = m.tag();
    if (size_tag.type != kDimensions) throw Damaged{"has a damaged variable"};
    const std::uint64_t items = product(m.data(size_tag, 4 * 64));
    m.data(m.tag(), 4096);  // the name
    if (kind >= kFirstNumeric) {
      for (int part = 0; part < (complex ? 2 : 1); ++part) check_numbers(m, items);
    } else if (kind == kCell) {
      check_nested(m, items, depth);
    } else if (kind == kStruct || kind == kObject) {
      if (kind == kObject) m.data(m.tag(), 4096);
      const std::vector<char> length = m.data(m.tag(), 4);
      std::int32_t each = 0;
      if (length.size() == sizeof each) std::memcpy(&each, length.data(), sizeof each);
      const std::vector<char> names = m.data(m.tag(), 1 << 20);
      if (each < 1 || names.size() % static_cast<size_t>(each) != 0) throw Damaged{"has a damaged structure"};
      check_nested(m, items * (names.size() / static_cast<size_t>(each)), depth);
    }
  }
  m.skip(m.left());
}

// The elements of a level 5 file, behind its header.
void check_level5(std::ifstream& in, std::uint64_t size, std::uint64_t at) {
  while (at < size) {
    std::uint32_t tag[2] = {};  // type, bytes
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.read(reinterpret_cast<char*>(tag), sizeof tag)) break;
    if (tag[0] != kMatrix && tag[0] != kCompressed) throw Damaged{"has something between its variables"};
    at += sizeof tag + tag[1];
    if (at > size) break;
    if (tag[0] == kMatrix) {
      FileSource source(in);
      check_matrix(source, tag[1], 0);
    } else {
      PackedSource source(in, tag[1]);
      std::uint32_t inner[2] = {};
      source.read(reinterpret_cast<char*>(inner), sizeof inner);
      if (inner[0] != kMatrix) throw Damaged{"has a damaged variable"};
      check_matrix(source, inner[1], 0);
      source.finish();
    }
  }
  if (at != size) throw Damaged{"is cut short or damaged: its last variable does not end with the file"};
}

// Level 4 has no header: each variable is five numbers, its name, its values.
void check_level4(std::ifstream& in, std::uint64_t size) {
  constexpr std::uint64_t kBytesOf[] = {8, 4, 4, 2, 2, 1};  // of a number, by the third digit of the kind
  in.clear();
  for (std::uint64_t at = 0; at < size;) {
    std::int32_t head[5] = {};  // kind, rows, columns, whether complex, length of the name
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.read(reinterpret_cast<char*>(head), sizeof head)) throw Damaged{"is no MATLAB file, or is cut short"};
    const auto [kind, rows, columns, complex, name] = head;
    if (kind < 0 || kind > 52 || kind / 10 > 5 || kind % 10 > 2)
      throw Damaged{"is no MATLAB file that can be read; save it again with -v7"};  // or of another byte order
    if (rows < 0 || columns < 0 || complex < 0 || complex > 1 || name < 1 || name > 4096)
      throw Damaged{"has a damaged variable"};
    at += sizeof head + static_cast<std::uint64_t>(name);
    if (at > size) throw Damaged{"is cut short"};
    std::string text(static_cast<size_t>(name), ' ');
    if (!in.read(text.data(), name) || text.find('\0') == text.npos) throw Damaged{"has a variable without a name"};
    const std::uint64_t room = (size - at) / kBytesOf[kind / 10] / static_cast<std::uint64_t>(complex + 1);
    if (columns > 0 && static_cast<std::uint64_t>(rows) > room / static_cast<std::uint64_t>(columns))
      throw Damaged{"promises more numbers than the file can hold"};
    at += kBytesOf[kind / 10] * static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns) *
          static_cast<std::uint64_t>(complex + 1);
  }
}

}  // namespace

void check_mat_elements(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  char head[128] = {};
  const bool long_enough = static_cast<bool>(in.read(head, sizeof head));
  const std::uint64_t size = std::filesystem::file_size(path);
  try {
    if (long_enough && head[126] == 'I' && head[127] == 'M')
      check_level5(in, size, sizeof head);
    else if (long_enough && head[126] == 'M' && head[127] == 'I')
      throw Damaged{"was written by a machine of another byte order; save it again on this one"};
    else
      check_level4(in, size);
  } catch (const Damaged& damaged) {
    throw IoError(path.string(), damaged.what);
  }
}

}  // namespace facewright
