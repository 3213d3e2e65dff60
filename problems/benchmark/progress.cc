#include "problems/benchmark/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace trueline {

Progress::Progress(int total, bool quiet)
    : total_(total),
      shown_(!quiet && isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (printed_) fmt::print(stderr, "\r{:60}\r", "");
}

void Progress::Done() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++done_;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
  if (!shown_ || elapsed.count() < 2.0) return;
  printed_ = true;
  fmt::print(stderr, "\r{:<60}", Text(done_, total_, elapsed.count()));
  std::fflush(stderr);
}

std::string Progress::Text(int done, int total, double elapsed) {
  const double left = done > 0 ? elapsed * (total - done) / done : 0.0;
  const std::string time = left < 90.0 ? fmt::format("{:.0f} s", std::ceil(left))
                                       : fmt::format("{:.0f} min", std::ceil(left / 60.0));
  return fmt::format("{} of {} flights, {} left", done, total, time);
}

}  // namespace trueline
