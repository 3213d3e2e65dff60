#include "problems/log/stream_table.h"

#include <fmt/format.h>

#include "problems/log/imu_health.h"

namespace trueline {

std::string StreamTable(const FlightLog& log) {
  std::string table = fmt::format("{:<10}{:>9}{:>12}{:>18}{:>18}{:>11}\n", "stream", "samples",
                                  "rate [Hz]", "from [s]", "to [s]", "span [s]");
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    if (samples.empty()) return;
    const TimeNs from = samples.front().t, to = samples.back().t;
    table +=
        fmt::format("{:<10}{:>9}{:>12.2f}{:>18.3f}{:>18.3f}{:>11.3f}", stream.name, samples.size(),
                    MeanRate(samples), ToSeconds(from), ToSeconds(to), SecondsBetween(from, to));
    const auto channel = log.source.find(stream.name);
    if (channel != log.source.end()) table += "  " + channel->second;
    table += "\n";
  });
  if (!log.gates.empty()) table += fmt::format("{} gates\n", log.gates.size());
  return table;
}

}  // namespace trueline
