#include "problems/inspection/stuck.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "problems/common/units.h"
#include "problems/import/shared_stamps.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kChance = 1e-9;  // that an ordinary signal stays for as long, in one column

using Values = std::vector<double>;

// Samples first to last - 1 have one value.
struct Run {
  std::size_t first = 0, last = 0;
  std::size_t repeats() const { return last - first - 1; }
};

template <class Visit>
void ForEachRunOf(const Values& column, const Visit& visit) {
  const auto same = [&](std::size_t i, std::size_t k) { return column[i] == column[k]; };
  ForEachRun(column.size(), same, [&](std::size_t begin, std::size_t end) {
    visit(Run{begin, end});
  });
}

Run LongestRun(const Values& column) {
  Run longest{0, 1};
  ForEachRunOf(column, [&](const Run& run) {
    if (run.repeats() > longest.repeats()) longest = run;
  });
  return longest;
}

std::size_t RepeatsWithin(const Values& column, const Run& run) {
  std::size_t repeats = 0;
  for (std::size_t i = run.first + 1; i < run.last; ++i) repeats += column[i] == column[i - 1];
  return repeats;
}

// Share of the steps outside the run that repeat, never zero: a step that was not seen may come.
double ShareOutside(const Values& column, const Run& run) {
  const std::size_t all = RepeatsWithin(column, {0, column.size()});
  const auto inside = static_cast<double>(RepeatsWithin(column, run));
  const double steps = static_cast<double>(column.size() - 1 - run.repeats());
  return (static_cast<double>(all) - inside + 1.0) / (steps + 2.0);
}

bool IsCalm(const Sensor& sensor, std::size_t but, const Run& run) {
  for (std::size_t k = 0; k < sensor.columns.size(); ++k) {
    const Values& other = sensor.columns[k];
    const double within = static_cast<double>(RepeatsWithin(other, run)) /
                          static_cast<double>(std::max<std::size_t>(1, run.repeats()));
    if (k != but && within > ShareOutside(other, run) + kHardly) return true;
  }
  return false;
}

Stretch StretchOf(const StreamColumns& stream, const Run& run) {
  return {stream.t[run.first], stream.t[run.last - 1]};
}

// True for a run that an ordinary signal, which repeats as outside of the run, does not make.
bool IsOdd(const Values& column, const Run& run) {
  if (run.last - run.first == column.size()) return false;
  const double log_chance =
      std::log(static_cast<double>(column.size())) +
      static_cast<double>(run.repeats()) * std::log(ShareOutside(column, run));
  return log_chance < std::log(kChance);
}

// A coarse signal that moves slowly keeps its value for long and leaves it by one step. One that
// was stuck returns to where the motion has gone meanwhile.
bool IsSlow(const Values& column, const Run& run) {
  const double step = QuantumOf(column);
  const auto is_near = [&](std::size_t i) {
    return std::abs(column[i] - column[run.first]) < 1.5 * step;
  };
  return (run.first == 0 || is_near(run.first - 1)) &&
         (run.last == column.size() || is_near(run.last));
}

bool IsStuck(const Sensor& sensor, std::size_t k, const Run& run) {
  return IsOdd(sensor.columns[k], run) && !IsCalm(sensor, k, run) &&
         !IsSlow(sensor.columns[k], run);
}

// "x, y and z"
std::string NamesOf(const Sensor& sensor) {
  std::string text = sensor.names.front();
  for (std::size_t k = 1; k < sensor.names.size(); ++k) {
    text += std::string(k + 1 < sensor.names.size() ? ", " : " and ") + sensor.names[k];
  }
  return text;
}

// A number that changes wherever one of the stream's does.
Values ChangesOf(const std::vector<Sensor>& sensors, std::size_t count) {
  Values changes(count, 0.0);
  for (std::size_t i = 1; i < count; ++i) {
    const bool same = std::all_of(sensors.begin(), sensors.end(), [i](const Sensor& sensor) {
      return std::all_of(sensor.columns.begin(), sensor.columns.end(),
                         [i](const Values& column) { return column[i] == column[i - 1]; });
    });
    changes[i] = changes[i - 1] + (same ? 0.0 : 1.0);
  }
  return changes;
}

