#include "problems/import/formats/blackbox_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>

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

// The low `bits` of a number as a signed one.
std::int32_t SignExtend(std::uint32_t value, int bits) {
  const std::uint32_t sign = 1U << (bits - 1);
  const std::uint32_t low = bits == 32 ? value : value & ((1U << bits) - 1);
  return static_cast<std::int32_t>((low ^ sign) - sign);
}

std::uint32_t OneByte(ByteCursor* cursor) { return cursor->Get<std::uint8_t>(); }

// Up to eight numbers; a mask tells which are not zero.
void ReadTag8(ByteCursor* cursor, std::size_t count, std::int32_t* values) {
  std::uint32_t mask = count == 1 ? 1 : OneByte(cursor);
  for (std::size_t i = 0; i < count; ++i, mask >>= 1) {
    values[i] = (mask & 1) != 0 ? ReadBlackboxSigned(cursor) : 0;
  }
}

// Three numbers of 1 to 4 bytes; `sizes` holds two bits for each, the first lowest.
void ReadThreeWide(ByteCursor* cursor, std::uint32_t sizes, std::int32_t* values) {
  for (int i = 0; i < 3; ++i, sizes >>= 2) {
    const int bytes = static_cast<int>(sizes & 3) + 1;
    std::uint32_t value = 0;
    for (int k = 0; k < bytes; ++k) value |= OneByte(cursor) << (8 * k);
    values[i] = SignExtend(value, 8 * bytes);
  }
}

// How far up in the bits of one, two and three bytes the three numbers lie, and how wide they are.
struct Packed {
  std::array<int, 3> shift, width;
};
using Packings = std::array<Packed, 3>;
constexpr Packings kThreeS32 = {
    {{{4, 2, 0}, {2, 2, 2}}, {{8, 4, 0}, {4, 4, 4}}, {{16, 8, 0}, {6, 6, 6}}}};
constexpr Packings kThreeVariable = {
    {{{4, 2, 0}, {2, 2, 2}}, {{9, 4, 0}, {5, 5, 4}}, {{14, 7, 0}, {8, 7, 7}}}};

// The two highest bits are the number of further bytes; three: each number has bytes of its own.
void ReadTag2Three(ByteCursor* cursor, const Packings& packings, std::int32_t* values) {
  std::uint32_t bits = OneByte(cursor);
  const std::uint32_t more = bits >> 6;
  if (more == packings.size()) return ReadThreeWide(cursor, bits, values);
  for (std::uint32_t k = 0; k < more; ++k) bits = bits << 8 | OneByte(cursor);
  const auto& [shift, width] = packings[more];
  for (std::size_t i = 0; i < 3; ++i) values[i] = SignExtend(bits >> shift[i], width[i]);
}

// Four numbers of 0, 4, 8 or 16 bits, packed in nibbles, high ones first.
void ReadTag8FourS16(ByteCursor* cursor, std::int32_t* values) {
  std::uint32_t sizes = OneByte(cursor);
  std::uint32_t pending = 0;  // the low nibble of the last byte, where `half` is true
  bool half = false;
  const auto nibble = [&] {
    if (half) {
      half = false;
      return pending & 15U;
    }
    pending = OneByte(cursor);
    half = true;
    return pending >> 4;
  };
  for (int i = 0; i < 4; ++i, sizes >>= 2) {
    const int nibbles = (sizes & 3) == 3 ? 4 : static_cast<int>(sizes & 3);
    std::uint32_t value = 0;
    for (int k = 0; k < nibbles; ++k) value = value << 4 | nibble();
    values[i] = nibbles == 0 ? 0 : SignExtend(value, 4 * nibbles);
  }
}

// Reads one number, or a group of neighbours that share their encoding. Returns how many.
std::size_t ReadGroup(const std::vector<BlackboxField>& fields, std::size_t i, ByteCursor* cursor,
                      std::int32_t* values) {
  switch (fields[i].encoding) {
    case 0:
      values[0] = ReadBlackboxSigned(cursor);
      return 1;
    case 1:
      values[0] = static_cast<std::int32_t>(ReadBlackboxUnsigned(cursor));
      return 1;
    case 3:
      values[0] = -SignExtend(ReadBlackboxUnsigned(cursor), 14);
      return 1;
    case 6: {
      std::size_t count = 1;
      while (count < 8 && i + count < fields.size() && fields[i + count].encoding == 6) ++count;
      ReadTag8(cursor, count, values);
      return count;
    }
    case 7:
      ReadTag2Three(cursor, kThreeS32, values);
      return 3;
    case 8:
      ReadTag8FourS16(cursor, values);
      return 4;
    case 10:
      ReadTag2Three(cursor, kThreeVariable, values);
      return 3;
    default:
      values[0] = 0;
      return 1;
  }
}

std::int64_t Predict(const BlackboxHeader& header, const BlackboxHistory& history, int predictor,
                     std::size_t i, const BlackboxValues& values, int* home) {
  const auto before = [&](const BlackboxValues* frame) {
    return frame != nullptr && i < frame->size() ? (*frame)[i] : 0;
  };
  switch (predictor) {
    case 1:
      return before(history.previous);
    case 2:
      return 2 * before(history.previous) - before(history.previous2);
    case 3:
      return (before(history.previous) + before(history.previous2)) / 2;
    case 4:
      return header.min_throttle;
    case 5:
      return header.motor0 >= 0 && static_cast<std::size_t>(header.motor0) < i
                 ? values[static_cast<std::size_t>(header.motor0)]
                 : 0;
    case 6:
      return before(history.previous) + history.skipped + 1;
    case 7:
      return history.home[(*home)++ % 2];
    case 8:
      return 1500;
    case 9:
      return header.vbat_ref;
    case 10:
      return history.main_time;
    case 11:
      return header.motor_low;
    default:
      return 0;
  }
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

std::uint32_t ReadBlackboxUnsigned(ByteCursor* cursor) {
  std::uint32_t value = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    const std::uint32_t byte = OneByte(cursor);
    value |= (byte & 127) << shift;
    if (byte < 128) return value;
  }
  return 0;  // no number has so many bytes
}

std::int32_t ReadBlackboxSigned(ByteCursor* cursor) {
  const std::uint32_t value = ReadBlackboxUnsigned(cursor);
  return static_cast<std::int32_t>((value >> 1) ^ (0U - (value & 1)));
}

void DecodeBlackboxFrame(const BlackboxHeader& header, char frame, const BlackboxHistory& history,
                         ByteCursor* cursor, BlackboxValues* values) {
  const std::vector<BlackboxField>& fields = header.frames.at(frame);
  values->assign(fields.size(), 0);
  int home = 0;
  std::int32_t group[8];
  for (std::size_t i = 0; i < fields.size() && cursor->ok();) {
    const std::size_t count = ReadGroup(fields, i, cursor, group);
    for (std::size_t k = 0; k < count && i < fields.size(); ++k, ++i) {
      const std::int64_t sum =
          group[k] + Predict(header, history, fields[i].predictor, i, *values, &home);
      (*values)[i] = fields[i].is_signed ? std::int64_t{static_cast<std::int32_t>(sum)}
                                         : std::int64_t{static_cast<std::uint32_t>(sum)};
    }
  }
}

}  // namespace trueline
