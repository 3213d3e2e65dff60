#include "problems/log/stream_table.h"

#include <fmt/format.h>

namespace trueline {
namespace {

template <class Sample>
void AddStream(const char* name, const std::vector<Sample>& samples, std::string* table) {
  if (samples.empty()) return;
  const double span = SecondsBetween(samples.front().t, samples.back().t);
  const double rate = span > 0.0 ? static_cast<double>(samples.size() - 1) / span : 0.0;
  *table += fmt::format("{:<10}{:>9}{:>12.2f}{:>18.3f}{:>18.3f}{:>11.3f}\n", name, samples.size(),
                        rate, ToSeconds(samples.front().t), ToSeconds(samples.back().t), span);
}

}  // namespace

std::string StreamTable(const FlightLog& log) {
  std::string table = fmt::format("{:<10}{:>9}{:>12}{:>18}{:>18}{:>11}\n", "stream", "samples",
                                  "rate [Hz]", "from [s]", "to [s]", "span [s]");
  AddStream("imu", log.imu, &table);
  AddStream("attitude", log.attitude, &table);
  AddStream("fixes", log.fixes, &table);
  AddStream("pose", log.pose, &table);
  AddStream("mocap", log.mocap, &table);
  AddStream("rotors", log.rotors, &table);
  AddStream("motors", log.motors, &table);
  AddStream("battery", log.battery, &table);
  AddStream("range", log.range, &table);
  if (!log.gates.empty()) table += fmt::format("{} gates\n", log.gates.size());
  return table;
}

}  // namespace trueline