double TurnOfAttitude(const FlightLog& log, const Stretch& frozen) {
  double turn = 0.0;
  for (std::size_t i = 1; i < log.attitude.size(); ++i) {
    if (!frozen.Holds(log.attitude[i].t)) continue;
    turn += log.attitude[i - 1].q_Ep_I.angularDistance(log.attitude[i].q_Ep_I);
  }
  return turn;
}

// s, of a stretch in which the vehicle turns by `turn`; zero for one that may be at rest.
double SecondsMoving(const Stretch& frozen, double turn) {
  const double seconds = frozen.Seconds();
  return turn >= kMovingRate * std::max(1.0, seconds) ? seconds : 0.0;
}

// Names the longest stretch in which the vehicle moves.
void Judge(const std::string& stream, const std::vector<Stretch>& stretches, Examination* e) {
  const bool imu = stream == "imu";
  Finding finding{&fault::kStuck, stream, Level::kBiases};
  for (const Stretch& frozen : stretches) {
    const double turn = imu ? TurnOfAttitude(e->log, frozen) : TurnOfGyro(e->log, frozen);
    const double seconds = SecondsMoving(frozen, turn);
    if (seconds <= finding.size) continue;
    finding.size = seconds;
    finding.text = fmt::format(
        "{}.csv: no number changes from {:.3f} to {:.3f} s, in which time {} turns by {:.0f} deg",
        stream, ToSeconds(frozen.from), ToSeconds(frozen.until),
        imu ? "the attitude" : "the gyroscope", turn / kDegree);
  }
  if (finding.size == 0.0) return;
  finding.remedy = "leave out the samples that repeat (`new_where` in the map), or cut that part";
  e->Add(finding);
}

constexpr double kTurnWindow = 1.0;  // s

// Mean rates of the gyroscope over windows, without vibration.
std::vector<Eigen::Vector3d> WindowRates(const std::vector<ImuSample>& imu) {
  std::vector<Eigen::Vector3d> rates;
  for (std::size_t begin = 0; begin < imu.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t end = begin;
    while (end < imu.size() && SecondsBetween(imu[begin].t, imu[end].t) < kTurnWindow) {
      sum += imu[end++].gyro;
    }
    if (end - begin >= 5) rates.emplace_back(sum / static_cast<double>(end - begin));
    begin = end;
  }
  return rates;
}

// Whether the gyroscope shows turns that are neither its bias nor vibration.
bool TurnsByGyro(const FlightLog& log) {
  const std::vector<Eigen::Vector3d> rates = WindowRates(log.imu);
  if (rates.empty()) return false;
  Eigen::Vector3d usual;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& rate : rates) values.push_back(rate[axis]);
    usual[axis] = LowerMedian(values);
  }
  return std::any_of(rates.begin(), rates.end(), [&](const Eigen::Vector3d& rate) {
    return (rate - usual).norm() > kMovingRate;
  });
}

// Whether some attitude turns by more than its noise.
bool TurnsByAttitude(const FlightLog& log) {
  for (const char* stream : {"attitude", "mocap", "pose"}) {
    const std::vector<AttitudeSample> attitude = AttitudesOf(log, stream);
    for (const AttitudeSample& sample : attitude) {
      if (attitude.front().q_Ep_I.angularDistance(sample.q_Ep_I) > kMovingRate * kTurnWindow)
        return true;
    }
  }
  return false;
}

// A sensor that has one value for the whole log, while another one shows that the vehicle moves.
// One of a vehicle that does not turn may be right.
void JudgeDead(const std::string& stream, const std::string& columns, Examination* e) {
  const bool of_imu = stream == "imu", gyro = columns[0] == 'g';
  const bool by_attitude = of_imu && gyro;
  if (!(by_attitude ? TurnsByAttitude(e->log) : TurnsByGyro(e->log))) return;
  // Mocap of positions alone may come with an orientation that was never measured.
  const Level level = stream == "mocap" && columns[0] == 'q' ? Level::kBiases : Level::kFatal;
  const double span = SecondsBetween(e->log.imu.front().t, e->log.imu.back().t);
  e->Add({of_imu ? &fault::kDeadSensor : &fault::kStuck, stream, level, span, e->log.gravity},
         fmt::format(
             "{}.csv: {} keep one value for the whole log, while {} turns: they are not measured",
             stream, columns, by_attitude ? "the attitude" : "the gyroscope"),
         "check these columns in the file and in the map, and what the logger records");
}

