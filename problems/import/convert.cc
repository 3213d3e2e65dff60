#include "problems/import/convert.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/import/channel_row.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/stamp_reader.h"
#include "problems/import/stream_import.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

// The part of a log that is kept.

struct Span {
  TimeNs from = std::numeric_limits<TimeNs>::min();
  TimeNs to = std::numeric_limits<TimeNs>::max();
};

Span SpanOfTimes(const CutOptions& options, TimeNs start) {
  Span span;
  const TimeNs origin = options.relative_to_start ? start : 0;
  if (options.from) span.from = origin + FromSeconds(*options.from);
  if (options.to) span.to = origin + FromSeconds(*options.to);
  return span;
}

constexpr double kAtEnds = 0.5;  // s, over which the vehicle moves or stands
constexpr double kMoves = 0.3;   // m/s

// Whether the vehicle moves where its mocap begins, or, by reversed iterators, ends.
template <typename Iterator>
bool Moves(Iterator first, Iterator last) {
  const auto later = std::find_if(first, last, [&](const PoseSample& pose) {
    return std::abs(SecondsBetween(first->t, pose.t)) >= kAtEnds;
  });
  if (later == last) return false;
  const double seconds = std::abs(SecondsBetween(first->t, later->t));
  return (later->p_E - first->p_E).norm() > kMoves * seconds;
}

// From the first to the last mocap sample above the height; z points down. A recording that begins
// or ends in flight is kept from its start, or to its end.
Span AirborneSpan(const CutOptions& options, const std::vector<PoseSample>& mocap,
                  const std::string& map_file) {
  const bool begins_in_flight = Moves(mocap.begin(), mocap.end());
  const bool ends_in_flight = Moves(mocap.rbegin(), mocap.rend());
  if (begins_in_flight && ends_in_flight) return {};
  const double ground = (begins_in_flight ? mocap.back() : mocap.front()).p_E.z();
  const auto high = [&](const PoseSample& pose) {
    return ground - pose.p_E.z() > *options.min_height;
  };
  const auto first = std::find_if(mocap.begin(), mocap.end(), high);
  const auto last = std::find_if(mocap.rbegin(), mocap.rend(), high);
  if (first == mocap.end()) {
    throw ErrorAt(map_file, 0,
                  fmt::format("'cut.airborne': mocap never rises {} m above its start; "
                              "lower 'min_height'",
                              *options.min_height));
  }
  const TimeNs margin = FromSeconds(options.margin);
  Span span;
  if (!begins_in_flight) span.from = first->t + margin;
  if (!ends_in_flight) span.to = last->t - margin;
  return span;
}

// Removes all samples outside of the cut from every stream. Throws InputError naming `map_file` if
// no IMU sample remains, or if a height is given and there is no mocap.
void CutLog(const CutOptions& options, const std::string& map_file, FlightLog* log) {
  if (!options.from && !options.to && !options.min_height) return;
  if (log->imu.empty()) throw ErrorAt(map_file, 0, "'cut' needs the stream 'imu'; remove it");
  Span span = SpanOfTimes(options, log->imu.front().t);
  if (options.min_height) {
    if (log->mocap.empty()) {
      throw ErrorAt(map_file, 0, "'cut.airborne' needs the stream 'mocap'; use 'from' and 'to'");
    }
    const Span airborne = AirborneSpan(options, log->mocap, map_file);
    span = {std::max(span.from, airborne.from), std::min(span.to, airborne.to)};
  }
  const TimeNs start = log->imu.front().t;
  const TimeNs end = log->imu.back().t;
  ForEachStream(*log, [&](const Stream&, auto& samples) {
    std::erase_if(samples, [&](const auto& s) { return s.t < span.from || s.t > span.to; });
  });
  if (log->imu.empty()) {
    throw ErrorAt(map_file, 0,
                  fmt::format("'cut' leaves nothing of the IMU, which lasts from {} s "
                              "to {} s; widen it",
                              TimeText(start), TimeText(end)));
  }
}

