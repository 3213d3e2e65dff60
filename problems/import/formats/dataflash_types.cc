#include "problems/import/formats/dataflash_types.h"

#include <array>

#include "problems/import/formats/bytes.h"

namespace trueline {
namespace {

constexpr std::array<FlashLetter, 17> kFlashLetters = {{{'b', Scalar::kI8},
                                                        {'B', Scalar::kU8},
                                                        {'M', Scalar::kU8},
                                                        {'h', Scalar::kI16},
                                                        {'H', Scalar::kU16},
                                                        {'i', Scalar::kI32},
                                                        {'I', Scalar::kU32},
                                                        {'q', Scalar::kI64},
                                                        {'Q', Scalar::kU64},
                                                        {'f', Scalar::kF32},
                                                        {'d', Scalar::kF64},
                                                        {'g', Scalar::kF16},
                                                        {'c', Scalar::kI16, 0.01},
                                                        {'C', Scalar::kU16, 0.01},
                                                        {'e', Scalar::kI32, 0.01},
                                                        {'E', Scalar::kU32, 0.01},
                                                        {'L', Scalar::kI32, 1e-7}}};

std::size_t LetterSize(char letter) {
  if (letter == 'a') return 2 * kFlashShorts;
  const FlashLetter* known = LetterOf(letter);
  return known == nullptr ? FlashTextSize(letter) : SizeOf(known->type);
}

bool TellsSensorsApart(const FlashType& type, const FlashColumn& column) {
  if (column.letter != 'B') return false;
  const bool core = type.name.starts_with("XK") || type.name.starts_with("NK");
  return column.name == "I" || column.name == "Inst" || column.name == "Instance" ||
         (core && column.name == "C");
}

}  // namespace

const FlashLetter* LetterOf(char letter) {
  for (const FlashLetter& known : kFlashLetters) {
    if (known.letter == letter) return &known;
  }
  return nullptr;
}

std::size_t FlashTextSize(char letter) {
  return letter == 'n' ? 4 : letter == 'N' ? 16 : letter == 'Z' ? 64 : 0;
}

std::string FlashText(std::string_view bytes) {
  return std::string(bytes.substr(0, bytes.find('\0')));
}

const FlashColumn* FlashType::Find(std::string_view column) const {
  for (const FlashColumn& c : columns) {
    if (c.name == column) return &c;
  }
  return nullptr;
}

bool ParseFmt(std::string_view record, FlashType* type) {
  ByteCursor cursor(record.substr(4));
  type->length = cursor.Get<std::uint8_t>();
  type->name = FlashText(cursor.Bytes(4));
  const std::string letters = FlashText(cursor.Bytes(16));
  std::size_t offset = 3;
  std::string rest = FlashText(cursor.Bytes(64));
  for (const char letter : letters) {
    const std::size_t comma = rest.find(',');
    if (LetterSize(letter) == 0) return false;
    type->columns.push_back({rest.substr(0, comma), letter, offset});
    rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    offset += LetterSize(letter);
  }
  for (std::size_t i = 0; i < type->columns.size(); ++i) {
    const FlashColumn& column = type->columns[i];
    if (TellsSensorsApart(*type, column)) type->instance_column = static_cast<int>(i);
    const bool is_time = column.name == "TimeUS" || column.name == "TimeMS";
    if (is_time && i == 0 && LetterOf(column.letter) != nullptr) type->time_column = 0;
  }
  return offset == type->length;
}

}  // namespace trueline