constexpr double kFarFromZero = 0.3;  // m, of the rows beside a stretch of 0 0 0
constexpr double kHeldJump = 0.05;    // m
constexpr double kUsualStep = 0.9;    // quantile of the stream's own steps
constexpr double kFar = 3.0;          // times those

template <class Sample>
std::vector<Run> HeldRuns(const std::vector<Sample>& samples) {
  std::vector<Run> runs;
  const auto same = [&](std::size_t i, std::size_t k) { return samples[i].p_E == samples[k].p_E; };
  ForEachRun(samples.size(), same, [&](std::size_t first, std::size_t last) {
    runs.push_back({first, last});
  });
  return runs;
}

template <class Sample>
std::vector<Stretch> ZerosOf(const std::vector<Sample>& samples) {
  std::vector<Stretch> zeros;
  const auto is_far = [&](std::size_t i) { return samples[i].p_E.norm() > kFarFromZero; };
  for (const auto [first, last] : HeldRuns(samples)) {
    if (!samples[first].p_E.isZero(0.0) || last - first == samples.size()) continue;
    const bool jumps =
        (first == 0 || is_far(first - 1)) && (last == samples.size() || is_far(last));
    // A single one at an end may be the origin of the positions.
    const bool at_end = first == 0 || last == samples.size();
    if (jumps && last - first > (at_end ? 1 : 0)) {
      zeros.push_back({samples[first].t, samples[last - 1].t});
    }
  }
  return zeros;
}

// Positions of a moving vehicle that keep one value for much longer than the stream's own step, and
// then jump. A vehicle at rest goes on where it stood.
template <class Sample>
std::vector<Stretch> HeldPlaces(const std::vector<Sample>& samples) {
  std::vector<Stretch> held;
  const std::vector<Run> runs = HeldRuns(samples);
  if (runs.size() < kFewest) return held;
  std::vector<double> steps, jumps;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    steps.push_back(SecondsBetween(samples[runs[k - 1].first].t, samples[runs[k].first].t));
    jumps.push_back((samples[runs[k].first].p_E - samples[runs[k - 1].first].p_E).norm());
  }
  const double usual_step = Quantile(steps, kUsualStep), usual_jump = Quantile(jumps, kUsualStep);
  for (std::size_t k = 0; k + 1 < runs.size(); ++k) {
    const Run& run = runs[k];
    const double seconds = SecondsBetween(samples[run.first].t, samples[run.last - 1].t);
    if (seconds < std::max(kHarmless, kFar * usual_step)) continue;
    if (jumps[k] < std::max(kHeldJump, kFar * usual_jump)) continue;
    held.push_back({samples[run.first + 1].t, samples[run.last - 1].t});
  }
  return held;
}

// Stretches of one pose, but for its first row.
template <class Sample>
void AddHeld(const FlightLog& log, const Stream& stream, const std::vector<Sample>& samples,
             std::vector<Stretch>* stretches) {
  for (const Stretch& frozen : FindFrozen(ColumnsOf(stream, samples))) {
    const auto first = std::find_if(samples.begin(), samples.end(),
                                    [&](const Sample& sample) { return sample.t > frozen.from; });
    if (IsWithin(*stretches, first->t) || !TurnsMeanwhile(log, frozen)) continue;
    stretches->push_back({first->t, frozen.until});
  }
}

// A part of the flight with one set of body axes.
struct BodyPart {
  std::size_t first = 0, last = 0;  // rows first to last - 1
  Eigen::Quaterniond body;          // turned against those of the first part
};

