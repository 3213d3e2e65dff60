#include "problems/common/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdio>

namespace trueline {
namespace {

std::atomic<bool> on_the_line = false;  // an unfinished line is on the terminal

bool Shown(bool quiet) { return !quiet && isatty(STDERR_FILENO) != 0; }

}  // namespace

Progress::Progress(int total, const std::string& unit, bool quiet)
    : total_(total), unit_(unit), shown_(Shown(quiet)), start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (printed_) ClearProgress();
}

void ClearProgress() {
  if (on_the_line.exchange(false)) fmt::print(stderr, "\r{:60}\r", "");
}

void Progress::Done() {
  const std::lock_guard<std::mutex> lock(mutex_);
  Show(done_ + 1);
}

void Progress::Reached(int done) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Show(done);
}

void Progress::Show(int done) {
  done_ = done;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
  if (!shown_ || elapsed.count() < 2.0) return;
  printed_ = on_the_line = true;
  fmt::print(stderr, "\r{:<60}", Text(done_, total_, unit_, elapsed.count()));
  std::fflush(stderr);
}

std::string Progress::Text(int done, int total, const std::string& unit, double elapsed) {
  const double left = done > 0 ? elapsed * (total - done) / done : 0.0;
  const std::string time = left < 90.0 ? fmt::format("{:.0f} s", std::ceil(left))
                                       : fmt::format("{:.0f} min", std::ceil(left / 60.0));
  return fmt::format("{} of {} {}, {} left", done, total, unit, time);
}

void Announce(const std::string& what, bool quiet) {
  if (!Shown(quiet)) return;
  ClearProgress();
  fmt::print(stderr, "{} ...\n", what);
}

}  // namespace trueline
