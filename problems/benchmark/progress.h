#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace trueline {

// "12 of 100 flights, 40 s left" on one line of a terminal, once the work takes over two seconds.
// Silent where standard error is no terminal, or when told so. Safe to call from threads.
class Progress {
 public:
  Progress(int total, bool quiet);
  ~Progress();  // clears the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Done();

  // The text for `done` of `total` after `elapsed` seconds.
  static std::string Text(int done, int total, double elapsed);

 private:
  const int total_;
  const bool shown_;
  const std::chrono::steady_clock::time_point start_;
  std::mutex mutex_;
  int done_ = 0;
  bool printed_ = false;
};

}  // namespace trueline
