// Messages of numbers at fixed places.
#pragma once

#include <string>
#include <vector>

#include "problems/import/formats/recording.h"

namespace trueline {

struct PackedField {
  std::string name;
  std::size_t offset;  // bytes
  Scalar type;
  std::string unit = {};
  double scale = 1.0;  // what is read becomes scale * number + shift
  double shift = 0.0;
};

class PackedDecoder : public MessageDecoder {
 public:
  // A message must have `min_size` bytes; fields beyond the end of a longer one are missing.
  PackedDecoder(std::vector<PackedField> fields, std::size_t min_size, std::string stamp,
                int stamp_exponent)
      : fields_(std::move(fields)),
        min_size_(min_size),
        stamp_(std::move(stamp)),
        stamp_exponent_(stamp_exponent) {}

  bool Describe(std::string_view message, Channel* channel) override;
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override;

 private:
  std::vector<PackedField> fields_;
  std::size_t min_size_;
  std::string stamp_;  // name of the field with the time of measurement, or empty
  int stamp_exponent_;
};

// Equal for equal names and places of fields.
std::string PackedLayout(const std::vector<PackedField>& fields);

}  // namespace trueline