ClockPart LongestOf(const std::vector<ClockPart>& parts) {
  return *std::max_element(parts.begin(), parts.end(), [](const ClockPart& a, const ClockPart& b) {
    return a.count < b.count;
  });
}

std::string StepText(const std::string& file, const std::string& stream,
                     const std::vector<ClockPart>& parts) {
  return fmt::format("{}: the clock of '{}' steps back {}, at first from {:.3f} s to {:.3f} s",
                     file, stream,
                     parts.size() == 2 ? "once" : fmt::format("{} times", parts.size() - 1),
                     ToSeconds(parts[0].to), ToSeconds(parts[1].from));
}

// Warning: parts overlap in time; the longest is kept.
std::string RestartWarning(const std::string& file, const std::string& stream,
                           const std::vector<ClockPart>& parts, std::size_t left_out) {
  const ClockPart kept = LongestOf(parts);
  return fmt::format(
      "{}, as after a restart: the parts have the same times, so they can't be in one log. The "
      "longest is kept, from {:.3f} s to {:.3f} s, and {} rows of the others are left out; cut the "
      "file there to convert them",
      StepText(file, stream, parts), ToSeconds(kept.from), ToSeconds(kept.to), left_out);
}

// Warning: the clock steps back and parts do not overlap (a restart, or a file whose blocks are out
// of place); sorted by time.
std::string OrderWarning(const std::string& file, const std::string& stream,
                         const std::vector<ClockPart>& parts) {
  return fmt::format(
      "{}, as after a restart, or where blocks of the file are out of place: the parts do not "
      "overlap and are put in the order of time; if they are of several flights, keep one by 'cut' "
      "in the map",
      StepText(file, stream, parts));
}

// Of parts that overlap in time. The stream with most rows knows best where the clock steps back;
// where it does, all streams do. `tells_order`: whether parts that do not overlap are news.
void KeepOnePart(const std::string& file, bool tells_order,
                 const std::vector<StreamImport*>& streams, std::vector<std::string>* warnings) {
  std::vector<ClockPart> parts;
  const char* name = "";
  std::size_t most = 0;
  for (const StreamImport* stream : streams) {
    std::vector<ClockPart> own = stream->Parts();
    std::size_t rows = 0;
    for (const ClockPart& part : own) rows += part.count;
    if (rows <= most) continue;
    most = rows;
    parts = std::move(own);
    name = stream->name();
  }
  if (parts.size() > 1 && !AnyOverlap(parts) && tells_order) {
    warnings->push_back(OrderWarning(file, name, parts));
  }
  if (!AnyOverlap(parts)) return;
  // The first and the last rows of other streams may lie before and after those of this one.
  parts.back().end = std::numeric_limits<std::size_t>::max();
  std::size_t left_out = 0;
  for (StreamImport* stream : streams) left_out += stream->Keep(LongestOf(parts));
  warnings->push_back(RestartWarning(file, name, parts, left_out));
}

// Reads the rows of one file for the streams that come from it.
void ReadFile(const std::string& file, const CsvDialect& dialect,
              const std::vector<StreamImport*>& streams, std::vector<std::string>* warnings) {
  ForeignCsv csv(file, dialect, warnings);
  bool any = false;
  for (; csv.Next(); any = true) {
    for (StreamImport* stream : streams) stream->AddRow(csv);
  }
  if (!any) throw ErrorAt(file, 0, "has no rows; give the path of a recorded log");
  KeepOnePart(file, true, streams, warnings);
  // A stream may have a clock of its own.
  for (StreamImport* stream : streams) KeepOnePart(file, false, {stream}, warnings);
  for (StreamImport* stream : streams) stream->Finish(warnings);
}

