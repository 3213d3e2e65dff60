#include <fmt/ranges.h>
#include <fnmatch.h>

#include <algorithm>
#include <deque>
#include <tuple>

#include "problems/import/channel_row.h"
#include "problems/import/convert.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ros_decoder.h"

namespace trueline {
namespace {

// The channels of a recording that the streams of a map may be read from.

// A stream as one of its alternatives reads it from one of the channels that fit.
struct Candidate {
  StreamMap stream;             // with `channel`, and without `otherwise`
  std::size_t alternative = 0;  // 0: the stream itself, else its place in `otherwise` from 1
  int rank = 0;                 // by `prefer` and `avoid`; the lowest counts first
  std::size_t name = 0;         // place of the channel's name in the map; instances share it
  std::string label = {};       // of the channel, and which instance it is
  int instance = 0;

  // Where there are several, on trial: rows that become samples, and the time (s) that they cover.
  std::size_t rows = 0;
  double covered = 0.0;
  bool is_poor = false;                      // another instance has more than twice the rows
  bool has_rows = false, is_useful = false;  // enough of them; and they cover enough

  bool IsInstanceOf(const Candidate& o) const {
    return stream.type.empty() && rank == o.rank && alternative == o.alternative && name == o.name;
  }
  std::string Text() const { return fmt::format("{} ({} usable rows)", label, rows); }
};
using Candidates = std::vector<Candidate>;

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

// All that have records and every column, in the order of the map; `why` becomes the last error of
// a column. Of a type, the channel with the most messages comes first; of one name, the instance
// with the lowest number.
Candidates FindCandidates(const Recording& recording, const StreamMap& stream, std::string* why) {
  std::vector<StreamMap> all = stream.Alternatives();
  Candidates candidates;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto companions = FindCompanions(recording, all[i]);
    if (!companions) continue;
    all[i].otherwise.clear();
    for (const auto& [channel, name] : FindChannels(recording, all[i])) {
      const Channel& read = recording.channels()[channel];
      StreamMap one = all[i];
      one.channel = {channel};
      one.channel.insert(one.channel.end(), companions->begin(), companions->end());
      if (!HasColumns(recording, one, why) || !Overlap(recording, one, why)) continue;
      candidates.push_back({one, i, RankOf(one, read.name), name, read.Label(), read.instance});
    }
  }
  return candidates;
}

// Labels of channels that fit by name or type, and of whose messages none can be decoded.
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

std::string Wanted(const StreamMap& stream) {
  std::vector<std::string> names;
  for (const StreamMap& one : stream.Alternatives()) {
    if (!one.type.empty()) names.push_back("type " + one.type);
    names.insert(names.end(), one.channels.begin(), one.channels.end());
    names.insert(names.end(), one.with.begin(), one.with.end());
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return fmt::format("{}", fmt::join(names, ", "));
}

std::unique_ptr<StreamImport> MakeTrial(const std::string& name, const StreamMap& stream,
                                        const std::string& file, FlightLog* log) {
  ImportMap map;
  map.streams[name] = stream;
  map.streams[name].input = 0;
  map.streams[name].unsorted = Unsorted::kSort;  // the order of rows is no reason to refuse it
  return std::move(MakeImports(map, {file}, std::nullopt, log).front());
}

// Reads the candidates of streams that have several, on trial and into logs of their own.
void CountRows(Recording* recording, std::map<std::string, Candidates>* candidates) {
  std::deque<FlightLog> trials;
  std::vector<std::unique_ptr<StreamImport>> imports;
  std::vector<StreamImport*> streams;
  std::vector<Candidate*> counted;
  for (auto& [name, all] : *candidates) {
    if (all.size() == 1) continue;
    for (Candidate& one : all) {
      imports.push_back(MakeTrial(name, one.stream, recording->file(), &trials.emplace_back()));
      streams.push_back(imports.back().get());
      counted.push_back(&one);
    }
  }
  if (streams.empty()) return;
  ReadChannels(recording, streams);
  for (std::size_t i = 0; i < streams.size(); ++i) {
    counted[i]->rows = streams[i]->rows();
    counted[i]->covered = streams[i]->Covered();
  }
}

constexpr double kShortCover = 5.0;  // s; where none covers more, the rows alone count
constexpr double kMuchLonger = 2.0;  // a candidate that covers so many times as much is named

// A candidate is useful that has ten rows, or a tenth of the most that one has, if they cover a
// quarter of the longest time that one of its rank or a better one covers.
void Judge(Candidates* all) {
  const auto most = std::ranges::max_element(*all, {}, &Candidate::rows)->rows;
  for (Candidate& one : *all) {
    double longest = 0.0;
    for (const Candidate& other : *all) {
      if (other.rank <= one.rank) longest = std::max(longest, other.covered);
      one.is_poor = one.is_poor || (one.IsInstanceOf(other) && other.rows > 2 * one.rows);
    }
    one.has_rows = one.rows >= 10 || 10 * one.rows >= most;
    one.is_useful = one.has_rows && (longest < kShortCover || one.covered >= 0.25 * longest);
  }
}

// By rank, then in the order of the map; channels of one type by their rows, instances of one name
// by their numbers, those with few rows last.
void SortByPreference(Candidates* all) {
  const auto key = [](const Candidate& c) {
    const std::size_t by_rows = c.stream.type.empty() ? 0 : c.rows;
    return std::tuple(c.rank, c.alternative, c.name, c.is_poor, -static_cast<double>(by_rows));
  };
  std::ranges::stable_sort(*all, {}, key);
}

// States why the channel is not the first of the map, and which others of its type or name are
// there.
void WarnOfRivals(const std::string& name, const Recording& recording, const Candidates& all,
                  std::size_t chosen, std::vector<std::string>* warnings) {
  const Candidate& taken = all[chosen];
  // Before the chosen one: few rows, a short time; after it: cover more, would do as well.
  std::vector<std::string> poor, brief, longer, alike;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Candidate& other = all[i];
    if (i == chosen || other.stream.channel == taken.stream.channel) continue;
    const std::string text = other.Text(),
                      with_cover = fmt::format("{} for {:.1f} s", text, other.covered);
    const bool is_instance = taken.IsInstanceOf(other);
    const bool same_type = !taken.stream.type.empty() && other.alternative == taken.alternative;
    if (i < chosen) {
      other.has_rows ? brief.push_back(with_cover) : poor.push_back(text);
    } else if (other.is_poor && is_instance) {
      if (other.instance < taken.instance) poor.push_back(text);
    } else if (other.has_rows && other.covered >= kShortCover &&
               other.covered > kMuchLonger * taken.covered) {
      longer.push_back(with_cover);
    } else if (other.is_useful && (same_type || (is_instance && other.label != taken.label))) {
      alike.push_back(text);  // and no other definition of the same channel, see WarnOfTwin()
    }
  }
  std::string text;
  const auto add = [&](const std::vector<std::string>& rivals, const char* words) {
    if (rivals.empty()) return;
    text += fmt::format(fmt::runtime(words), fmt::arg("rivals", fmt::join(rivals, ", ")),
                        fmt::arg("covered", fmt::format("{:.1f} s", taken.covered)));
  };
  add(poor, "; too few are in {rivals}");
  add(brief, "; too short a time is covered by {rivals}, where that has {covered}");
  add(longer,
      "; it covers {covered}, and {rivals} would cover more: name it by 'channel' in a map "
      "to read it instead");
  add(alike, "; {rivals} would do, too: name it by 'channel' in a map to read it instead");
  if (text.empty()) return;
  warnings->push_back(
      fmt::format("{}: stream '{}' is read from {}{}", recording.file(), name, taken.Text(), text));
}

// The first useful candidate of the sorted ones; where those with enough rows cover too little, and
// the others the reverse, the one with the most rows.
StreamMap Choose(const std::string& name, Candidates all, const Recording& recording,
                 std::vector<std::string>* warnings) {
  if (all.size() == 1) return all.front().stream;
  Judge(&all);
  SortByPreference(&all);
  auto chosen = std::ranges::find(all, true, &Candidate::is_useful);
  if (chosen == all.end()) chosen = std::ranges::max_element(all, {}, &Candidate::rows);
  const auto place = static_cast<std::size_t>(chosen - all.begin());
  WarnOfRivals(name, recording, all, place, warnings);
  return chosen->stream;
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

// Throws for a stream that the log lacks and that is not optional.
void RefuseLack(const std::string& name, const StreamMap& stream, const Recording& recording,
                const std::string& why) {
  const std::string lack = why.empty() ? fmt::format("{}: has no records of {} for stream '{}'",
                                                     recording.file(), Wanted(stream), name)
                                       : why;
  if (name == "imu") {
    const bool is_apart = lack.find("do not overlap") != std::string::npos;
    throw NoUsableLog(lack + (is_apart ? "" : "; log the IMU's samples, at 100 Hz or more"));
  }
  if (!stream.optional) throw InputError(lack + "; correct 'channel', or set 'optional: true'");
}

// The streams that come from one recording.
std::map<std::string, StreamMap> ResolveInput(const std::map<std::string, StreamMap>& streams,
                                              Recording* recording,
                                              std::vector<std::string>* warnings) {
  std::map<std::string, Candidates> candidates;
  std::vector<std::string> lacking;  // optional streams
  for (const auto& [name, stream] : streams) {
    std::string why;
    Candidates found = FindCandidates(*recording, stream, &why);
    if (!found.empty()) candidates[name] = std::move(found);
    if (candidates.contains(name)) continue;
    RefuseLack(name, stream, *recording, why);
    const std::vector<std::string> undecoded = UndecodableChannels(*recording, stream);
    if (undecoded.empty()) {
      lacking.push_back(fmt::format("{} ({})", name, Wanted(stream)));
    } else {
      warnings->push_back(fmt::format(
          "{}: stream '{}' is left out: {} would do, but none of its messages can be decoded: "
          "their definition is missing or does not fit them; record again as MCAP, which stores "
          "it",
          recording->file(), name, fmt::join(undecoded, ", ")));
    }
  }
  CountRows(recording, &candidates);
  std::map<std::string, StreamMap> resolved;
  for (const auto& [name, counted] : candidates) {
    resolved[name] = Choose(name, counted, *recording, warnings);
    for (const std::size_t channel : resolved[name].channel) {
      WarnOfTwin(*recording, channel, warnings);
    }
  }
  if (!lacking.empty()) {
    warnings->push_back(fmt::format("{}: has none of these streams, which would be read, too: {}",
                                    recording->file(), fmt::join(lacking, "; ")));
  }
  return resolved;
}

}  // namespace

std::map<std::string, StreamMap> ResolveChannels(const ImportMap& map, const Recordings& recordings,
                                                 std::vector<std::string>* warnings) {
  std::map<std::string, StreamMap> resolved;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    std::map<std::string, StreamMap> streams = map.streams;
    std::erase_if(streams, [i](const auto& stream) { return stream.second.input != i; });
    if (recordings[i]) streams = ResolveInput(streams, recordings[i].get(), warnings);
    resolved.merge(streams);
  }
  return resolved;
}

int CountStreams(const ImportMap& map, const Recording& recording) {
  int count = 0;
  for (const auto& [name, stream] : map.streams) {
    std::string why;
    if (!FindCandidates(recording, stream, &why).empty()) {
      ++count;
    } else if (!stream.optional) {
      return 0;
    }
  }
  return count;
}

}  // namespace trueline
