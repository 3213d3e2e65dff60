// Rows of a blackbox session as messages, with quantities in known units.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/import/formats/blackbox_header.h"
#include "problems/import/formats/recording.h"

namespace trueline {

// A quantity in a known unit, made of the raw integer of another name.
struct BlackboxDerived {
  std::string raw, name, unit;
  double scale = 1.0, shift = 0.0;
};
std::vector<BlackboxDerived> DerivedBlackboxFields(const BlackboxHeader& header);

// Messages are rows of 64-bit numbers: the time of the last main frame (us), then the frame's
// fields. In main frames (`frame` I), gyro[k] (deg/s), accel[k] (g), throttle[k] (0 to 1), rotor[k]
// (rad/s) and battery (V) follow from the raw integers by the header's settings.
std::unique_ptr<MessageDecoder> MakeBlackboxDecoder(const BlackboxHeader& header, char frame);

}  // namespace trueline
