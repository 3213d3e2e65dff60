// Numbers with their names, for encodings whose messages differ in their parts.
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

struct NamedCell {
  std::string name;
  Cell cell;
  bool is_time = false;  // ns
};

class NamedFields {
 public:
  // The fields of a first message; "timestamp" or "header.stamp", where it is a time, is the stamp.
  bool Describe(const std::vector<NamedCell>& row, Channel* channel);
  // Puts the numbers that Describe() has seen to their places.
  void Place(const std::vector<NamedCell>& row, std::vector<Cell>* cells) const;

 private:
  std::unordered_map<std::string, std::size_t> places_;
};

// Decodes an encoding by its messages' rows of named numbers.
class NamedRowDecoder : public MessageDecoder {
 public:
  bool Describe(std::string_view message, Channel* channel) override {
    std::vector<NamedCell> row;
    return Parse(message, &row) && fields_.Describe(row, channel);
  }
  bool MayGrow() const override { return true; }  // lists, and keys of JSON
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    std::vector<NamedCell> row;
    if (!Parse(message, &row)) return false;
    fields_.Place(row, cells);
    return true;
  }

 private:
  // False for a message that can't be read.
  virtual bool Parse(std::string_view message, std::vector<NamedCell>* row) const = 0;

  NamedFields fields_;
};

inline constexpr int kMaxNamedDepth = 16;
inline constexpr std::size_t kMaxNamedElements = 64;  // of one list
inline constexpr std::size_t kMaxNamedCells = 4096;   // of one message
inline constexpr std::size_t kMaxNamedParts = 65536;  // likewise, with what has no number

}  // namespace trueline
