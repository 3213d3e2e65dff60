#include <algorithm>

#include "problems/inspection/examination.h"

namespace trueline {
namespace {

constexpr double kLeastOverlap = 8.0;  // s
constexpr double kLeastCover = 0.8;    // share of a stream that lies in the IMU's time

std::string SpanOf(TimeNs origin, TimeNs from, TimeNs to) {
  return fmt::format("{:.1f} to {:.1f} s", SecondsBetween(origin, from),
                     SecondsBetween(origin, to));
}

template <class Sample>
void CheckStreamCover(const std::vector<Sample>& samples, const char* name, Examination* e) {
  if (samples.empty() || e->log.imu.empty()) return;
  const TimeNs begin = e->log.imu.front().t, end = e->log.imu.back().t;
  const double longest =
      std::max(SecondsBetween(begin, end), SecondsBetween(samples.front().t, samples.back().t));
  if (longest < kLeastOverlap) return;
  const auto inside = std::count_if(samples.begin(), samples.end(),
                                    [&](const Sample& s) { return s.t >= begin && s.t <= end; });
  const double share = static_cast<double>(inside) / static_cast<double>(samples.size());
  if (share >= kLeastCover) return;
  Finding finding;
  finding.id = "cover";
  finding.stream = name;
  finding.level = share < 0.2 ? Level::kFatal : Level::kBiases;
  finding.size = share;
  finding.unit = "1";
  finding.text = fmt::format(
      "only {:.0f} % of {}.csv lies within the time of imu.csv ({}): it spans {}", 100.0 * share,
      name, SpanOf(begin, begin, end), SpanOf(begin, samples.front().t, samples.back().t));
  finding.remedy =
      "export the whole flight, or bring the clocks together (time: offset in the map)";
  e->Add(finding);
}

void CheckAttitudeIsThere(Examination* e) {
  const FlightLog& log = e->log;
  if (!log.attitude.empty() || !log.rotors.empty() || log.imu.size() < 2) return;
  if (SecondsBetween(log.imu.front().t, log.imu.back().t) < kLeastOverlap) return;
  Finding finding;
  finding.id = "attitude_missing";
  finding.stream = "attitude";
  finding.level = Level::kBiases;
  finding.unit = "1";
  finding.text =
      "attitude.csv is missing: the program's own filter gives the attitude, with a heading that "
      "starts at zero and a tilt that is wrong by degrees in turns";
  finding.remedy = "log the autopilot's attitude";
  e->Add(finding);
}

}  // namespace

void CheckCover(Examination* e) {
  CheckStreamCover(e->log.attitude, "attitude", e);
  CheckStreamCover(e->log.fixes, "fixes", e);
  CheckStreamCover(e->log.mocap, "mocap", e);
  CheckStreamCover(e->log.pose, "pose", e);
  CheckStreamCover(e->log.rotors, "rotors", e);
  CheckStreamCover(e->log.motors, "motors", e);
  CheckAttitudeIsThere(e);
}

}  // namespace trueline
