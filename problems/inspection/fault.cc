#include "problems/inspection/fault.h"

#include <array>
#include <cmath>

#include "problems/inspection/clear.h"

namespace trueline {

const char* NameOf(Level level) {
  constexpr std::array<const char*, 4> kNames = {"fatal", "biases", "widens", "note"};
  return kNames[static_cast<std::size_t>(level)];
}

namespace fault {

bool Always(const Finding&) { return true; }
bool OfFixes(const Finding& f) { return f.stream == "fixes"; }
bool OfRotorsWhereItBiases(const Finding& f) {
  return f.Biases() && (f.stream == "rotors" || f.stream == "motors");
}
bool OfDriveWhereItBiases(const Finding& f) {
  return OfRotorsWhereItBiases(f) || (f.Biases() && f.stream == "imu");
}
bool OfHarmfulLag(const Finding& f) { return std::abs(f.size) > kHarmless; }
bool OfPlaceDrift(const Finding& f) { return std::abs(f.size) > kPlaceClock.drift; }
bool OfOtherUnit(const Finding& f) { return std::abs(std::log(f.size)) > kOtherUnit; }

}  // namespace fault
}  // namespace trueline
