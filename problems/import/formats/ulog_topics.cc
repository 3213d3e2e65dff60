#include "problems/import/formats/ulog_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace trueline {

namespace {

constexpr std::size_t kMaxFields = 16384;       // of one topic; a larger definition is damaged
constexpr std::size_t kMaxULogMessage = 65535;  // bytes
constexpr std::size_t kMaxSteps = 1 << 17;      // of one topic; types without fields cost no bytes
constexpr int kMaxNesting = 16;

const std::map<std::string, Scalar, std::less<>> kULogScalars = {
    {"int8_t", Scalar::kI8},    {"uint8_t", Scalar::kU8},   {"int16_t", Scalar::kI16},
    {"uint16_t", Scalar::kU16}, {"int32_t", Scalar::kI32},  {"uint32_t", Scalar::kU32},
    {"int64_t", Scalar::kI64},  {"uint64_t", Scalar::kU64}, {"float", Scalar::kF32},
    {"double", Scalar::kF64},   {"bool", Scalar::kU8}};

// "type[n] name" or "type name".
bool ParseULogField(std::string_view text, ULogField* field) {
  const std::size_t space = text.find(' ');
  if (space == std::string_view::npos) return false;
  std::string_view type = text.substr(0, space);
  field->name = text.substr(space + 1);
  const std::size_t bracket = type.find('[');
  field->type = type.substr(0, bracket);
  if (bracket == std::string_view::npos) return true;
  const char* end = type.data() + type.size();
  const auto [stop, error] = std::from_chars(type.data() + bracket + 1, end, field->count);
  return error == std::errc() && stop + 1 == end && *stop == ']' && field->count > 0;
}

}  // namespace

bool ParseULogFormat(std::string_view text, ULogFormats* formats) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return false;
  std::vector<ULogField> fields;
  ByteCursor rest(text.substr(colon + 1));
  while (rest.left() > 0) {
    const std::string_view part = rest.Until(';');
    ULogField field;
    if (!rest.ok() || !ParseULogField(part, &field)) return false;
    fields.push_back(field);
  }
  (*formats)[std::string(text.substr(0, colon))] = std::move(fields);
  return true;
}

bool ULogLayout::Add(std::string_view type, const std::string& prefix, int depth) {
  const auto format = formats_.find(type);
  if (format == formats_.end() || depth > kMaxNesting) return false;
  for (const ULogField& field : format->second) {
    for (std::size_t i = 0; i < std::max<std::size_t>(1, field.count); ++i) {
      const std::string name =
          prefix + field.name + (field.count > 0 ? fmt::format("[{}]", i) : "");
      if (!AddOne(field.type, name, depth)) return false;
    }
  }
  return true;
}

bool ULogLayout::Fits() {
  too_large = min_size > room_;
  return !too_large && fields.size() <= kMaxFields && size <= kMaxULogMessage;
}

bool ULogLayout::AddOne(const std::string& type, const std::string& name, int depth) {
  if (++steps_ > kMaxSteps) return false;
  if (const auto scalar = kULogScalars.find(type); scalar != kULogScalars.end()) {
    const bool padding = name.find("_padding") != std::string::npos;
    if (!padding) fields.push_back({name, size, scalar->second});
    size += SizeOf(scalar->second);
    if (!padding) min_size = size;
    return Fits();
  }
  if (type == "char") {
    min_size = ++size;
    return Fits();
  }
  return Add(type, name + ".", depth + 1);
}

namespace {

constexpr double kShortestPulse = 800.0, kLongestPulse = 2200.0;  // us
constexpr double kFullDshot = 1999.0;
constexpr std::size_t kMotors = 4;  // the outputs that the map reads as motors

// NaN beyond the message's end.
double OutputAt(std::string_view message, std::size_t offset, std::size_t k) {
  const std::size_t place = offset + k * SizeOf(Scalar::kF32);
  if (place + SizeOf(Scalar::kF32) > message.size()) return std::nan("");
  return ReadScalar(Scalar::kF32, message.data() + place).Number();
}

// Zero is an output that is not used.
bool IsNoPulse(double output) {
  return (output > 0.0 && output < kShortestPulse) || output > kLongestPulse;
}

// PX4 before 1.14 has one parameter, which states the rate; 1.13 on has one for each group of
// timers, of which -5 to -2 are DShot150 to DShot1200.
bool SetsDshot(std::string_view name, std::int32_t value) {
  const bool of_timers = name.starts_with("PWM_") && name.find("_TIM") != std::string_view::npos;
  return (name == "DSHOT_CONFIG" && value > 0) || (of_timers && value >= -5 && value <= -2);
}

}  // namespace

void ULogOutputs::AddParameter(std::string_view payload) {
  constexpr std::string_view kWhole = "int32_t ";
  ByteCursor cursor(payload);
  const std::string_view key = cursor.Bytes(cursor.Get<std::uint8_t>());
  const auto value = cursor.Get<std::int32_t>();
  if (!cursor.ok() || !key.starts_with(kWhole)) return;
  dshot_ |= SetsDshot(key.substr(kWhole.size()), value);
}

void ULogOutputs::Describe(std::uint16_t topic, const std::string& label,
                           std::string_view first_message, std::vector<PackedField>* fields) {
  std::vector<PackedField> outputs;
  for (const PackedField& field : *fields) {
    if (field.name.starts_with("output[") && field.type == Scalar::kF32) outputs.push_back(field);
  }
  if (outputs.size() < kMotors) return;
  Outputs& found = topics_[topic];
  found.label = label;
  found.offset = outputs.front().offset;
  found.first = OutputAt(first_message, found.offset, 0);
  found.is_dshot = dshot_ && found.first < kShortestPulse;
  if (!found.is_dshot) return;
  for (const PackedField& output : outputs) {
    fields->push_back({"dshot" + output.name.substr(std::string_view("output").size()),
                       output.offset, output.type, "1", 1.0 / kFullDshot});
  }
}

void ULogOutputs::AddMessage(std::uint16_t topic, std::string_view message) {
  const auto found = topics_.find(topic);
  if (found == topics_.end()) return;
  Outputs& outputs = found->second;
  ++outputs.messages;
  for (std::size_t k = 0; k < kMotors; ++k) {
    if (!IsNoPulse(OutputAt(message, outputs.offset, k))) continue;
    ++outputs.no_pulse;
    return;
  }
}

std::vector<std::string> ULogOutputs::Warnings() const {
  constexpr const char* kRemedy =
      "for DShot give 'motors' in a map the columns output[0..3] with 'scale: 5.0025e-4' "
      "(1 / 1999), without 'offset' and 'accept'; else leave 'motors' out";
  std::vector<std::string> warnings;
  for (const auto& [topic, outputs] : topics_) {
    if (outputs.is_dshot) continue;
    if (outputs.no_pulse > 0) {
      warnings.push_back(
          fmt::format("{}: {} of {} messages hold values that are no PWM pulses of 800 to 2200 us, "
                      "so that motor commands read as such are wrong; {}",
                      outputs.label, outputs.no_pulse, outputs.messages, kRemedy));
    } else if (dshot_) {
      warnings.push_back(
          fmt::format("{}: the parameters set DShot, but the first output is {:.5g}, so that all "
                      "are read as PWM pulses (us); if they are DShot's, {}",
                      outputs.label, outputs.first, kRemedy));
    }
  }
  return warnings;
}

}  // namespace trueline
