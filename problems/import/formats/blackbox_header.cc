#include "problems/import/formats/blackbox_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "problems/import/formats/bytes.h"
#include "problems/log/csv_text.h"

namespace trueline {

namespace {

constexpr std::size_t kMaxBlackboxFields = 1024;

bool ParseSmall(std::string_view text, int* number) {
  double value = 0.0;
  if (!ParseNumber(text, &value) || !(std::abs(value) < 1e6)) return false;
  *number = static_cast<int>(value);
  return true;
}

}  // namespace

bool BlackboxHeader::AddLine(std::string_view line) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return false;
  const std::string_view name = line.substr(0, colon);
  const std::string_view value = line.substr(colon + 1);
  if (!name.starts_with("Field ") || name.size() < 9) {
    settings[std::string(name)] = value;
    return true;
  }
  return TakeFrame(name[6], name.substr(8), value);
}

bool BlackboxHeader::TakeFrame(char frame, std::string_view property, std::string_view values) {
  std::vector<std::string_view> texts;
  SplitFields(values, ',', &texts);
  if (texts.size() > kMaxBlackboxFields) return false;
  std::vector<BlackboxField>& fields = frames[frame];
  if (frame == 'P' && fields.empty()) fields = frames['I'];
  if (property == "name") fields.resize(texts.size());
  if (texts.size() != fields.size()) return false;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    int number = 0;
    if (property == "name") {
      fields[i].name = texts[i];
      continue;
    }
    if (!ParseSmall(texts[i], &number)) return false;
    if (property == "signed") fields[i].is_signed = number != 0;
    if (property == "predictor") fields[i].predictor = number;
    if (property == "encoding") fields[i].encoding = number;
  }
  return true;
}

bool BlackboxHeader::Finish() {
  const auto whole = [this](const char* setting, std::size_t which, double fallback) {
    return static_cast<int>(std::clamp(Number(setting, which, fallback), 0.0, 1e6));
  };
  min_throttle = whole("minthrottle", 0, 1150);
  vbat_ref = whole("vbatref", 0, 4095);
  motor_low = whole("motorOutput", 0, 0);
  motor0 = IndexOf('I', "motor[0]");
  // "P interval" is one number, or a ratio such as 1/2.
  const int first = std::max(1, whole("P interval", 0, 1));
  const int second = whole("P interval", 1, 0);
  intra_ = static_cast<std::uint32_t>(std::max(1, whole("I interval", 0, 32)));
  count_ = static_cast<std::uint32_t>(second > 0 ? first : 1);
  of_ = static_cast<std::uint32_t>(second > 0 ? second : first);
  const std::vector<BlackboxField>& intra = frames['I'];
  const std::vector<BlackboxField>& inter = frames['P'];
  if (intra.empty() || inter.size() != intra.size()) return false;
  const auto known = [](const BlackboxField& field) {
    const bool encoding = field.encoding == 0 || field.encoding == 1 || field.encoding == 3 ||
                          (field.encoding >= 6 && field.encoding <= 10);
    return encoding && field.predictor >= 0 && field.predictor <= 11;
  };
  return std::all_of(frames.begin(), frames.end(), [&](const auto& frame) {
    return std::all_of(frame.second.begin(), frame.second.end(), known);
  });
}

double BlackboxHeader::Number(std::string_view setting, std::size_t which, double fallback) const {
  const auto found = settings.find(setting);
  if (found == settings.end()) return fallback;
  std::string text = found->second;
  std::replace(text.begin(), text.end(), '/', ',');
  std::vector<std::string_view> parts;
  SplitFields(text, ',', &parts);
  double value = 0.0;
  return which < parts.size() && ParseNumber(parts[which], &value) ? value : fallback;
}

int BlackboxHeader::IndexOf(char frame, std::string_view field) const {
  const auto found = frames.find(frame);
  if (found == frames.end()) return -1;
  for (std::size_t i = 0; i < found->second.size(); ++i) {
    if (found->second[i].name == field) return static_cast<int>(i);
  }
  return -1;
}

bool BlackboxHeader::Logs(std::uint32_t iteration) const {
  return (iteration % intra_ + count_ - 1) % of_ < count_;
}

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
