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

std::vector<std::size_t> FindByNames(const Recording& recording,
                                     const std::vector<std::string>& patterns) {
  std::vector<std::size_t> found;
  for (const std::string& pattern : patterns) {
    const auto channel = FindByName(recording, pattern);
    const bool is_new = channel && std::find(found.begin(), found.end(), *channel) == found.end();
    if (is_new) found.push_back(*channel);
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

std::vector<std::size_t> FindByType(const Recording& recording, const std::string& type) {
  const std::vector<Channel>& channels = recording.channels();
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (!HasRecords(channels[i]) || RosTypeName(channels[i].type) != RosTypeName(type)) continue;
    if (!IsSetpoint(channels[i].name)) found.push_back(i);
  }
  std::stable_sort(found.begin(), found.end(), [&](std::size_t a, std::size_t b) {
    return channels[a].count > channels[b].count;
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
std::vector<std::size_t> FindChannels(const Recording& recording, const StreamMap& stream) {
  if (recording.format().key == std::string(kCsvFormat)) {
    return std::vector<std::size_t>(recording.channels().empty() ? 0 : 1, 0);
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
  std::vector<StreamMap> all = {stream};
  all.insert(all.end(), stream.otherwise.begin(), stream.otherwise.end());
  std::vector<StreamCandidate> candidates;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto companions = FindCompanions(recording, all[i]);
    if (!companions) continue;
    all[i].otherwise.clear();
    for (const std::size_t channel : FindChannels(recording, all[i])) {
      StreamMap one = all[i];
      one.channel = {channel};
      one.channel.insert(one.channel.end(), companions->begin(), companions->end());
      if (!HasColumns(recording, one, why)) continue;
      candidates.push_back({one, i, RankOf(one, recording.channels()[channel].name)});
    }
  }
  return candidates;
}

}  // namespace trueline