// Reads the streams that come from a recording.
void ReadRecording(Recording* recording, const std::vector<StreamImport*>& streams,
                   std::vector<std::string>* warnings) {
  const std::map<std::size_t, std::size_t> undecoded = ReadChannels(recording, streams);
  const std::vector<std::string>& damage = recording->warnings();
  warnings->insert(warnings->end(), damage.begin(), damage.end());
  for (const auto& [channel, count] : undecoded) {
    if (count == 0) continue;
    warnings->push_back(fmt::format("{}: {} messages of {} are cut or malformed; they are left out",
                                    recording->file(), count,
                                    recording->channels()[channel].Label()));
  }
  const RecordOrder order = recording->format().order;
  if (order != RecordOrder::kFiles) {
    KeepOnePart(recording->file(), order == RecordOrder::kTime, streams, warnings);
  }
  for (StreamImport* stream : streams) KeepOnePart(recording->file(), false, {stream}, warnings);
  try {
    for (StreamImport* stream : streams) stream->Finish(warnings);
  } catch (const InputError& error) {  // known damage may be the reason
    throw InputError(fmt::format("{}{}{}", error.what(), damage.empty() ? "" : "; besides, ",
                                 fmt::join(damage, "; ")));
  }
}

bool Contains(const std::vector<std::string>& formats, const std::string& key) {
  return std::find(formats.begin(), formats.end(), key) != formats.end();
}

// Opens the inputs that are no CSV.
Recordings OpenRecordings(const ImportMap& map, const std::vector<std::string>& files) {
  Recordings recordings(files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::vector<std::string>& formats = map.inputs[i].formats;
    if (formats.empty()) {
      const std::string key = FormatOf(files[i]);
      if (key.empty() || IsTextFormat(key)) continue;
      throw ErrorAt(files[i], 0,
                    fmt::format("is of format {}, where {} reads CSV; leave out --map, or state "
                                "'format' in it",
                                key, map.file));
    }
    const std::vector<std::string> tables = TablesIn(SplitPaths(files[i]));
    const bool are_tables = std::ranges::all_of(tables, IsTable);
    if (are_tables) recordings[i] = OpenTables(tables);
    const bool fits = are_tables && Contains(formats, recordings[i]->format().key);
    if (!fits) recordings[i] = OpenRecording(files[i]);
    const LogFormat& found = recordings[i]->format();
    if (Contains(formats, found.key)) continue;
    const std::string why = found.key == std::string(kCsvFormat) ? WhyNoTrajectory(files[i]) : "";
    throw ErrorAt(
        files[i], 0,
        fmt::format("is of format {} ({}), where {} is for {}; give another map, or none{}{}",
                    found.key, found.name, map.file, fmt::join(formats, ", "),
                    why.empty() ? "" : ". As a trajectory: ", why));
  }
  return recordings;
}

// Of a file, or of all files of a folder, in the order of their names.
std::string Sha256OfLog(const std::string& path) {
  if (!std::filesystem::is_directory(path)) return Sha256OfFile(path);
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  std::string digests;
  for (const std::string& file : files) digests += Sha256OfFile(file);
  return Sha256OfText(digests);
}

// The last part of a path; a folder may be given with a slash at its end.
std::filesystem::path NameOfLog(const std::filesystem::path& path) {
  return path.has_filename() ? path.filename() : path.parent_path().filename();
}

void RequireOneFileForEachInput(const ImportMap& map, const std::vector<std::string>& files) {
  if (files.size() == map.inputs.size()) return;
  std::vector<std::string> names;
  for (const InputMap& input : map.inputs) names.push_back(input.name);
  throw InputError(fmt::format("{} needs {} files, in this order: {}; found {}", map.file,
                               names.size(), fmt::join(names, ", "), files.size()));
}

std::string LogName(const ImportMap& map, const std::string& file) {
  std::string name = map.name;
  std::filesystem::path stem = NameOfLog(SplitPaths(file).front());
  const auto is_packing = [](const std::filesystem::path& ending) {
    for (const char* one : {".gz", ".bz2", ".xz", ".zst", ".zstd", ".zip", ".tar", ".tgz"}) {
      if (ending == one) return true;
    }
    return false;
  };
  while (is_packing(stem.extension())) stem = stem.stem();
  stem = stem.stem();
  const std::size_t place = name.find("{stem}");
  if (place != std::string::npos) name.replace(place, 6, stem.string());
  return name;
}

