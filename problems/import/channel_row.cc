#include "problems/import/channel_row.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/import/list_channels.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

constexpr double kStale = 1.0;  // s, from where on a companion's last values are missing

}  // namespace

ChannelRow::ChannelRow(const Recording& recording, const std::vector<std::size_t>& channels)
    : recording_(recording), channels_(channels) {
  for (const std::size_t channel : channels_) {
    starts_.push_back(cells_.size());
    cells_.resize(cells_.size() + recording_.channels()[channel].fields.size());
    times_.push_back(0);
  }
}

bool ChannelRow::AddRecord(std::size_t channel, const Record& record) {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (channels_[i] != channel) continue;
    const auto start = static_cast<std::ptrdiff_t>(starts_[i]);
    std::copy(record.cells.begin(), record.cells.end(), cells_.begin() + start);
    times_[i] = record.time;
  }
  if (channel != channels_.front()) return false;
  time_ = record.time;
  is_unstamped_ = record.is_unstamped;
  place_ = record.place;
  missing_ = -1;
  for (std::size_t i = 1; i < channels_.size(); ++i) {
    if (std::abs(ToSeconds(time_) - ToSeconds(times_[i])) < kStale) continue;
    const auto start = cells_.begin() + static_cast<std::ptrdiff_t>(starts_[i]);
    const std::size_t count = recording_.channels()[channels_[i]].fields.size();
    std::fill_n(start, count, Cell());
  }
  return true;
}

int ChannelRow::IndexOf(const std::string& column, const std::string& where) const {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const Channel& channel = recording_.channels()[channels_[i]];
    const std::string own = channel.name + ":";  // tells fields of one name apart
    const int index = channel.IndexOf(column.starts_with(own) ? column.substr(own.size()) : column);
    if (index >= 0) return static_cast<int>(starts_[i]) + index;
  }
  const Channel& channel = recording_.channels()[channels_.front()];
  throw UnknownColumn(fmt::format("{}: there is no field '{}' in {} of {}; it has: {}", where,
                                  column, channel.Label(), recording_.file(), FieldList(channel)));
}

double ChannelRow::Number(int index) const {
  const double value = At(index).Number();
  if (!std::isfinite(value)) missing_ = index;
  return value;
}

TimeNs ChannelRow::Time(int index, int exponent) const {
  TimeNs time = 0;
  if (At(index).Time(exponent, &time)) return time;
  Fail(index, "is no time stamp; leave out 'time' to use the log's own");
}

InputError ChannelRow::ErrorIn(int index, const std::string& message) const {
  if (index < 0) {  // no field's fault
    return InputError(fmt::format("{}: {} at {} s: {}", recording_.file(),
                                  recording_.channels()[channels_.front()].Label(), TimeText(time_),
                                  message));
  }
  std::size_t i = channels_.size() - 1;
  while (starts_[i] > static_cast<std::size_t>(index)) --i;
  const Channel& channel = recording_.channels()[channels_[i]];
  const std::string& field = channel.fields[static_cast<std::size_t>(index) - starts_[i]].name;
  return InputError(fmt::format("{}: {} at {} s: {}: {}", recording_.file(), channel.Label(),
                                TimeText(time_), field, message));
}

InputError ChannelRow::MissingError(const std::string& stream) const {
  return ErrorIn(missing_,
                 missing_ < 0
                     ? fmt::format("all numbers are zero of the quaternion, or of the place, that "
                                   "stream '{}' needs",
                                   stream)
                     : fmt::format("a finite number is missing that stream '{}' needs", stream));
}

}  // namespace trueline