// An attitude that turns at once by far more than the gyroscope begins a part.
std::vector<BodyPart> BodyParts(const FlightLog& log, const std::vector<PoseSample>& poses) {
  std::vector<BodyPart> parts = {{0, poses.size(), Eigen::Quaterniond::Identity()}};
  std::size_t before = 0;  // the row at which the last different attitude came
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Eigen::Quaterniond step = poses[before].q_E.conjugate() * poses[i].q_E;
    const double angle = step.angularDistance(Eigen::Quaterniond::Identity());
    if (angle == 0.0) continue;
    const double seconds = SecondsBetween(poses[before].t, poses[i].t);
    const double turned = TurnOfGyro(log, {poses[before].t, poses[i].t});
    before = i;
    if (seconds > kAttitudeGap || angle < kClearTurn + 1.2 * turned) continue;
    parts.back().last = i;
    parts.push_back({i, poses.size(), (parts.back().body * step).normalized()});
  }
  return parts;
}

bool IsSameBody(const BodyPart& a, const BodyPart& b) {
  return a.body.angularDistance(b.body) < kClearTurn;
}

// How well turn rates agree with those of the gyroscope as stamped, by any body axes; at most 1.
double AgreementOf(const FlightLog& log, const std::vector<PoseSample>& poses) {
  const auto turns = TurnsOf(AttitudesOf(poses), LogClock(log), kMostPairs);
  const VectorSums sum = SumOf(RatePairs(GyroIntegral(log), turns, false)(0.0));
  if (!(sum.seen2 > 0.0 && sum.sure2 > 0.0)) return 0.0;
  // A mean rate counts as well, other than in a correlation: a vehicle may go on turning.
  return Eigen::JacobiSVD<Eigen::Matrix3d>(sum.cross).singularValues().sum() /
         std::sqrt(sum.seen2 * sum.sure2);
}

// Parts in other body axes than those of most rows, where the gyroscope shows that they are: a
// filter that is reset, or another clock, jumps as well.
std::vector<Stretch> Flips(const FlightLog& log, const std::vector<PoseSample>& poses) {
  std::vector<Stretch> flips;
  if (log.imu.empty() || poses.empty()) return flips;
  const std::vector<BodyPart> parts = BodyParts(log, poses);
  const auto rows_like = [&](const BodyPart& part) {
    std::size_t rows = 0;
    for (const BodyPart& other : parts) {
      if (IsSameBody(part, other)) rows += other.last - other.first;
    }
    return rows;
  };
  const BodyPart usual = *std::max_element(
      parts.begin(), parts.end(),
      [&](const BodyPart& a, const BodyPart& b) { return rows_like(a) < rows_like(b); });
  std::vector<PoseSample> undone = poses;
  for (const BodyPart& part : parts) {
    if (IsSameBody(part, usual)) continue;
    flips.push_back({poses[part.first].t, poses[part.last - 1].t});
    const Eigen::Quaterniond back = part.body.conjugate() * usual.body;
    for (std::size_t i = part.first; i < part.last; ++i) undone[i].q_E = poses[i].q_E * back;
  }
  if (flips.empty()) return flips;
  const double agreement = AgreementOf(log, undone);
  const bool are_shown = agreement > kAlike && agreement > AgreementOf(log, poses);
  return are_shown ? flips : std::vector<Stretch>();
}

// Shares of rows that an import has stated in the log's `source`.
void CheckShares(Examination* e) {
  ForEachStream(e->log, [&](const Stream& stream, const auto&) {
    const auto share = [&](const char* what) {
      const auto found = e->log.source.find(fmt::format("{} {}", stream.name, what));
      return found == e->log.source.end() ? 0.0 : std::strtod(found->second.c_str(), nullptr);
    };
    if (const double spread = share(kSpreadShare); spread > 0.0) {
      e->Add({&fault::kSharedStamps, stream.name, Level::kWidens, spread},
             fmt::format(
                 "{}.csv: {:.0f} % of the samples shared the stamp of another, as if written late, "
                 "several "
                 "at a time; they are spread evenly over the time up to it",
                 stream.name, 100.0 * spread),
             "log the time of measurement, or with more digits");
    }
    if (const double lost = share(kLostShare); lost > 0.0) {
      const bool many = lost > 1.0 - kMostly;
      e->Add({&fault::kRowsLost, stream.name, many ? Level::kFatal : Level::kNote, lost},
             fmt::format("{}.csv: {:.1f} % of the rows were left out by the conversion, as "
                         "its warnings say",
                         stream.name, 100.0 * lost),
             "correct the map or the log, so that they can be read");
    }
  });
}

}  // namespace

