// What a stream's declaration says of a field of its samples. Reader, writer, importer and tables
// derive from the declarations in flight_log.h.
#pragma once

#include <array>

namespace trueline {

enum class FrameAxes { kNone, kEarth, kBody };

inline constexpr int kNoGate = -1;  // of a fix that no gate gave
inline constexpr int kMostId = 1'000'000'000;
inline constexpr double kLeastSigma = 1e-6;  // m; no detector is better, and weights stay finite

struct Field {
  const char* key;                          // in a column map; "": the stream's own keys
  std::array<const char*, 4> columns = {};  // of the CSV file; null after the last one
  const char* unit = "1";                   // SI; units.cc lists the units that it converts
  FrameAxes axes = FrameAxes::kNone;        // of a vector: an importer turns foreign axes to these
  bool is_sigma = false;                    // a standard deviation: kLeastSigma or more
};

inline constexpr Field kAttitudeField{"", {"qw", "qx", "qy", "qz"}};

// The file NAME.csv of a native log, and the key NAME under `streams` in a column map.
struct Stream {
  const char* name;
  Field value = {""};  // where the sample is one number, or channels (numbered from 1)
};

}  // namespace trueline
