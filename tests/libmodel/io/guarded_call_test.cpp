// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "libmodel/io/guarded_call.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <thread>
#include <vector>

#include "libmodel/core/errors.h"

namespace facewright {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(GuardedCall, ReturnsWhatTheWorkMadeWhateverItsBytesAndSize) {
  EXPECT_EQ(guarded_call([] { return std::string(); }), "");
  EXPECT_EQ(guarded_call([] { return std::string("a\0b", 3); }), std::string("a\0b", 3));
  const std::string large(5'000'000, 'x');
  EXPECT_EQ(guarded_call([&] { return large; }), large);
}

TEST(GuardedCall, RefusesWithTheWordsOfTheWork) {
  EXPECT_THAT([] { guarded_call([]() -> std::string { throw IoError("a.stl", "is damaged"); }); },
              ThrowsMessage<InvalidInput>("a.stl: is damaged"));
}

TEST(GuardedCall, WhateverEndsTheCopyIsAnErrorHere) {
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL})
    EXPECT_THAT([&] { guarded_call([&]() -> std::string { return std::raise(signal), ""; }); },
                ThrowsMessage<InvalidInput>("crashed"));
  EXPECT_THAT([] { guarded_call([]() -> std::string { ::_exit(0); }); }, ThrowsMessage<InvalidInput>("crashed"));
  EXPECT_THAT([] { guarded_call([]() -> std::string { throw 7; }); }, ThrowsMessage<InvalidInput>("crashed"));
}

TEST(GuardedCall, EndsWhatRunsOn) {
  GuardLimits limits;
  limits.cpu_seconds = 1;
  const auto forever = []() -> std::string {
    for (std::atomic<unsigned> i = 0;; ++i) {
    }
  };
  EXPECT_THAT([&] { guarded_call(forever, limits); }, ThrowsMessage<InvalidInput>(HasSubstr("took longer than")));
}

TEST(GuardedCall, EndsWhatSleeps) {
  GuardLimits limits;
  limits.cpu_seconds = 1;
  const auto asleep = []() -> std::string { return ::sleep(1000), ""; };
  EXPECT_THAT([&] { guarded_call(asleep, limits); }, ThrowsMessage<InvalidInput>(HasSubstr("took longer than")));
}

TEST(GuardedCall, MemoryHasAnEnd) {
  GuardLimits limits;
  limits.bytes = std::uint64_t{64} << 20;
  const auto greedy = []() -> std::string {
    std::vector<std::string> all;
    for (int i = 0; i < 1000; ++i) all.emplace_back(size_t{1} << 20, 'x');
    return all.back();
  };
  EXPECT_THROW(guarded_call(greedy, limits), InvalidInput);
}

TEST(GuardedCall, ManyThreadsMayCallAtOnce) {
  std::vector<std::thread> threads;
  std::vector<int> good(4, 0);
  for (size_t t = 0; t < good.size(); ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 20; ++i) {
        const std::string text(static_cast<size_t>(1000 * i + 1), static_cast<char>('a' + static_cast<int>(t)));
        good[t] += guarded_call([&] { return std::string(text); }) == text;
      }
    });
  for (std::thread& t : threads) t.join();
  EXPECT_THAT(good, ::testing::Each(20));
}

}  // namespace
}  // namespace facewright
