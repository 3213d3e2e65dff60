#include "problems/import/channel_row.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

constexpr double kStale = 1.0;  // s, from where on a companion's last values are missing

constexpr std::size_t kListWidth = 100;

// "name[3]" as "name" and 3; -1 for a name that is no element.
int ElementOf(const std::string& name, std::string* list) {
  const std::size_t bracket = name.rfind('[');
  if (bracket == std::string::npos || !name.ends_with(']')) return -1;
  *list = name.substr(0, bracket);
  int index = 0;
  for (std::size_t i = bracket + 1; i + 1 < name.size(); ++i) {
    if (name[i] < '0' || name[i] > '9' || index > 100000) return -1;
    index = 10 * index + (name[i] - '0');
  }
  return index;
}

std::vector<std::string> FieldNames(const Channel& channel) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < channel.fields.size();) {
    const ChannelField& field = channel.fields[i];
    std::string list, other;
    const int first = ElementOf(field.name, &list);
    std::size_t next = i + 1;
    while (first >= 0 && next < channel.fields.size() &&
           ElementOf(channel.fields[next].name, &other) == first + static_cast<int>(next - i) &&
           other == list && channel.fields[next].unit == field.unit) {
      ++next;
    }
    std::string name = next - i > 1 ? fmt::format("{}[{}..{}]", list, first,
                                                  first + static_cast<int>(next - i) - 1)
                                    : field.name;
    names.push_back(field.unit.empty() ? name : fmt::format("{} [{}]", name, field.unit));
    i = next;
  }
  return names;
}

// Label, count, rate and span; of many records at time 0 the time is not known.
std::string TimesOf(const Channel& channel) {
  if (channel.count > 1 && channel.first == 0 && channel.last == 0) {
    return fmt::format("{:<36}{:>9}{:>11}{:>18}{:>18}  ", channel.Label(), channel.count, "-", "-",
                       "-");
  }
  return fmt::format("{:<36}{:>9}{:>11.2f}{:>18.3f}{:>18.3f}  ", channel.Label(), channel.count,
                     channel.Rate(), ToSeconds(channel.first), ToSeconds(channel.last));
}

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
  return ErrorIn(
      missing_,
      missing_ < 0
          ? fmt::format("the quaternion or place that stream '{}' needs is all zero", stream)
          : fmt::format("a finite number is missing that stream '{}' needs", stream));
}

std::map<std::size_t, std::size_t> ReadChannels(Recording* recording,
                                                const std::vector<StreamImport*>& streams) {
  std::vector<ChannelRow> rows;
  std::set<std::size_t> channels;
  for (const StreamImport* stream : streams) {
    rows.emplace_back(*recording, stream->map().channel);
    channels.insert(stream->map().channel.begin(), stream->map().channel.end());
  }
  const std::vector<std::size_t> wanted(channels.begin(), channels.end());
  const std::vector<std::size_t> counts =
      recording->Visit(wanted, [&](std::size_t channel, const Record& record) {
        for (std::size_t i = 0; i < streams.size(); ++i) {
          if (rows[i].AddRecord(channel, record)) streams[i]->AddRow(rows[i]);
        }
      });
  std::map<std::size_t, std::size_t> undecoded;
  for (std::size_t i = 0; i < wanted.size(); ++i) undecoded[wanted[i]] = counts[i];
  return undecoded;
}

std::string FieldList(const Channel& channel) {
  std::string text;
  for (const std::string& name : FieldNames(channel)) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "no numbers that can be read" : text;
}

std::string ListChannels(const Recording& recording) {
  std::string text = fmt::format("{}: {}\n{:<36}{:>9}{:>11}{:>18}{:>18}  {}\n", recording.file(),
                                 recording.format().name, "channel", "messages", "rate [Hz]",
                                 "from [s]", "to [s]", "type");
  for (const Channel& channel : recording.channels()) {
    if (channel.count == 0) continue;
    text += TimesOf(channel) + (channel.type == channel.name ? "" : channel.type) + "\n";
    std::string line = "   ";
    for (const std::string& name : FieldNames(channel)) {
      if (line.size() + name.size() > kListWidth) {
        text += line + "\n";
        line = "   ";
      }
      line += " " + name;
    }
    text += line + "\n";
  }
  return text;
}

}  // namespace trueline
