// Message types of a DataFlash log, as its FMT records define them.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "problems/import/formats/cell.h"

namespace trueline {

inline constexpr std::size_t kFlashShorts = 32;  // of letter 'a'

// A letter of a format that stands for one number.
struct FlashLetter {
  char letter;
  Scalar type;
  double scale = 1.0;
};
const FlashLetter* LetterOf(char letter);  // null for texts and lists

std::size_t FlashTextSize(char letter);         // bytes; 0 if the letter stands for no text
std::string FlashText(std::string_view bytes);  // to the first zero

struct FlashColumn {
  std::string name;
  char letter;
  std::size_t offset;  // in the record, bytes
};

struct FlashType {
  std::string name;
  std::size_t length = 0;  // of a record, with its three bytes of header
  std::vector<FlashColumn> columns;
  std::string units, multipliers;  // a letter for each column
  int instance_column = -1;        // tells sensors apart
  int time_column = -1;
  std::map<int, std::size_t> channels;  // by instance

  const FlashColumn* Find(std::string_view column) const;
};

// The type that an FMT record defines. False if its columns do not fit its length.
bool ParseFmt(std::string_view record, FlashType* type);

}  // namespace trueline
