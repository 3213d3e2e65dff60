#include "problems/import/formats/blackbox_frame.h"

#include <algorithm>

namespace trueline {
namespace {

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

void ReadTag2ThreeS32(ByteCursor* cursor, std::int32_t* values) {
  const std::uint32_t lead = OneByte(cursor);
  if (lead >> 6 == 0) {
    for (int i = 0; i < 3; ++i) values[i] = SignExtend(lead >> (4 - 2 * i), 2);
  } else if (lead >> 6 == 1) {
    values[0] = SignExtend(lead, 4);
    const std::uint32_t two = OneByte(cursor);
    values[1] = SignExtend(two >> 4, 4);
    values[2] = SignExtend(two, 4);
  } else if (lead >> 6 == 2) {
    values[0] = SignExtend(lead, 6);
    values[1] = SignExtend(OneByte(cursor), 6);
    values[2] = SignExtend(OneByte(cursor), 6);
  } else {
    ReadThreeWide(cursor, lead, values);
  }
}

// 2 + 2 + 2, 5 + 5 + 4 or 8 + 7 + 7 bits, high bit first.
void ReadTag2ThreeVariable(ByteCursor* cursor, std::int32_t* values) {
  const std::uint32_t lead = OneByte(cursor);
  if (lead >> 6 == 0) {
    for (int i = 0; i < 3; ++i) values[i] = SignExtend(lead >> (4 - 2 * i), 2);
  } else if (lead >> 6 == 1) {
    const std::uint32_t bits = lead << 8 | OneByte(cursor);
    values[0] = SignExtend(bits >> 9, 5);
    values[1] = SignExtend(bits >> 4, 5);
    values[2] = SignExtend(bits, 4);
  } else if (lead >> 6 == 2) {
    std::uint32_t bits = lead << 8 | OneByte(cursor);
    bits = bits << 8 | OneByte(cursor);
    values[0] = SignExtend(bits >> 14, 8);
    values[1] = SignExtend(bits >> 7, 7);
    values[2] = SignExtend(bits, 7);
  } else {
    ReadThreeWide(cursor, lead, values);
  }
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
      ReadTag2ThreeS32(cursor, values);
      return 3;
    case 8:
      ReadTag8FourS16(cursor, values);
      return 4;
    case 10:
      ReadTag2ThreeVariable(cursor, values);
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
