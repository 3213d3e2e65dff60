#include <algorithm>
#include <type_traits>

#include "problems/common/units.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/stuck.h"

namespace trueline {
namespace {

constexpr double kLeastFrozen = 0.2;  // s
constexpr double kMovingTurn = 0.2;   // rad, of a vehicle that is not at rest
constexpr double kMovingRate = 0.15;  // rad/s, on average; more than the noise of a gyroscope

// rad, all turns within the stretch added up.
double TurnOfGyro(const FlightLog& log, const FrozenStretch& frozen) {
  double turn = 0.0;
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    if (log.imu[i].t < frozen.from || log.imu[i].t > frozen.until) continue;
    turn += log.imu[i].gyro.norm() * SecondsBetween(log.imu[i - 1].t, log.imu[i].t);
  }
  return turn;
}

double TurnOfAttitude(const FlightLog& log, const FrozenStretch& frozen) {
  double turn = 0.0;
  for (std::size_t i = 1; i < log.attitude.size(); ++i) {
    if (log.attitude[i].t < frozen.from || log.attitude[i].t > frozen.until) continue;
    turn += log.attitude[i - 1].q_Ep_I.angularDistance(log.attitude[i].q_Ep_I);
  }
  return turn;
}

void Judge(const std::string& stream, const FrozenStretch& frozen, Examination* e) {
  const bool imu = stream == "imu";
  const double seconds = SecondsBetween(frozen.from, frozen.until);
  const double turn = imu ? TurnOfAttitude(e->log, frozen) : TurnOfGyro(e->log, frozen);
  if (seconds < kLeastFrozen || turn < std::max(kMovingTurn, kMovingRate * seconds)) return;
  Finding finding;
  finding.id = "stuck";
  finding.stream = stream;
  finding.level = Level::kBiases;
  finding.size = seconds;
  finding.unit = "s";
  finding.text = fmt::format(
      "{}.csv: no number changes from {:.3f} to {:.3f} s, in which time {} turns by {:.0f} deg",
      stream, ToSeconds(frozen.from), ToSeconds(frozen.until),
      imu ? "the attitude" : "the gyroscope", turn / kDegree);
  finding.remedy = "leave out the samples that repeat (`new_where` in the map), or cut that part";
  e->Add(finding);
}

}  // namespace

void CheckFrozen(Examination* e) {
  ForEachStream(e->log, [&](const Stream& stream, const auto& samples) {
    using Sample = std::remove_cvref_t<decltype(samples.front())>;
    if constexpr (std::is_same_v<Sample, ImuSample> || std::is_same_v<Sample, AttitudeSample> ||
                  std::is_same_v<Sample, PoseSample>) {
      if (const auto frozen = FindFrozen(stream, samples)) Judge(stream.name, *frozen, e);
    }
  });
}

}  // namespace trueline