void ColumnCollector::Add(const Field& field, const std::vector<double>& values) {
  if (next == sensors.size()) sensors.push_back({});
  Sensor& sensor = sensors[next++];
  sensor.columns.resize(values.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (sensor.names.size() <= k) sensor.names.push_back(field.columns[k]);
    sensor.columns[k].push_back(values[k]);
  }
}

double QuantumOf(const std::vector<double>& values) {
  std::vector<double> distinct = values;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  if (distinct.size() < 2 || distinct.size() > values.size() / 3) return 0.0;
  std::vector<double> steps;
  for (std::size_t i = 1; i < distinct.size(); ++i) steps.push_back(distinct[i] - distinct[i - 1]);
  const double least = *std::min_element(steps.begin(), steps.end());
  const double range = distinct.back() - distinct.front();
  if (!(least > 1e-9 * range)) return 0.0;
  const auto multiples = std::count_if(steps.begin(), steps.end(), [least](double s) {
    return std::abs(s / least - std::round(s / least)) < 0.1;
  });
  return static_cast<double>(multiples) > 0.9 * static_cast<double>(steps.size()) ? least : 0.0;
}

std::vector<StuckColumn> FindStuck(const StreamColumns& stream) {
  std::vector<StuckColumn> stuck;
  for (const Sensor& sensor : stream.sensors) {
    for (std::size_t k = 0; k < sensor.columns.size(); ++k) {
      const Run run = LongestRun(sensor.columns[k]);
      const Stretch stretch = StretchOf(stream, run);
      if (stretch.Seconds() < kHarmless || !IsStuck(sensor, k, run)) continue;
      stuck.push_back(
          {sensor.names[k], sensor.columns[k][run.first], run.last - run.first, stretch});
    }
  }
  return stuck;
}

std::vector<Stretch> FindFrozen(const StreamColumns& stream) {
  std::vector<Stretch> all;
  if (stream.sensors.empty()) return all;
  const Values changes = ChangesOf(stream.sensors, stream.t.size());
  ForEachRunOf(changes, [&](const Run& run) {
    const Stretch stretch = StretchOf(stream, run);
    if (stretch.Seconds() >= kHarmless && IsOdd(changes, run)) all.push_back(stretch);
  });
  return all;
}

std::vector<std::string> FindDead(const StreamColumns& stream) {
  std::vector<std::string> dead;
  if (stream.t.size() < kFewest) return dead;
  for (const Sensor& sensor : stream.sensors) {
    const bool still =
        std::all_of(sensor.columns.begin(), sensor.columns.end(), [](const Values& column) {
          const double first = column.front();
          return std::all_of(column.begin(), column.end(), [=](double v) { return v == first; });
        });
    if (still) dead.push_back(NamesOf(sensor));
  }
  return dead;
}

std::vector<std::size_t> StillChannels(const std::vector<ChannelsSample>& samples) {
  std::vector<std::size_t> still;
  if (samples.size() < kFewest) return still;
  const std::vector<double>& first = samples.front().values;
  for (std::size_t k = 0; k < first.size(); ++k) {
    const bool changes = std::any_of(samples.begin(), samples.end(), [&](const ChannelsSample& s) {
      return s.values[k] != first[k];
    });
    if (!changes) still.push_back(k);
  }
  return still;
}

double TurnOfGyro(const FlightLog& log, const Stretch& stretch) {
  const auto earlier = [](const ImuSample& sample, TimeNs t) { return sample.t < t; };
  auto sample = std::lower_bound(log.imu.begin(), log.imu.end(), stretch.from, earlier);
  if (sample == log.imu.begin() && !log.imu.empty()) ++sample;
  double turn = 0.0;
  for (; sample != log.imu.end() && sample->t <= stretch.until; ++sample) {
    turn += sample->gyro.norm() * SecondsBetween(std::prev(sample)->t, sample->t);
  }
  return turn;
}

