#include "problems/import/formats/named_cells.h"

namespace trueline {

bool NamedFields::Describe(const std::vector<NamedCell>& row, Channel* channel) {
  places_.clear();
  for (const NamedCell& cell : row) {
    if (!places_.try_emplace(cell.name, channel->fields.size()).second) continue;
    channel->fields.push_back({cell.name, cell.is_time ? "ns" : ""});
    const bool is_stamp = cell.name == "timestamp" || cell.name == "header.stamp";
    if (cell.is_time && is_stamp) channel->SetStamp(cell.name, 0);
  }
  return !row.empty();
}

void NamedFields::Place(const std::vector<NamedCell>& row, std::vector<Cell>* cells) const {
  for (const NamedCell& cell : row) {
    const auto place = places_.find(cell.name);
    if (place != places_.end() && place->second < cells->size()) {
      (*cells)[place->second] = cell.cell;
    }
  }
}

}  // namespace trueline
