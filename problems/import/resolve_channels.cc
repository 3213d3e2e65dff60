#include "problems/import/resolve_channels.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <deque>
#include <tuple>

#include "problems/import/channel_row.h"
#include "problems/import/find_channels.h"

namespace trueline {
namespace {

// A candidate is useful from as many rows on, or from this share of the most that another one has.
constexpr std::size_t kUsefulRows = 10;
constexpr double kUsefulShare = 0.1;
// ... if its rows cover this share of the longest time that one of its rank or a better one covers.
constexpr double kLeastCoverShare = 0.25;
constexpr double kShortCover = 5.0;  // s; where none covers more, the rows alone count
constexpr double kMuchLonger = 2.0;  // a candidate that covers so many times as much is named

struct Counted {
  StreamCandidate candidate;
  std::size_t rows = 0;  // that become samples
  double covered = 0.0;  // s, by them
  bool is_poor = false;  // another instance has more than twice the rows
};

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

// By stream.
using Candidates = std::map<std::string, std::vector<Counted>>;

std::unique_ptr<StreamImport> MakeTrial(const std::string& name, const StreamMap& stream,
                                        const std::string& file, FlightLog* log) {
  ImportMap map;
  map.streams[name] = stream;
  map.streams[name].input = 0;
  map.streams[name].unsorted = Unsorted::kSort;  // the order of rows is no reason to refuse it
  return std::move(MakeImports(map, {file}, std::nullopt, log).front());
}

// Reads the candidates of streams that have several, on trial and into logs of their own.
void CountRows(Recording* recording, Candidates* candidates) {
  std::deque<FlightLog> trials;
  std::vector<std::unique_ptr<StreamImport>> imports;
  std::vector<StreamImport*> streams;
  std::vector<Counted*> counted;
  for (auto& [name, all] : *candidates) {
    if (all.size() == 1) continue;
    for (Counted& one : all) {
      imports.push_back(
          MakeTrial(name, one.candidate.stream, recording->file(), &trials.emplace_back()));
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

bool AreInstances(const StreamCandidate& a, const StreamCandidate& b) {
  return a.stream.type.empty() && a.rank == b.rank && a.alternative == b.alternative &&
         a.name == b.name;
}

void FindPoorInstances(std::vector<Counted>* counted) {
  for (Counted& one : *counted) {
    one.is_poor = std::any_of(counted->begin(), counted->end(), [&](const Counted& other) {
      return AreInstances(one.candidate, other.candidate) && other.rows > 2 * one.rows;
    });
  }
}

// By rank, then in the order of the map; channels of one type by their rows, instances of one name
// by their numbers, those with few rows last.
void SortByPreference(std::vector<Counted>* counted) {
  FindPoorInstances(counted);
  const auto key = [](const Counted& c) {
    const std::size_t by_rows = c.candidate.stream.type.empty() ? 0 : c.rows;
    return std::tuple(c.candidate.rank, c.candidate.alternative, c.candidate.name, c.is_poor,
                      -static_cast<double>(by_rows));
  };
  std::stable_sort(counted->begin(), counted->end(),
                   [&](const Counted& a, const Counted& b) { return key(a) < key(b); });
}

bool HasUsefulRows(const Counted& one, const std::vector<Counted>& all) {
  const auto most = std::max_element(all.begin(), all.end(),
                                     [](const auto& a, const auto& b) { return a.rows < b.rows; });
  return one.rows >= kUsefulRows ||
         static_cast<double>(one.rows) >= kUsefulShare * static_cast<double>(most->rows);
}

// s, of the candidates that do not count after `one` by their rank.
double LongestCover(const Counted& one, const std::vector<Counted>& all) {
  double longest = 0.0;
  for (const Counted& other : all) {
    if (other.candidate.rank <= one.candidate.rank) longest = std::max(longest, other.covered);
  }
  return longest;
}

bool CoversEnough(const Counted& one, const std::vector<Counted>& all) {
  const double longest = LongestCover(one, all);
  return longest < kShortCover || one.covered >= kLeastCoverShare * longest;
}

bool IsUseful(const Counted& one, const std::vector<Counted>& all) {
  return HasUsefulRows(one, all) && CoversEnough(one, all);
}

std::string LabelOf(const Recording& recording, const Counted& one) {
  return fmt::format("{} ({} usable rows)",
                     recording.channels()[one.candidate.stream.channel.front()].Label(), one.rows);
}

// Not merely another definition of the same channel, of which WarnOfTwin() tells.
bool IsOtherInstance(const Recording& recording, const StreamCandidate& a,
                     const StreamCandidate& b) {
  const auto label = [&](const StreamCandidate& one) {
    return recording.channels()[one.stream.channel.front()].Label();
  };
  return AreInstances(a, b) && label(a) != label(b);
}

bool IsLowerInstance(const Recording& recording, const StreamCandidate& a,
                     const StreamCandidate& b) {
  const auto instance = [&](const StreamCandidate& one) {
    return recording.channels()[one.stream.channel.front()].instance;
  };
  return instance(a) < instance(b);
}

// Channels that are not used for a stream, by reason.
struct Rivals {
  std::vector<std::string> poor, brief;    // before the chosen one: few rows, a short time
  std::vector<std::string> longer, alike;  // after it: cover more, would do as well

  bool None() const { return poor.empty() && brief.empty() && longer.empty() && alike.empty(); }
};

Rivals RivalsOf(const Recording& recording, const std::vector<Counted>& counted,
                std::size_t chosen) {
  const StreamCandidate& taken = counted[chosen].candidate;
  const auto cover_of = [&](const Counted& one) {
    return fmt::format("{} for {:.1f} s", LabelOf(recording, one), one.covered);
  };
  Rivals rivals;
  for (std::size_t i = 0; i < counted.size(); ++i) {
    const StreamCandidate& other = counted[i].candidate;
    if (i == chosen || other.stream.channel == taken.stream.channel) continue;
    const bool same_type = !taken.stream.type.empty() && other.alternative == taken.alternative;
    const bool has_rows = HasUsefulRows(counted[i], counted);
    if (i < chosen && has_rows) {
      rivals.brief.push_back(cover_of(counted[i]));
      continue;
    }
    if (i < chosen) {
      rivals.poor.push_back(LabelOf(recording, counted[i]));
      continue;
    }
    if (counted[i].is_poor && AreInstances(taken, other)) {
      if (IsLowerInstance(recording, other, taken)) {
        rivals.poor.push_back(LabelOf(recording, counted[i]));
      }
      continue;
    }
    const bool is_longer = counted[i].covered >= kShortCover &&
                           counted[i].covered > kMuchLonger * counted[chosen].covered;
    if (is_longer && has_rows) {
      rivals.longer.push_back(cover_of(counted[i]));
      continue;
    }
    const bool is_like = same_type || IsOtherInstance(recording, taken, other);
    if (is_like && IsUseful(counted[i], counted)) {
      rivals.alike.push_back(LabelOf(recording, counted[i]));
    }
  }
  return rivals;
}

// States why the channel is not the first of the map, and which others of its type or name are
// there.
void WarnOfRivals(const std::string& name, const Recording& recording,
                  const std::vector<Counted>& counted, std::size_t chosen,
                  std::vector<std::string>* warnings) {
  const Rivals rivals = RivalsOf(recording, counted, chosen);
  if (rivals.None()) return;
  std::string text = fmt::format("{}: stream '{}' is read from {}", recording.file(), name,
                                 LabelOf(recording, counted[chosen]));
  if (!rivals.poor.empty())
    text += fmt::format("; too few are in {}", fmt::join(rivals.poor, ", "));
  if (!rivals.brief.empty()) {
    text += fmt::format("; too short a time is covered by {}, where that has {:.1f} s",
                        fmt::join(rivals.brief, ", "), counted[chosen].covered);
  }
  if (!rivals.longer.empty()) {
    text += fmt::format(
        "; it covers {:.1f} s, and {} would cover more: name it by 'channel' in a map to read it "
        "instead",
        counted[chosen].covered, fmt::join(rivals.longer, ", "));
  }
  if (!rivals.alike.empty()) {
    text += fmt::format("; {} would do, too: name it by 'channel' in a map to read it instead",
                        fmt::join(rivals.alike, ", "));
  }
  warnings->push_back(text);
}

// The first useful candidate of the sorted ones; where those with enough rows cover too little, and
// the others the reverse, the one with the most rows.
std::size_t FirstUseful(const std::vector<Counted>& counted) {
  std::size_t most = 0;
  for (std::size_t i = 0; i < counted.size(); ++i) {
    if (IsUseful(counted[i], counted)) return i;
    if (counted[i].rows > counted[most].rows) most = i;
  }
  return most;
}

StreamMap Choose(const std::string& name, std::vector<Counted> counted, const Recording& recording,
                 std::vector<std::string>* warnings) {
  if (counted.size() == 1) return counted.front().candidate.stream;
  SortByPreference(&counted);
  const std::size_t chosen = FirstUseful(counted);
  WarnOfRivals(name, recording, counted, chosen, warnings);
  return counted[chosen].candidate.stream;
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
  Candidates candidates;
  std::vector<std::string> lacking;  // optional streams
  for (const auto& [name, stream] : streams) {
    std::string why;
    for (const StreamCandidate& one : FindCandidates(*recording, stream, &why)) {
      candidates[name].push_back({one});
    }
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
