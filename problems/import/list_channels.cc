#include "problems/import/list_channels.h"

#include <fmt/format.h>

namespace trueline {
namespace {

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
