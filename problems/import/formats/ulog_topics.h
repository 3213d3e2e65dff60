// What ULog's topics hold: where their fields lie in a message, and what motor outputs mean.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/bytes.h"

namespace trueline {

struct ULogField {
  std::string type, name;
  std::size_t count = 0;  // of an array; 0 for a single value
};
using ULogFormats = std::map<std::string, std::vector<ULogField>, std::less<>>;

// Adds a definition, "name:type field;type[n] field;...". False if it is malformed.
bool ParseULogFormat(std::string_view text, ULogFormats* formats);

// Lays out the fields of a type one after another, nested types in place.
class ULogLayout {
 public:
  // `formats` must outlive this. The fields must fit into `room` bytes: so a file can't demand more
  // memory by its definitions than its messages have.
  ULogLayout(const ULogFormats& formats, std::size_t room) : formats_(formats), room_(room) {}

  // False if a type is not defined, nests too deeply or does not fit.
  bool Add(std::string_view type, const std::string& prefix, int depth = 0);

  std::vector<PackedField> fields;
  std::size_t size = 0;      // bytes, with padding
  std::size_t min_size = 0;  // without padding at the end
  bool too_large = false;    // for the room: the type may fit into a longer message

 private:
  bool AddOne(const std::string& type, const std::string& name, int depth);
  bool Fits();

  const ULogFormats& formats_;
  std::size_t room_;
  std::size_t steps_ = 0;  // fields visited, those without bytes too
};

// What PX4's topic actuator_outputs holds: pulses of PWM in us, or values of DShot, or of CAN.

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