bool TurnsMeanwhile(const FlightLog& log, const Stretch& frozen) {
  return SecondsMoving(frozen, TurnOfGyro(log, frozen)) > 0.0;
}

// Of poses see FindLostTracks().
void CheckFrozen(Examination* e) {
  ForEachStream(e->log, [&](const Stream& stream, const auto& samples) {
    const StreamColumns columns = ColumnsOf(stream, samples);
    const std::string name = stream.name;
    for (const std::string& dead : FindDead(columns)) JudgeDead(name, dead, e);
    if (name == "imu" || name == "attitude") Judge(name, FindFrozen(columns), e);
  });
}

double LostTrack::Seconds() const {
  double seconds = 0.0;
  for (const Stretch& stretch : stretches) seconds += stretch.Seconds();
  return seconds;
}

std::string LostTrack::Text() const {
  constexpr std::array<const char*, 3> kHow = {
      "the position is exactly 0 0 0", "one value is held, while the vehicle moves,",
      "the attitude turns at once, by far more than the gyroscope, to other body axes"};
  constexpr std::array<const char*, 3> kWhy = {
      "the tracker has lost the vehicle", "the tracker has lost the vehicle",
      "the tracker takes another set of markers for the vehicle"};
  const auto kind = static_cast<std::size_t>(how);
  std::string places;
  for (const Stretch& stretch : stretches) {
    places += fmt::format("{}{:.3f} to {:.3f}", places.empty() ? "" : ", ", ToSeconds(stretch.from),
                          ToSeconds(stretch.until));
  }
  return fmt::format("{}.csv: {} in {} stretch{} ({} s), {:.1f} s in all: {}", stream, kHow[kind],
                     stretches.size(), stretches.size() == 1 ? "" : "es", places, Seconds(),
                     kWhy[kind]);
}

std::vector<LostTrack> FindLostTracks(const FlightLog& log) {
  std::vector<LostTrack> lost;
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    using Sample = SampleOf<decltype(samples)>;
    const auto add = [&](Lost how, std::vector<Stretch> stretches) {
      std::sort(stretches.begin(), stretches.end(),
                [](const Stretch& a, const Stretch& b) { return a.from < b.from; });
      if (!stretches.empty()) lost.push_back({stream.name, how, std::move(stretches)});
    };
    if constexpr (requires(Sample s) { s.p_E; }) {
      const std::vector<Stretch> zeros = ZerosOf(samples);
      std::vector<Sample> seen = samples;
      std::erase_if(seen, [&](const Sample& sample) { return IsWithin(zeros, sample.t); });
      std::vector<Stretch> held = HeldPlaces(seen);
      if constexpr (std::is_same_v<Sample, PoseSample>) {
        AddHeld(log, stream, seen, &held);
        add(Lost::kFlipped, Flips(log, seen));
      }
      add(Lost::kZero, zeros);
      add(Lost::kHeld, held);
    }
  });
  return lost;
}

std::vector<std::string> LeaveOutLostTracks(FlightLog* log) {
  std::vector<std::string> warnings;
  for (const LostTrack& lost : FindLostTracks(*log)) {
    ForEachStream(*log, [&](const Stream& stream, auto& samples) {
      if (lost.stream != stream.name) return;
      std::erase_if(samples,
                    [&](const auto& sample) { return IsWithin(lost.stretches, sample.t); });
    });
    warnings.push_back(lost.Text() + "; these rows are left out");
  }
  return warnings;
}

void CheckRows(Examination* e) {
  CheckShares(e);
  for (const LostTrack& lost : FindLostTracks(e->log)) {
    const FaultKind& kind = lost.how == Lost::kHeld ? fault::kStuck : fault::kTrackingLost;
    e->AddRepaired({&kind, lost.stream, Level::kBiases, lost.Seconds()}, lost.Text(),
                   "leave these rows out (`leave_out` in the map)", {.leave_out = lost.stretches});
  }
  for (const StreamHealth& health : e->result.streams) {
    if (health.IsHeld() && health.stream != "imu") e->Repair(health.stream, {.only_new = true});
  }
}

}  // namespace trueline
