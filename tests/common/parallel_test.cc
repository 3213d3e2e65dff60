// Loops on several threads: every index once, on no more threads than asked for.
#include "problems/common/parallel.h"

#include <gtest/gtest.h>

#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace trueline::testing_parallel {
namespace {

constexpr int kCount = 1000, kRun = 10;

// The threads that a loop of short bodies works on.
std::set<std::thread::id> ThreadsOfRuns(int threads) {
  std::vector<int> calls(kCount, 0);
  std::set<std::thread::id> ids;
  std::mutex mutex;
  ParallelRuns(
      kCount, kRun,
      [&](int i) {
        ++calls[i];
        const std::lock_guard<std::mutex> lock(mutex);
        ids.insert(std::this_thread::get_id());
      },
      threads);
  EXPECT_EQ(calls, std::vector<int>(kCount, 1));
  return ids;
}

TEST(ParallelRuns, OneThreadIsTheCallers) {
  EXPECT_EQ(ThreadsOfRuns(1), std::set<std::thread::id>{std::this_thread::get_id()});
}

TEST(ParallelRuns, UsesNoMoreThreadsThanStated) {
  EXPECT_LE(ThreadsOfRuns(2).size(), 2U);
  EXPECT_LE(ThreadsOfRuns(0).size(), static_cast<std::size_t>(CoresFor(0)));
}

TEST(ParallelRuns, StaysOnTheThreadOfAnOuterLoop) {
  ParallelFor(4, 2, [](int) {
    EXPECT_EQ(ThreadsOfRuns(8), std::set<std::thread::id>{std::this_thread::get_id()});
  });
}

}  // namespace
}  // namespace trueline::testing_parallel