void Describe(const ImportMap& map, const std::vector<std::string>& files, FlightLog* log) {
  log->name = LogName(map, files.front());
  log->gravity = map.gravity;
  log->environment = map.environment;
  log->gates = map.gates;
  log->vehicle = map.vehicle;
  std::vector<std::string> names;
  std::vector<std::string> digests;
  for (const std::string& input : files) {
    for (const std::string& file : SplitPaths(input)) {
      names.push_back(NameOfLog(file).string());
      digests.push_back(Sha256OfLog(file));
    }
  }
  log->source = {{"file", fmt::format("{}", fmt::join(names, ", "))},
                 {"sha256", fmt::format("{}", fmt::join(digests, ", "))}};
  if (!map.dataset.empty()) log->source["dataset"] = map.dataset;
}

// States in `source` the channels that each stream of a recording is read from.
void DescribeChannels(const std::map<std::string, StreamMap>& streams, const Recordings& recordings,
                      FlightLog* log) {
  for (const auto& [name, stream] : streams) {
    if (!recordings[stream.input]) continue;
    std::vector<std::string> labels;
    for (const std::size_t channel : stream.channel) {
      labels.push_back(recordings[stream.input]->channels()[channel].Label());
    }
    log->source[name] = fmt::format("{}", fmt::join(labels, " + "));
  }
}

// The straights: given for the first pattern that matches the file's name, or found by curvature.
std::vector<Straight> StraightsOf(const FixesFromMocap& options, const std::string& file,
                                  const std::vector<PoseSample>& mocap) {
  for (const StraightsMap& straights : options.straights) {
    if (!Fits(straights.pattern, file)) continue;
    if (straights.boxes.empty()) return FindStraights(mocap, straights.curvature, options.limits);
    return StraightsInBoxes(mocap, straights.boxes, options.limits);
  }
  return FindStraights(mocap, {}, options.limits);
}

std::string LengthOf(const std::vector<PoseSample>& mocap) {
  if (mocap.size() < 2) return fmt::format("of {} samples", mocap.size());
  const double seconds = SecondsBetween(mocap.front().t, mocap.back().t);
  return fmt::format("which lasts {:.3g} s at {:.3g} Hz", seconds,
                     static_cast<double>(mocap.size() - 1) / seconds);
}

void AddSampledFixes(const FixesFromMocap& options, const std::string& file, std::uint64_t seed,
                     FlightLog* log) {
  const std::vector<Straight> straights = StraightsOf(options, file, log->mocap);
  if (straights.empty()) {
    throw ErrorAt(file, 0,
                  fmt::format("mocap, {}, shows no straight to sample fixes on; if these are not "
                              "its times, state their unit, else state 'straights' in the map, or "
                              "raise 'max_curvature' or 'flattest_share'",
                              LengthOf(log->mocap)));
  }
  Random random(seed, "fixes");
  log->fixes = SampleFixes(log->mocap, straights, options.sampler, random);
  log->gates = GatesOf(straights);
}

// Vectors of a CSV file by time.
Series ReadSeries(const std::string& file, const InputMap& input, NumberSource numbers) {
  std::vector<std::string> unused;
  ForeignCsv csv(file, input.dialect, &unused);
  StampReader stamps(input.time, file);
  std::vector<std::pair<TimeNs, Eigen::Vector3d>> rows;
  for (bool bound = false; csv.Next();) {
    if (!bound) numbers.Bind(csv);
    if (!bound) stamps.Bind(csv);
    bound = true;
    const std::vector<double> v = numbers.Values(csv);
    const Eigen::Vector3d value(v[0], v[1], v[2]);
    if (value.allFinite()) rows.emplace_back(stamps.Read(csv), value);
  }
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  Series series;
  for (const auto& [t, value] : rows) {
    if (!series.t.empty() && series.t.back() == t) continue;
    series.t.push_back(t);
    series.values.push_back(value);
  }
  return series;
}

