#include "problems/import/resolve_channels.h"

#include <fmt/ranges.h>
#include <fnmatch.h>

#include <algorithm>

#include "problems/import/channel_row.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ros_types.h"
#include "problems/import/stream_import.h"

namespace trueline {
namespace {

bool HasRecords(const Channel& channel) { return channel.count > 0 && !channel.fields.empty(); }

// Of several instances: the session that the file prefers, or the first one that has not much fewer
// records than the others.
std::optional<std::size_t> BestInstance(const Recording& recording,
                                        const std::vector<std::size_t>& found) {
  std::size_t most = 0;
  for (const std::size_t i : found) most = std::max(most, recording.channels()[i].count);
  std::optional<std::size_t> best;
  for (const std::size_t i : found) {
    const Channel& channel = recording.channels()[i];
    if (recording.preferred_instance() == channel.instance) return i;
    if (!best && 2 * channel.count >= most) best = i;
  }
  return best;
}

std::optional<std::size_t> FindByName(const Recording& recording, const std::string& pattern) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < recording.channels().size(); ++i) {
    const Channel& channel = recording.channels()[i];
    if (!HasRecords(channel)) continue;
    if (fmt::format("{}[{}]", channel.name, channel.instance) == pattern) return i;
    if (fnmatch(pattern.c_str(), channel.name.c_str(), 0) == 0) found.push_back(i);
  }
  return BestInstance(recording, found);
}

// Whether the topic's name says that it holds what a controller wants, not what was measured.
bool IsSetpoint(const std::string& name) {
  for (const char* word : {"setpoint", "command", "target", "reference", "goal", "desired"}) {
    if (name.find(word) != std::string::npos) return true;
  }
  return false;
}

// The channel of this type with the most messages.
std::optional<std::size_t> FindByType(const Recording& recording, const std::string& type) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < recording.channels().size(); ++i) {
    const Channel& channel = recording.channels()[i];
    if (!HasRecords(channel) || RosTypeName(channel.type) != RosTypeName(type)) continue;
    if (IsSetpoint(channel.name)) continue;
    if (!best || channel.count > recording.channels()[*best].count) best = i;
  }
  return best;
}

std::optional<std::size_t> FindChannel(const Recording& recording, const StreamMap& stream) {
  if (!stream.type.empty()) return FindByType(recording, stream.type);
  for (const std::string& name : stream.channels) {
    if (const auto found = FindByName(recording, name)) return found;
  }
  return std::nullopt;
}

// The stream's channel and those of `with`; empty if one of them is missing. A CSV file has one.
std::vector<std::size_t> FindChannels(const Recording& recording, const StreamMap& stream) {
  if (recording.format().key == std::string(kCsvFormat)) {
    return std::vector<std::size_t>(recording.channels().empty() ? 0 : 1, 0);
  }
  std::vector<std::size_t> found;
  if (const auto channel = FindChannel(recording, stream)) found.push_back(*channel);
  for (const std::string& name : stream.with) {
    if (const auto channel = FindByName(recording, name)) found.push_back(*channel);
  }
  if (found.size() != 1 + stream.with.size()) found.clear();
  return found;
}

std::string Wanted(const StreamMap& stream) {
  std::vector<std::string> names;
  const auto add = [&names](const StreamMap& one) {
    if (!one.type.empty()) names.push_back("type " + one.type);
    names.insert(names.end(), one.channels.begin(), one.channels.end());
    names.insert(names.end(), one.with.begin(), one.with.end());
  };
  add(stream);
  for (const StreamMap& other : stream.otherwise) add(other);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return fmt::format("{}", fmt::join(names, ", "));
}

// Finds the first of the alternatives that the log has. `why` becomes the last error of a column.
std::optional<StreamMap> FirstThatFits(const Recording& recording, const StreamMap& stream,
                                       std::string* why) {
  std::vector<StreamMap> all = {stream};
  all.insert(all.end(), stream.otherwise.begin(), stream.otherwise.end());
  for (StreamMap& one : all) {
    one.channel = FindChannels(recording, one);
    if (one.channel.empty()) continue;
    one.otherwise.clear();
    StreamMap bound = one;
    try {
      BindColumns(ChannelRow(recording, one.channel), &bound);
      return one;
    } catch (const InputError& error) {
      *why = error.what();
    }
  }
  return std::nullopt;
}

// A topic may have two definitions or encodings; each has a channel of its own, and only one is
// read.
void WarnOfTwin(const Recording& recording, std::size_t channel,
                std::vector<std::string>* warnings) {
  const Channel& read = recording.channels()[channel];
  std::size_t others = 0;
  for (std::size_t i = 0; i < recording.channels().size(); ++i) {
    if (i == channel || recording.channels()[i].Label() != read.Label()) continue;
    others += recording.channels()[i].count;
  }
  if (others == 0) return;
  const std::string warning = fmt::format(
      "{}: {} has messages of several definitions or encodings; the {} from {:.3f} s to {:.3f} s "
      "are read, and {} of another are left out",
      recording.file(), read.Label(), read.count, ToSeconds(read.first), ToSeconds(read.last),
      others);
  const bool is_new = std::find(warnings->begin(), warnings->end(), warning) == warnings->end();
  if (is_new) warnings->push_back(warning);
}

}  // namespace

std::map<std::string, StreamMap> ResolveChannels(const ImportMap& map, const Recordings& recordings,
                                                 std::vector<std::string>* warnings) {
  std::map<std::string, StreamMap> resolved;
  std::map<std::string, std::vector<std::string>> lacking;  // optional streams, by file
  for (const auto& [name, stream] : map.streams) {
    const Recording* recording = recordings[stream.input].get();
    if (recording == nullptr) {
      resolved[name] = stream;
      continue;
    }
    std::string why;
    if (const auto found = FirstThatFits(*recording, stream, &why)) {
      resolved[name] = *found;
      for (const std::size_t channel : found->channel) WarnOfTwin(*recording, channel, warnings);
      continue;
    }
    const std::string lack = why.empty() ? fmt::format("{}: has no records of {} for stream '{}'",
                                                       recording->file(), Wanted(stream), name)
                                         : why;
    if (name == "imu") throw NoUsableLog(lack + "; log the IMU's samples, at 100 Hz or more");
    if (!stream.optional) throw InputError(lack + "; correct 'channel', or set 'optional: true'");
    lacking[recording->file()].push_back(fmt::format("{} ({})", name, Wanted(stream)));
  }
  for (const auto& [file, streams] : lacking) {
    warnings->push_back(fmt::format("{}: has not what the map would also take: {}", file,
                                    fmt::join(streams, "; ")));
  }
  return resolved;
}

int CountStreams(const ImportMap& map, const Recording& recording) {
  int count = 0;
  for (const auto& [name, stream] : map.streams) {
    std::string why;
    if (FirstThatFits(recording, stream, &why)) {
      ++count;
    } else if (!stream.optional) {
      return 0;
    }
  }
  return count;
}

}  // namespace trueline
