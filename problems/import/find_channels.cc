#include "problems/import/find_channels.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/import/channel_row.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ros_types.h"
#include "problems/import/stream_import.h"

namespace trueline {
namespace {

bool HasRecords(const Channel& channel) { return channel.count > 0 && !channel.fields.empty(); }

// The channels with records that fit: the one whose label is the pattern, or the session that the
// file prefers, or all instances in the order of their numbers.
std::vector<std::size_t> FindInstances(const Recording& recording, const std::string& pattern) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < recording.channels().size(); ++i) {
    const Channel& channel = recording.channels()[i];
    if (!HasRecords(channel)) continue;
    if (fmt::format("{}[{}]", channel.name, channel.instance) == pattern) return {i};
    if (fnmatch(pattern.c_str(), channel.name.c_str(), 0) == 0) found.push_back(i);
  }
  for (const std::size_t i : found) {
    if (recording.preferred_instance() == recording.channels()[i].instance) return {i};
  }
  std::stable_sort(found.begin(), found.end(), [&](std::size_t a, std::size_t b) {
    return recording.channels()[a].instance < recording.channels()[b].instance;
  });
  return found;
}

// The first instance that has not much fewer records than the others.
std::optional<std::size_t> FindByName(const Recording& recording, const std::string& pattern) {
  const std::vector<std::size_t> found = FindInstances(recording, pattern);
  std::size_t most = 0;
  for (const std::size_t i : found) most = std::max(most, recording.channels()[i].count);
  for (const std::size_t i : found) {
    if (2 * recording.channels()[i].count >= most) return i;
  }
  return std::nullopt;
}

// A channel, and the place of the name in the map that it fits.
struct FoundChannel {
  std::size_t channel;
  std::size_t name = 0;
};

std::vector<FoundChannel> FindByNames(const Recording& recording,
                                      const std::vector<std::string>& patterns) {
  std::vector<FoundChannel> found;
  for (std::size_t name = 0; name < patterns.size(); ++name) {
    for (const std::size_t channel : FindInstances(recording, patterns[name])) {
      const bool is_known = std::any_of(found.begin(), found.end(), [&](const FoundChannel& one) {
        return one.channel == channel;
      });
      if (!is_known) found.push_back({channel, name});
    }
  }
  return found;
}

// Whether the topic's name says that it holds what a controller wants, not what was measured.
bool IsSetpoint(const std::string& name) {
  for (const char* word : {"setpoint", "command", "target", "reference", "goal", "desired"}) {
    if (name.find(word) != std::string::npos) return true;
  }
  return false;
}

std::vector<FoundChannel> FindByType(const Recording& recording, const std::string& type) {
  const std::vector<Channel>& channels = recording.channels();
  std::vector<FoundChannel> found;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (!HasRecords(channels[i]) || RosTypeName(channels[i].type) != RosTypeName(type)) continue;
    if (!IsSetpoint(channels[i].name)) found.push_back({i});
  }
  std::stable_sort(found.begin(), found.end(), [&](const FoundChannel& a, const FoundChannel& b) {
    return channels[a.channel].count > channels[b.channel].count;
  });
  return found;
}

// The channels of `with`; none if one of them is missing.
std::optional<std::vector<std::size_t>> FindCompanions(const Recording& recording,
                                                       const StreamMap& stream) {
  std::vector<std::size_t> found;
  for (const std::string& name : stream.with) {
    const auto channel = FindByName(recording, name);
    if (!channel) return std::nullopt;
    found.push_back(*channel);
  }
  return found;
}

// A CSV file has one channel.
std::vector<FoundChannel> FindChannels(const Recording& recording, const StreamMap& stream) {
  if (recording.format().key == std::string(kCsvFormat)) {
    return std::vector<FoundChannel>(recording.channels().empty() ? 0 : 1, FoundChannel{0});
  }
  return stream.type.empty() ? FindByNames(recording, stream.channels)
                             : FindByType(recording, stream.type);
}

bool FitsAny(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), name.c_str(), FNM_CASEFOLD) == 0;
  });
}

int RankOf(const StreamMap& stream, const std::string& channel) {
  if (FitsAny(stream.prefer, channel)) return 0;
  return FitsAny(stream.avoid, channel) ? 2 : 1;
}

// Whether the companions' times are those of the channel.
bool Overlap(const Recording& recording, const StreamMap& stream, std::string* why) {
  const Channel& own = recording.channels()[stream.channel.front()];
  for (std::size_t i = 1; i < stream.channel.size(); ++i) {
    const Channel& other = recording.channels()[stream.channel[i]];
    if (own.first <= other.last && other.first <= own.last) continue;
    *why = fmt::format(
        "{}: {} covers {:.3f} to {:.3f} s and {} {:.3f} to {:.3f} s: they do not overlap in time, "
        "so they can't be joined; give files of one flight",
        recording.file(), own.Label(), ToSeconds(own.first), ToSeconds(own.last), other.Label(),
        ToSeconds(other.first), ToSeconds(other.last));
    return false;
  }
  return true;
}

bool HasColumns(const Recording& recording, StreamMap stream, std::string* why) {
  try {
    BindColumns(ChannelRow(recording, stream.channel), &stream);
    return true;
  } catch (const InputError& error) {
    *why = error.what();
    return false;
  }
}

}  // namespace

std::vector<StreamCandidate> FindCandidates(const Recording& recording, const StreamMap& stream,
                                            std::string* why) {
  std::vector<StreamMap> all = stream.Alternatives();
  std::vector<StreamCandidate> candidates;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto companions = FindCompanions(recording, all[i]);
    if (!companions) continue;
    all[i].otherwise.clear();
    for (const auto& [channel, name] : FindChannels(recording, all[i])) {
      StreamMap one = all[i];
      one.channel = {channel};
      one.channel.insert(one.channel.end(), companions->begin(), companions->end());
      if (!HasColumns(recording, one, why) || !Overlap(recording, one, why)) continue;
      candidates.push_back({one, i, RankOf(one, recording.channels()[channel].name), name});
    }
  }
  return candidates;
}

std::vector<std::string> UndecodableChannels(const Recording& recording, const StreamMap& stream) {
  const std::vector<StreamMap> all = stream.Alternatives();
  std::vector<std::string> labels;
  for (const Channel& channel : recording.channels()) {
    if (channel.count == 0 || !channel.fields.empty()) continue;
    const bool fits = std::any_of(all.begin(), all.end(), [&](const StreamMap& one) {
      return one.type.empty() ? FitsAny(one.channels, channel.name)
                              : RosTypeName(one.type) == RosTypeName(channel.type);
    });
    if (fits) labels.push_back(channel.Label());
  }
  return labels;
}

}  // namespace trueline
