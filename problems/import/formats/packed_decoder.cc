#include "problems/import/formats/packed_decoder.h"

#include <fmt/format.h>

namespace trueline {

bool PackedDecoder::Describe(std::string_view message, Channel* channel) {
  if (message.size() < min_size_) return false;
  for (const PackedField& field : fields_) channel->fields.push_back({field.name, field.unit});
  channel->SetStamp(stamp_, stamp_exponent_);
  return true;
}

bool PackedDecoder::Decode(std::string_view message, std::vector<Cell>* cells) const {
  if (message.size() < min_size_) return false;
  for (std::size_t i = 0; i < cells->size(); ++i) {
    const PackedField& field = fields_[i];
    if (field.offset + SizeOf(field.type) > message.size()) continue;
    const Cell cell = ReadScalar(field.type, message.data() + field.offset);
    const bool as_is = field.scale == 1.0 && field.shift == 0.0;
    (*cells)[i] = as_is ? cell : Cell(field.scale * cell.Number() + field.shift);
  }
  return true;
}

std::string PackedLayout(const std::vector<PackedField>& fields) {
  std::string layout;
  for (const PackedField& field : fields) {
    layout += fmt::format("{} {} {};", field.name, field.offset, static_cast<int>(field.type));
  }
  return layout;
}

}  // namespace trueline