std::string SpanText(const std::string& file, const std::vector<TimeNs>& t) {
  if (t.empty()) return file + " has no rows";
  return fmt::format("{} covers {:.3f} to {:.3f} s", file, ToSeconds(t.front()),
                     ToSeconds(t.back()));
}

// Reads the fields that come from another file than their stream.
void JoinInputs(const std::vector<std::string>& files, ImportMap* map) {
  for (auto& [name, stream] : map->streams) {
    for (FieldSource& field : stream.fields) {
      if (!field.input) continue;
      const std::string& other = files[*field.input];
      const auto series =
          std::make_shared<Series>(ReadSeries(other, map->inputs[*field.input], field.numbers));
      const auto own = std::find_if(stream.fields.begin(), stream.fields.end(),
                                    [](const FieldSource& f) { return !f.input; });
      if (own == stream.fields.end() || own->numbers.Constant()) {
        throw InputError(
            fmt::format("{}: stream '{}' takes nothing from its own input", map->file, name));
      }
      const std::string& file = files[stream.input];
      const std::vector<TimeNs> t = ReadSeries(file, map->inputs[stream.input], own->numbers).t;
      if (t.empty() || series->t.empty() || t.front() > series->t.back() ||
          series->t.front() > t.back()) {
        throw InputError(fmt::format(
            "{} for '{}' and {} for '{}' do not overlap in time, so they can't be joined: {}, {}. "
            "Give files of one flight, or state how their clocks differ by `time: {{offset: "
            "...}}` of an input",
            file, name, other, field.key, SpanText(file, t), SpanText(other, series->t)));
      }
      field.series = series;
    }
  }
}

// What the warnings say of its rows, or where to look.
std::string WhyNoImu(const FlightLog& log) {
  for (const std::string& warning : log.warnings) {
    if (!warning.starts_with("imu: rows left out:")) continue;
    const bool missing = warning.find("missing values") != std::string::npos;
    return warning + (missing ? ". Values are missing or not a number throughout: the sensor gave "
                                "none, or the map names the wrong columns"
                              : ". Check 'new_where' and 'accept'");
  }
  return "check 'new_where' and 'accept'";
}

}  // namespace

FlightLog ConvertLog(const ImportMap& map, const std::vector<std::string>& given,
                     const ConvertOptions& options) {
  std::vector<std::string> files = given;
  // A single input of a recording may be in several tables.
  if (map.inputs.size() == 1 && files.size() > 1 && !map.inputs.front().formats.empty()) {
    files = {JoinPaths(files)};
  }
  RequireOneFileForEachInput(map, files);
  FlightLog log;
  Describe(map, files, &log);
  const Recordings recordings = OpenRecordings(map, files);
  ImportMap resolved = map;
  resolved.streams = ResolveChannels(map, recordings, &log.warnings);
  DescribeChannels(resolved.streams, recordings, &log);
  JoinInputs(files, &resolved);
  const auto imports = MakeImports(resolved, files, options.fix_sigma, &log);
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::vector<StreamImport*> of_file;
    for (const auto& stream : imports) {
      if (stream->map().input == i) of_file.push_back(stream.get());
    }
    if (recordings[i]) {
      ReadRecording(recordings[i].get(), of_file, &log.warnings);
    } else {
      ReadFile(files[i], map.inputs[i].dialect, of_file, &log.warnings);
    }
  }
  if (log.imu.empty() && map.streams.contains("imu")) {
    const std::string message = map.file + ": 'streams.imu' keeps no row; " + WhyNoImu(log);
    if (recordings[map.streams.at("imu").input]) throw NoUsableLog(message);
    throw InputError(message);
  }
  CutLog(map.cut, map.file, &log);
  const auto& sampled = options.fixes_from_mocap ? options.fixes_from_mocap : map.fixes_from_mocap;
  if (sampled) AddSampledFixes(*sampled, files.front(), options.seed, &log);
  return log;
}

}  // namespace trueline
