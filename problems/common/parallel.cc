#include "problems/common/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace trueline {
namespace {

thread_local bool is_worker = false;

}  // namespace

int CoresFor(int threads) {
  return threads > 0 ? threads
                     : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

int FreeCores() { return is_worker ? 1 : CoresFor(0); }

void ParallelFor(int count, int threads, const std::function<void(int)>& body) {
  threads = CoresFor(threads);
  const bool one_core = threads == 1;
  threads = std::min(threads, count);
  std::atomic<int> next{0};
  std::exception_ptr first_error;
  std::mutex error_mutex;
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) {
      try {
        body(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(error_mutex);
        if (!first_error) first_error = std::current_exception();
      }
    }
  };
  if (threads <= 1) {
    const bool was_worker = std::exchange(is_worker, is_worker || one_core);
    work();
    is_worker = was_worker;
  } else {
    std::vector<std::jthread> pool;
    pool.reserve(static_cast<std::size_t>(threads));
    for (int i = 0; i < threads; ++i) {
      pool.emplace_back([&] {
        is_worker = true;
        work();
      });
    }
    pool.clear();  // joins
  }
  if (first_error) std::rethrow_exception(first_error);
}

void ParallelRuns(int count, int run, const std::function<void(int)>& body, int threads) {
  ParallelFor((count + run - 1) / run, is_worker ? 1 : threads, [&](int k) {
    for (int i = k * run; i < std::min(count, (k + 1) * run); ++i) body(i);
  });
}

}  // namespace trueline
