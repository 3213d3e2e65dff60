// Encodings and predictors of Betaflight blackbox frames ("Blackbox Internals").
#pragma once

#include <cstdint>
#include <vector>

#include "problems/import/formats/blackbox_header.h"
#include "problems/import/formats/bytes.h"

namespace trueline {

using BlackboxValues = std::vector<std::int64_t>;

// What predictors refer to.
struct BlackboxHistory {
  const BlackboxValues* previous = nullptr;   // main frames before
  const BlackboxValues* previous2 = nullptr;  // and before that
  std::uint32_t skipped = 0;                  // iterations not logged since the last main frame
  std::int64_t home[2] = {0, 0};
  std::int64_t main_time = 0;  // us, of the last main frame
};

// The numbers of the frame at the cursor, after its letter. The cursor's ok() turns false where the
// data end first.
void DecodeBlackboxFrame(const BlackboxHeader& header, char frame, const BlackboxHistory& history,
                         ByteCursor* cursor, BlackboxValues* values);

std::uint32_t ReadBlackboxUnsigned(ByteCursor* cursor);  // 7 bits a byte, low first
std::int32_t ReadBlackboxSigned(ByteCursor* cursor);     // the same in zigzag

}  // namespace trueline
