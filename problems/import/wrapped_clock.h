// Counters of 16 or 32 bits that start again from zero while a log goes on.
#pragma once

#include <cstddef>
#include <string>

#include "problems/common/time.h"

namespace trueline {

class WrappedClock {
 public:
  // The time that `stamp` means, after those given before. A step back is a wrap where the counter
  // was near its end and is near zero; a restart at another time is none.
  TimeNs Undo(TimeNs stamp);

  // "the counter of 32 bits in us wraps once, after 4294.966 s"; empty where it does not.
  std::string Text() const;

 private:
  std::size_t count_ = 0;
  TimeNs first_ = 0, last_ = 0;  // last_: with the wraps undone
  TimeNs period_ = 0;            // of the counter; 0 before it has wrapped
  TimeNs wrapped_at_ = 0;
  std::int64_t epoch_ = 0, most_ = 0;
  const char* counter_ = "";
};

}  // namespace trueline
