#include "problems/inspection/lost_track.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "problems/import/shared_stamps.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/stuck.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kFarFromZero = 0.3;           // m, of the rows beside a stretch of 0 0 0
constexpr double kHeldJump = 0.05;             // m
constexpr double kUsualStep = 0.9;             // quantile of the stream's own steps
constexpr double kFar = 3.0;                   // times those
constexpr double kLeastFlip = 30.0 * kDegree;  // beside the gyroscope's turn

// Rows first to last - 1 have one position.
struct HeldRun {
  std::size_t first = 0, last = 0;
};

template <class Sample>
std::vector<HeldRun> HeldRuns(const std::vector<Sample>& samples) {
  std::vector<HeldRun> runs;
  ForEachRun(
      samples.size(),
      [&](std::size_t i, std::size_t k) { return samples[i].p_E == samples[k].p_E; },
      [&](std::size_t first, std::size_t last) {
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
  const std::vector<HeldRun> runs = HeldRuns(samples);
  if (runs.size() < kFewest) return held;
  std::vector<double> steps, jumps;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    steps.push_back(SecondsBetween(samples[runs[k - 1].first].t, samples[runs[k].first].t));
    jumps.push_back((samples[runs[k].first].p_E - samples[runs[k - 1].first].p_E).norm());
  }
  const double usual_step = Quantile(steps, kUsualStep), usual_jump = Quantile(jumps, kUsualStep);
  for (std::size_t k = 0; k + 1 < runs.size(); ++k) {
    const HeldRun& run = runs[k];
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
    if (seconds > kAttitudeGap || angle < kLeastFlip + 1.2 * turned) continue;
    parts.back().last = i;
    parts.push_back({i, poses.size(), (parts.back().body * step).normalized()});
  }
  return parts;
}

bool IsSameBody(const BodyPart& a, const BodyPart& b) {
  return a.body.angularDistance(b.body) < kLeastFlip;
}

// How well turn rates agree with those of the gyroscope as stamped, by any body axes; at most 1.
double AgreementOf(const FlightLog& log, const std::vector<PoseSample>& poses) {
  const auto turns = TurnsOf(AttitudesOf(poses), LogClock(log), kMostPairs);
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  double seen = 0.0, sure = 0.0;
  for (const VectorPair& pair : RatePairs(GyroIntegral(log), turns, false)(0.0)) {
    cross += pair.seen * pair.sure.transpose();
    seen += pair.seen.squaredNorm();
    sure += pair.sure.squaredNorm();
  }
  if (!(seen > 0.0 && sure > 0.0)) return 0.0;
  return Eigen::JacobiSVD<Eigen::Matrix3d>(cross).singularValues().sum() / std::sqrt(seen * sure);
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
      Finding finding{"shared_stamps", stream.name, Level::kWidens, spread, "1"};
      finding.text = fmt::format(
          "{}.csv: {:.0f} % of the samples shared the stamp of another, as if written late, "
          "several "
          "at a time; they are spread evenly over the time up to it",
          stream.name, 100.0 * spread);
      finding.remedy = "log the time of measurement, or with more digits";
      e->Add(finding);
    }
    if (const double lost = share(kLostShare); lost > 0.0) {
      const bool many = lost > 1.0 - kCovers;
      Finding finding{"rows_lost", stream.name, many ? Level::kFatal : Level::kNote, lost, "1"};
      finding.text = fmt::format(
          "{}.csv: {:.1f} % of the rows were left out by the conversion, as "
          "its warnings say",
          stream.name, 100.0 * lost);
      finding.remedy = "correct the map or the log, so that they can be read";
      e->Add(finding);
    }
  });
}

}  // namespace

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
    const char* id = lost.how == Lost::kHeld ? "stuck" : "tracking_lost";
    Finding finding{id, lost.stream, Level::kBiases, lost.Seconds(), "s"};
    finding.text = lost.Text();
    finding.remedy = "leave these rows out (`leave_out` in the map)";
    e->AddRepaired(finding, {.leave_out = lost.stretches});
  }
  for (const StreamHealth& health : e->result.streams) {
    if (health.IsHeld() && health.stream != "imu") e->Repair(health.stream, {.only_new = true});
  }
}

}  // namespace trueline
