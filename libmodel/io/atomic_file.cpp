// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/atomic_file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

namespace fs = std::filesystem;

/// Closes on scope exit.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw IoError(path.string(), what + ": " + std::strerror(errno));
}

fs::path temporary_beside(const fs::path& path) {
  static std::atomic<unsigned> counter{0};  // only makes names unique within the process
  std::string name = path.filename().string();
  name.insert(name.begin(), '.');
  name += '.' + std::to_string(::getpid()) + '.' + std::to_string(counter++) + ".tmp";
  return path.parent_path() / name;
}

// The process that wrote this temporary file; 0 for any other file.
long writer_of(const std::string& name) {
  // .NAME.PROCESS.NUMBER.tmp
  if (name.size() < 2 || name.front() != '.' || !name.ends_with(".tmp")) return 0;
  const std::string rest = name.substr(0, name.size() - 4);
  const size_t number = rest.rfind('.');
  const size_t process = number == rest.npos || number == 0 ? rest.npos : rest.rfind('.', number - 1);
  if (process == rest.npos || process == 0) return 0;
  long id = 0, count = 0;
  const auto read = [&rest](size_t first, size_t last, long* value) {
    const auto [end, error] = std::from_chars(rest.data() + first, rest.data() + last, *value);
    return error == std::errc() && end == rest.data() + last;
  };
  return read(process + 1, number, &id) && read(number + 1, rest.size(), &count) && id > 0 ? id : 0;
}

void write_all(int fd, std::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, "cannot write");
    bytes.remove_prefix(static_cast<size_t>(n));
  }
}

void write_and_sync(const fs::path& temporary, std::string_view bytes) {
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.get() < 0) fail(temporary, "cannot create");
  write_all(file.get(), bytes, temporary);
  if (::fsync(file.get()) != 0 && errno != EINVAL) fail(temporary, "cannot flush to disk");
  if (!file.close()) fail(temporary, "cannot close");
}

}  // namespace

std::string read_file(const fs::path& path) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) fail(path, "cannot open");
  struct stat info {};
  if (::fstat(file.get(), &info) != 0) fail(path, "cannot stat");
  if (S_ISDIR(info.st_mode)) throw IoError(path.string(), "expected a file, but this is a folder");
  std::string bytes(static_cast<size_t>(info.st_size), '\0');
  size_t done = 0;
  for (;;) {
    char more[4096];  // of pipes, and files that grow meanwhile; without moving what is there already
    const bool full = done == bytes.size();
    const ssize_t n =
        full ? ::read(file.get(), more, sizeof more) : ::read(file.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path, "cannot read");
    if (n == 0) break;
    if (full) bytes.append(more, static_cast<size_t>(n));
    done += static_cast<size_t>(n);
  }
  bytes.resize(done);
  return bytes;
}

void write_file(const fs::path& path, std::string_view bytes) {
  if (path.filename().empty()) throw IoError(path.string(), "expected a file name");
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) throw IoError(path.string(), "cannot create the folder: " + error.message());
  const fs::path temporary = temporary_beside(path);
  try {
    write_and_sync(temporary, bytes);
    fs::rename(temporary, path, error);
    if (error) throw IoError(path.string(), "cannot rename the finished file: " + error.message());
  } catch (...) {
    fs::remove(temporary, error);
    throw;
  }
}

bool write_file_if_changed(const fs::path& path, std::string_view bytes) {
  std::error_code error;
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) == bytes.size() && read_file(path) == bytes)
    return false;
  write_file(path, bytes);
  return true;
}

int remove_abandoned_temporaries(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> abandoned;
  for (fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && at != end; at.increment(error)) {
    const long writer = writer_of(at->path().filename().string());
    if (writer > 0 && at->is_regular_file(error) && ::kill(static_cast<pid_t>(writer), 0) != 0 && errno == ESRCH)
      abandoned.push_back(at->path());
  }
  for (const fs::path& file : abandoned) fs::remove(file, error);
  return static_cast<int>(abandoned.size());
}

}  // namespace facewright
