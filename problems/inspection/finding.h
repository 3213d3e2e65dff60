// One fault of a log, with its size, its certainty, what it does to a calibration and its remedy.
#pragma once

#include <limits>
#include <string>

namespace trueline {

// What a fault does to a calibration, worst first.
enum class Level {
  kFatal,   // no calibration is possible, or each is wrong: axes, signs, clocks of another origin
  kBiases,  // parameters come out wrong by more than their intervals say
  kWidens,  // parameters come out less certain
  kNote     // no harm by itself
};

const char* NameOf(Level level);  // "fatal", "biases", "widens", "note"

struct Finding {
  std::string id = {};      // such as clock_offset; config/README.md lists them
  std::string stream = {};  // of the native log
  Level level = Level::kNote;
  double size = 0.0;
  std::string unit = {};
  // m/s^2, the error of the specific force in earth axes that the fault makes in this flight; the
  // order within a level. Zero where that is not the harm.
  double error = 0.0;
  double sigma = std::numeric_limits<double>::quiet_NaN();  // one standard deviation of `size`
  std::string text = {};                                    // one sentence, with figures
  std::string remedy = {};                                  // one sentence
  bool repaired = false;                                    // the corrected map holds the repair
};

}  // namespace trueline
