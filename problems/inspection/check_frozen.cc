#include <algorithm>
#include <iterator>

#include "problems/common/units.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/stuck.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kMovingTurn = 0.2;   // rad, of a vehicle that is not at rest
constexpr double kMovingRate = 0.15;  // rad/s, on average; more than the noise of a gyroscope

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
  return turn >= std::max(kMovingTurn, kMovingRate * seconds) ? seconds : 0.0;
}

// Names the longest stretch in which the vehicle moves.
void Judge(const std::string& stream, const std::vector<Stretch>& stretches, Examination* e) {
  const bool imu = stream == "imu";
  Finding finding{"stuck", stream, Level::kBiases, 0.0, "s"};
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
    return (rate - usual).norm() * kTurnWindow > kMovingTurn;
  });
}

// Whether some attitude turns by more than its noise.
bool TurnsByAttitude(const FlightLog& log) {
  for (const char* stream : {"attitude", "mocap", "pose"}) {
    const std::vector<AttitudeSample> attitude = AttitudesOf(log, stream);
    for (const AttitudeSample& sample : attitude) {
      if (attitude.front().q_Ep_I.angularDistance(sample.q_Ep_I) > kMovingTurn) return true;
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
  const char* id = of_imu ? "dead_axis" : "stuck";
  Finding finding{id, stream, level, span, "s", e->log.gravity};
  finding.text = fmt::format(
      "{}.csv: {} keep one value for the whole log, while {} turns: they are not measured", stream,
      columns, by_attitude ? "the attitude" : "the gyroscope");
  finding.remedy = "check these columns in the file and in the map, and what the logger records";
  e->Add(finding);
}

}  // namespace

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

// Of poses see lost_track.h.
void CheckFrozen(Examination* e) {
  ForEachStream(e->log, [&](const Stream& stream, const auto& samples) {
    const StreamColumns columns = ColumnsOf(stream, samples);
    const std::string name = stream.name;
    for (const std::string& dead : FindDead(columns)) JudgeDead(name, dead, e);
    if (name == "imu" || name == "attitude") Judge(name, FindFrozen(columns), e);
  });
}

}  // namespace trueline
