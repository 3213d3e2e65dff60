#include "problems/inspection/lost_track.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/import/shared_stamps.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/stuck.h"

namespace trueline {
namespace {

constexpr double kFarFromZero = 0.3;     // m, of the rows beside a stretch of 0 0 0
constexpr std::size_t kFewestZeros = 2;  // rows
constexpr double kManyLost = 0.2;        // share of rows, that makes a stream useless

template <class Sample>
std::vector<LostStretch> ZerosOf(const std::vector<Sample>& samples) {
  std::vector<LostStretch> zeros;
  for (std::size_t begin = 0; begin < samples.size();) {
    std::size_t end = begin;
    while (end < samples.size() && samples[end].p_E.isZero(0.0)) ++end;
    const auto is_far = [&](std::size_t i) { return samples[i].p_E.norm() > kFarFromZero; };
    const bool jumps = (begin == 0 || is_far(begin - 1)) && (end == samples.size() || is_far(end));
    if (end - begin >= kFewestZeros && jumps && end - begin < samples.size()) {
      zeros.push_back({samples[begin].t, samples[end - 1].t, true});
    }
    begin = std::max(end, begin + 1);
  }
  return zeros;
}

template <class Sample>
bool IsLost(const std::vector<LostStretch>& stretches, const Sample& sample) {
  return std::any_of(stretches.begin(), stretches.end(), [&](const LostStretch& stretch) {
    return sample.t >= stretch.from && sample.t <= stretch.until;
  });
}

// Stretches of one pose, but for its first row.
template <class Sample>
void AddHeld(const FlightLog& log, const Stream& stream, const std::vector<Sample>& samples,
             std::vector<LostStretch>* stretches) {
  for (const FrozenStretch& frozen : FindAllFrozen(stream, samples)) {
    const auto first = std::find_if(samples.begin(), samples.end(),
                                    [&](const Sample& sample) { return sample.t > frozen.from; });
    if (IsLost(*stretches, *first) || !TurnsMeanwhile(log, frozen)) continue;
    stretches->push_back({first->t, frozen.until, false});
  }
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
      const bool many = lost >= kManyLost;
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
  for (const LostStretch& stretch : stretches) {
    seconds += SecondsBetween(stretch.from, stretch.until);
  }
  return seconds;
}

std::string LostTrack::Text() const {
  const bool zero = std::any_of(stretches.begin(), stretches.end(),
                                [](const LostStretch& stretch) { return stretch.is_default; });
  std::string places;
  for (const LostStretch& stretch : stretches) {
    places += fmt::format("{}{:.3f} to {:.3f}", places.empty() ? "" : ", ", ToSeconds(stretch.from),
                          ToSeconds(stretch.until));
  }
  return fmt::format(
      "{}.csv: {} in {} stretch{} ({} s), {:.1f} s in all: the tracker has lost the "
      "vehicle",
      stream,
      zero ? "the position is exactly 0 0 0" : "no number changes, while the gyroscope turns,",
      stretches.size(), stretches.size() == 1 ? "" : "es", places, Seconds());
}

std::vector<LostTrack> FindLostTracks(const FlightLog& log) {
  std::vector<LostTrack> lost;
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    using Sample = SampleOf<decltype(samples)>;
    if constexpr (requires(Sample s) { s.p_E; }) {
      std::vector<LostStretch> stretches = ZerosOf(samples);
      if constexpr (std::is_same_v<Sample, PoseSample>) AddHeld(log, stream, samples, &stretches);
      std::sort(stretches.begin(), stretches.end(),
                [](const LostStretch& a, const LostStretch& b) { return a.from < b.from; });
      if (!stretches.empty()) lost.push_back({stream.name, stretches});
    }
  });
  return lost;
}

std::vector<std::string> LeaveOutLostTracks(FlightLog* log) {
  std::vector<std::string> warnings;
  for (const LostTrack& lost : FindLostTracks(*log)) {
    ForEachStream(*log, [&](const Stream& stream, auto& samples) {
      if (lost.stream != stream.name) return;
      std::erase_if(samples, [&](const auto& sample) { return IsLost(lost.stretches, sample); });
    });
    warnings.push_back(lost.Text() + "; these rows are left out");
  }
  return warnings;
}

void CheckRows(Examination* e) {
  CheckShares(e);
  for (const LostTrack& lost : FindLostTracks(e->log)) {
    const bool zero = lost.stretches.front().is_default;
    Finding finding{zero ? "tracking_lost" : "stuck", lost.stream, Level::kBiases, lost.Seconds(),
                    "s"};
    finding.text = lost.Text();
    finding.remedy = "leave these rows out (`leave_out` in the map)";
    finding.repaired = true;
    e->Add(finding);
    StreamRepair repair;
    for (const LostStretch& stretch : lost.stretches) {
      repair.leave_out.emplace_back(stretch.from, stretch.until);
    }
    e->Repair(lost.stream, repair);
  }
  for (Finding& finding : e->result.findings) {
    if (finding.id != "repeats" || finding.stream == "imu") continue;
    finding.repaired = true;
    StreamRepair repair;
    repair.only_new = true;
    e->Repair(finding.stream, repair);
  }
}

}  // namespace trueline
