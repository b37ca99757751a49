// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/guarded_call.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <fstream>
#include <new>
#include <utility>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

using Clock = std::chrono::steady_clock;

// The last byte of an answer: whole, or why there is none.
constexpr char kDone = 'd', kRefused = 'r', kNoMemory = 'm';
constexpr int kPatience = 6;  // waits so many times the processor's share: other programs run too

struct Pipe {
  Pipe() {
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw SolverError(std::string("no pipe: ") + std::strerror(errno));
  }
  ~Pipe() { close_end(0), close_end(1); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_end(size_t i) {
    if (ends[i] >= 0) ::close(std::exchange(ends[i], -1));
  }
  std::array<int, 2> ends = {-1, -1};
};

void limit(int resource, std::uint64_t value) {
  const rlimit both{value, value};
  ::setrlimit(static_cast<__rlimit_resource_t>(resource), &both);
}

// What the process has mapped already; a sanitizer reserves terabytes.
std::uint64_t mapped_bytes() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void send(int to, const char* data, size_t size) {
  while (size > 0) {
    const ssize_t n = ::write(to, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) ::_exit(1);
    data += n, size -= static_cast<size_t>(n);
  }
}

[[noreturn]] void work_as_copy(const std::function<std::string()>& work, const GuardLimits& limits,
                               std::uint64_t mapped, int to) {
  for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTERM, SIGINT, SIGPIPE}) ::signal(fault, SIG_DFL);
  if (const int null = ::open("/dev/null", O_WRONLY); null >= 0) ::dup2(null, STDERR_FILENO);  // a library's last words
  const auto own = static_cast<unsigned>(to);  // a pipe of another thread's copy must end with that copy
  if (own > 3) ::close_range(3, own - 1, 0);
  ::close_range(own + 1, ~0U, 0);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<std::uint64_t>(limits.cpu_seconds));
  if (mapped > 0) limit(RLIMIT_AS, mapped + limits.bytes);
  std::string answer;
  try {
    answer = work();
    answer += kDone;
  } catch (const std::bad_alloc&) {
    answer = kNoMemory;
  } catch (const std::exception& error) {
    answer = error.what();
    answer += kRefused;
  } catch (...) {
    ::_exit(1);
  }
  send(to, answer.data(), answer.size());
  ::_exit(0);
}

// All that comes until the other end closes, or the time is over.
std::pair<std::string, bool> receive(int from, Clock::time_point end) {
  std::string bytes;
  std::array<char, 1 << 16> buffer;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd ready{from, POLLIN, 0};
    const int events = left > 0 ? ::poll(&ready, 1, static_cast<int>(left)) : 0;
    if (events < 0 && errno == EINTR) continue;
    if (events <= 0) return {std::move(bytes), false};
    const ssize_t n = ::read(from, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return {std::move(bytes), true};
    bytes.append(buffer.data(), static_cast<size_t>(n));
  }
}

}  // namespace

std::string guarded_call(const std::function<std::string()>& work, const GuardLimits& limits) {
  const std::uint64_t mapped = mapped_bytes();
  Pipe pipe;
  const pid_t copy = ::fork();
  if (copy < 0) throw SolverError(std::string("no second process: ") + std::strerror(errno));
  if (copy == 0) work_as_copy(work, limits, mapped, pipe.ends[1]);
  pipe.close_end(1);
  auto [answer, in_time] = receive(pipe.ends[0], Clock::now() + std::chrono::seconds(kPatience * limits.cpu_seconds));
  if (!in_time) ::kill(copy, SIGKILL);
  int status = 0;
  while (::waitpid(copy, &status, 0) < 0 && errno == EINTR) {
  }
  const std::string seconds = std::to_string(limits.cpu_seconds) + " s";
  if (!in_time) throw InvalidInput("took longer than " + std::to_string(kPatience) + " times " + seconds);
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
    throw InvalidInput("took longer than " + seconds);
  const char end = answer.empty() ? '\0' : answer.back();
  if (end == kNoMemory) throw InvalidInput("needs more memory than " + std::to_string(limits.bytes >> 20) + " MB");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || (end != kDone && end != kRefused))
    throw InvalidInput("crashed");
  answer.pop_back();
  if (end == kRefused) throw InvalidInput(answer);
  return std::move(answer);
}

}  // namespace facewright
