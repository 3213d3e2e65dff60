// Progress on a terminal; no output elsewhere.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace trueline {

// "12 of 100 flights, 40 s left" on one line of a terminal, once the work takes over two seconds.
// Silent if standard error is not a terminal, or if `quiet`. Safe to call from threads.
class Progress {
 public:
  // unit: what is counted, in the plural.
  Progress(int total, const std::string& unit, bool quiet);
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Done();             // one more
  void Reached(int done);  // so many

  // The text for `done` of `total` after `elapsed` seconds.
  static std::string Text(int done, int total, const std::string& unit, double elapsed);

 private:
  void Show(int done);

  const int total_;
  const std::string unit_;
  const bool shown_;
  const std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
  int done_ = 0;
  bool printed_ = false;
};

// Clears the line that a Progress has printed, before another message; Done() prints it again.
void ClearProgress();

// "WHAT ..." on a line of its own, for work in a few long steps; silent as above.
void Announce(const std::string& what, bool quiet);

}  // namespace trueline
