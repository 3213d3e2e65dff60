#include "problems/inspection/stuck.h"

#include <algorithm>
#include <cmath>

#include "problems/import/shared_stamps.h"
#include "problems/inspection/clear.h"

namespace trueline {
namespace {

constexpr double kChance = 1e-9;  // that an ordinary signal stays for as long, in one column
constexpr double kCalm = 0.05;    // more repeats of a neighbour than elsewhere: all is calm

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
    if (k != but && within > ShareOutside(other, run) + kCalm) return true;
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

}  // namespace trueline
