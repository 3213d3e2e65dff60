// What PX4's topic actuator_outputs holds: pulses of PWM in us, or values of DShot, or of CAN.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/bytes.h"

namespace trueline {

inline constexpr std::string_view kULogOutputs = "actuator_outputs";

// DShot values are 0 (disarmed) or 1 to 1999 and would pass for short pulses of PWM. A log says by
// its parameters that an output is DShot, but not which of two drivers' outputs: the first message
// tells them apart, as PWM has no pulse below 800 us.
class ULogOutputs {
 public:
  // A parameter's record: whether it sets outputs to DShot.
  void AddParameter(std::string_view payload);
  // Adds to a topic whose outputs are DShot a field dshot[k], 0 to 1, for each output[k].
  void Describe(std::uint16_t topic, const std::string& label, std::string_view first_message,
                std::vector<PackedField>* fields);
  // Counts a message of a topic described before.
  void AddMessage(std::uint16_t topic, std::string_view message);
  // What can't be read as pulses, or may not be; empty where DShot was told.
  std::vector<std::string> Warnings() const;

 private:
  struct Outputs {
    std::string label;
    std::size_t offset = 0;  // of output[0], bytes
    bool is_dshot = false;
    double first = 0.0;                      // output[0] of the first message
    std::size_t messages = 0, no_pulse = 0;  // all, and those with a value that PWM has not
  };

  bool dshot_ = false;  // by the parameters
  std::map<std::uint16_t, Outputs> topics_;
};

}  // namespace trueline
