// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/building/sample_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw IoError(path, what + ": " + std::strerror(errno));
}

void sync_folder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

SampleFile::SampleFile(const std::filesystem::path& path, Mode mode) : path_(path.string()) {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC | (mode == Mode::create ? O_CREAT | O_TRUNC : 0), 0666);
  if (descriptor_ < 0) fail(path_, "cannot be opened");
}

SampleFile::SampleFile(SampleFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

SampleFile& SampleFile::operator=(SampleFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

SampleFile::~SampleFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void SampleFile::read(void* bytes, std::uint64_t count, std::uint64_t offset) const {
  for (char* at = static_cast<char*>(bytes); count > 0;) {
    const ssize_t got = ::pread(descriptor_, at, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(path_, "cannot be read");
    if (got == 0) throw IoError(path_, "is shorter than it should be: truncated?");
    at += got, offset += static_cast<std::uint64_t>(got), count -= static_cast<std::uint64_t>(got);
  }
}

void SampleFile::write(const void* bytes, std::uint64_t count, std::uint64_t offset) {
  for (const char* at = static_cast<const char*>(bytes); count > 0;) {
    const ssize_t put = ::pwrite(descriptor_, at, count, static_cast<off_t>(offset));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) fail(path_, "cannot be written");
    at += put, offset += static_cast<std::uint64_t>(put), count -= static_cast<std::uint64_t>(put);
  }
}

std::uint64_t SampleFile::size() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail(path_, "cannot be examined");
  return static_cast<std::uint64_t>(status.st_size);
}

void SampleFile::sync() {
  if (::fsync(descriptor_) != 0) fail(path_, "cannot be written");
}

bool SampleFile::lock_alone() { return ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0; }

void replace_file(const std::filesystem::path& path, std::string_view bytes) {
  const std::filesystem::path temporary = path.string() + ".part";
  {
    SampleFile file(temporary, SampleFile::Mode::create);
    file.write(bytes.data(), bytes.size(), 0);
    file.sync();
  }
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (error) throw IoError(path.string(), "cannot be replaced: " + error.message());
  sync_folder(path.parent_path());
}

}  // namespace facewright
