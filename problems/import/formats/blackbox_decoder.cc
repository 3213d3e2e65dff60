#include "problems/import/formats/blackbox_decoder.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>

#include "problems/import/formats/bytes.h"

namespace trueline {
namespace {

// gyro_scale is the bits of a float: 1 for Betaflight (deg/s), rad/us for older firmware. At high
// resolution the gyro is logged at ten times its value.
double GyroScale(const BlackboxHeader& header) {
  const auto found = header.settings.find("gyro_scale");
  if (found == header.settings.end()) return 1.0;
  std::string_view text = found->second;
  if (text.starts_with("0x")) text.remove_prefix(2);
  std::uint32_t bits = 0;
  std::from_chars(text.data(), text.data() + text.size(), bits, 16);
  const double scale = std::bit_cast<float>(bits);
  const double resolution = header.Number("blackbox_high_resolution", 0, 0.0) > 0.0 ? 0.1 : 1.0;
  return resolution * (scale > 1e-3 ? scale : scale * 1e6 * 180.0 / M_PI);
}

bool IsBetaflight4(const BlackboxHeader& header) {
  const auto found = header.settings.find("Firmware revision");
  if (found == header.settings.end()) return false;
  return found->second.starts_with("Betaflight 4") || found->second.starts_with("Betaflight 20") ||
         found->second.starts_with("Indiflight");
}

}  // namespace

std::vector<BlackboxDerived> DerivedBlackboxFields(const BlackboxHeader& header) {
  std::vector<BlackboxDerived> derived;
  const double gyro = GyroScale(header);
  const double one_g = header.Number("acc_1G", 0, 0.0);
  const double low = header.Number("motorOutput", 0, 0.0);
  const double high = header.Number("motorOutput", 1, 0.0);
  const double poles = header.Number("motor_poles", 0, 14.0);
  for (int i = 0; i < 8; ++i) {
    const auto name = [i](const char* text) { return fmt::format("{}[{}]", text, i); };
    derived.push_back({name("gyroADC"), name("gyro"), "deg/s", gyro});
    if (one_g > 0.0) derived.push_back({name("accSmooth"), name("accel"), "g", 1.0 / one_g});
    if (high > low) {
      const double range = high - low;
      derived.push_back({name("motor"), name("throttle"), "1", 1.0 / range, -low / range});
    }
    if (poles > 0.0) {  // 100 electrical rpm
      const double scale = 100.0 * 2.0 / poles * M_PI / 30.0;
      derived.push_back({name("eRPM"), name("rotor"), "rad/s", scale});
    }
  }
  if (IsBetaflight4(header)) derived.push_back({"vbatLatest", "battery", "V", 0.01});
  return derived;
}

std::unique_ptr<MessageDecoder> MakeBlackboxDecoder(const BlackboxHeader& header, char frame) {
  std::vector<PackedField> fields = {{"main_time", 0, Scalar::kI64, "us"}};
  for (const BlackboxField& field : header.frames.at(frame)) {
    fields.push_back({field.name, 8 * fields.size(), Scalar::kI64});
  }
  const std::size_t size = 8 * fields.size();
  const bool has_time = header.IndexOf(frame, "time") >= 0;
  if (frame == 'I') {
    for (const BlackboxDerived& derived : DerivedBlackboxFields(header)) {
      const int raw = header.IndexOf('I', derived.raw);
      if (raw < 0) continue;
      fields.push_back({derived.name, 8 * (static_cast<std::size_t>(raw) + 1), Scalar::kI64,
                        derived.unit, derived.scale, derived.shift});
    }
  }
  return std::make_unique<PackedDecoder>(fields, size, has_time ? "time" : "main_time", 3);
}

}  // namespace trueline
