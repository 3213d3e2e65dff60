#include "problems/inspection/motion.h"

#include <cmath>
#include <set>

#include "cost_functions/models/rotation.h"
#include "problems/inspection/clear.h"
#include "problems/log/imu_health.h"
#include "problems/log/samples.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

constexpr double kMostGrid = 200000;  // steps of the grid
constexpr double kLongestBaseline = 0.5;
constexpr double kMostTurn = 0.8;  // rad, over which a mean rate stands for a rotation

double ImuGap(const FlightLog& log) { return std::max(0.05, kLongStep * MedianStep(log.imu)); }

template <int N, class Value>
RunningIntegral<N> IntegralAtImu(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                                 const Value& value) {
  const LogClock clock(log);
  RunningIntegral<N> once(GridStep(log), ImuGap(log));
  AttitudeCursor cursor(attitude);
  Eigen::Quaterniond q;
  for (const ImuSample& sample : log.imu) {
    if (!attitude.empty() && cursor.At(sample.t, kAttitudeGap, &q))
      once.Add(clock(sample.t), value(q, sample.accel));
  }
  return std::move(once).Integrated();
}

// The sizes of a quaternion's components in ascending order, which neither their order in a file
// nor an inverse nor exchanged axes change.
using ComponentSizes = std::array<long, 4>;

ComponentSizes SizesOf(const Eigen::Quaterniond& q) {
  constexpr double kDigits = 1e6;
  ComponentSizes sizes{};
  for (int i = 0; i < 4; ++i)
    sizes[static_cast<std::size_t>(i)] = std::lround(kDigits * std::abs(q.coeffs()[i]));
  std::sort(sizes.begin(), sizes.end());
  return sizes;
}

// Whether `other` has the numbers of the log's attitude, at any stamps and in any form.
bool HasValuesOfAttitude(const FlightLog& log, const std::vector<AttitudeSample>& other) {
  std::set<ComponentSizes> values;
  for (const AttitudeSample& sample : log.attitude) values.insert(SizesOf(sample.q_Ep_I));
  const auto same = std::count_if(other.begin(), other.end(), [&](const AttitudeSample& sample) {
    return values.contains(SizesOf(sample.q_Ep_I));
  });
  return other.size() > 1 && static_cast<double>(same) > 0.9 * static_cast<double>(other.size());
}

// Whether `other` lies on the log's attitude as stamped, at its samples or between them.
bool LiesOnAttitude(const FlightLog& log, const std::vector<AttitudeSample>& other) {
  constexpr double kCopy = 5e-4;  // rad
  if (log.attitude.size() < 2 || other.size() < 2) return false;
  AttitudeCursor cursor(log.attitude);
  int same = 0, all = 0;
  for (std::size_t i = 0, k = 0; i < other.size(); ++i) {
    while (k + 1 < log.attitude.size() && log.attitude[k + 1].t <= other[i].t) ++k;
    double nearest = log.attitude[k].q_Ep_I.angularDistance(other[i].q_Ep_I);
    Eigen::Quaterniond between;
    if (cursor.At(other[i].t, 1.0, &between)) {
      nearest = std::min({nearest, between.angularDistance(other[i].q_Ep_I),
                          log.attitude[k + 1].q_Ep_I.angularDistance(other[i].q_Ep_I)});
    }
    same += nearest < kCopy;
    ++all;
  }
  return same > 0.9 * all;
}

}  // namespace

double GridStep(const FlightLog& log) {
  return std::max(0.5 * kFineStep, SecondsBetween(log.imu.front().t, log.imu.back().t) / kMostGrid);
}

std::vector<AttitudeSample> AttitudesOf(const std::vector<PoseSample>& poses) {
  std::vector<AttitudeSample> attitudes;
  attitudes.reserve(poses.size());
  for (const PoseSample& pose : poses) attitudes.push_back({pose.t, pose.q_E});
  return attitudes;
}

std::vector<PositionSample> PositionsOf(const FlightLog& log, const std::string& stream) {
  if (stream == "mocap") return PositionsOf(log.mocap);
  if (stream == "pose") return PositionsOf(log.pose);
  return PositionsOf(log.fixes);
}

bool RepeatsAttitude(const FlightLog& log, const std::vector<AttitudeSample>& other) {
  return LiesOnAttitude(log, other) || HasValuesOfAttitude(log, other);
}

RunningIntegral<3> GyroIntegral(const FlightLog& log) {
  if (log.imu.size() < 2) return {};
  const LogClock clock(log);
  RunningIntegral<3> gyro(GridStep(log), ImuGap(log));
  for (const ImuSample& sample : log.imu) gyro.Add(clock(sample.t), sample.gyro);
  return gyro;
}

std::vector<AttitudeTurn> TurnsOf(const std::vector<AttitudeSample>& attitude,
                                  const LogClock& clock, std::size_t most, double baseline) {
  std::vector<AttitudeTurn> turns;
  const std::size_t every = std::max<std::size_t>(1, attitude.size() / most);
  for (std::size_t i = 0, k = 0; i < attitude.size(); ++i) {
    while (k < i && SecondsBetween(attitude[k + 1].t, attitude[i].t) >= baseline) ++k;
    const double dt = SecondsBetween(attitude[k].t, attitude[i].t);
    if (i % every != 0 || dt < baseline || dt > kLongestBaseline) continue;
    const Eigen::Quaterniond &first = attitude[k].q_Ep_I, &last = attitude[i].q_Ep_I;
    if (first.angularDistance(last) > kMostTurn) continue;
    turns.push_back({clock(attitude[k].t), clock(attitude[i].t),
                     RotationVector(first.conjugate() * last) / dt,
                     RotationVector(last * first.conjugate()) / dt, first, last});
  }
  return turns;
}

PairsAt RatePairs(const RunningIntegral<3>& gyro, const std::vector<AttitudeTurn>& turns,
                  bool of_earth) {
  return [&gyro, &turns, of_earth](double lag) {
    std::vector<VectorPair> pairs;
    pairs.reserve(turns.size());
    for (const AttitudeTurn& turn : turns) {
      if (!gyro.Knows(turn.from - lag, turn.to - lag)) continue;
      pairs.push_back({0.5 * (turn.from + turn.to), of_earth ? turn.of_earth : turn.of_body,
                       gyro.Mean(turn.from - lag, turn.to - lag)});
    }
    return pairs;
  };
}

std::vector<Bend> BendsOf(const std::vector<PositionSample>& positions, const LogClock& clock,
                          double half, std::size_t most) {
  std::vector<Bend> bends;
  const std::size_t every = std::max<std::size_t>(1, positions.size() / most);
  std::vector<double> t;
  for (const PositionSample& p : positions) t.push_back(clock(p.t));
  for (std::size_t i = 0, low = 0, high = 0; i < t.size(); ++i) {
    while (low + 1 < i && t[low + 1] <= t[i] - half) ++low;
    while (high + 1 < t.size() && t[high] < t[i] + half) ++high;
    if (i % every != 0 || low >= i || high <= i) continue;
    const double before = t[i] - t[low], after = t[high] - t[i];
    if (before < half || after < half || std::max(before, after) > 3.0 * half) continue;
    // The second divided difference weights acceleration by a triangle; one that is nearly equal.
    const Eigen::Vector3d up = (positions[high].p_E - positions[i].p_E) / after;
    const Eigen::Vector3d down = (positions[i].p_E - positions[low].p_E) / before;
    if (std::abs(after - before) > 0.2 * (after + before)) continue;
    bends.push_back({(t[low] + t[i] + t[high]) / 3.0, 0.5 * (before + after),
                     2.0 * (up - down) / (before + after)});
  }
  return bends;
}

RunningIntegral<3> ForceIntegral(const FlightLog& log,
                                 const std::vector<AttitudeSample>& attitude) {
  return IntegralAtImu<3>(log, attitude, [](const Eigen::Quaterniond& q, const Eigen::Vector3d& f) {
    return Eigen::Vector3d(q * f);
  });
}

std::optional<Eigen::Vector3d> MeanForceInEarth(const FlightLog& log,
                                                const std::vector<AttitudeSample>& attitude,
                                                double half) {
  const RunningIntegral<3> twice = ForceIntegral(log, attitude);
  const LogClock clock(log);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t known = 0;
  for (const AttitudeSample& sample : attitude) {
    const Bend about{clock(sample.t), half, {}};
    if (!twice.Knows(about.t - half, about.t + half)) continue;
    sum += UnderTriangle(twice, about, 0.0);
    ++known;
  }
  if (known < kFewest) return std::nullopt;
  return sum / static_cast<double>(known);
}

RunningIntegral<9> AxisForceIntegral(const FlightLog& log,
                                     const std::vector<AttitudeSample>& attitude, int earth_axis) {
  return IntegralAtImu<9>(
      log, attitude, [earth_axis](const Eigen::Quaterniond& q, const Eigen::Vector3d& f) {
        const Eigen::Vector3d row = q.toRotationMatrix().row(earth_axis).transpose();
        Eigen::Matrix<double, 9, 1> terms;
        for (int k = 0; k < 3; ++k) terms.segment<3>(3 * k) = row[k] * f;
        return terms;
      });
}

RunningIntegral<3> AxisIntegral(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                                int earth_axis) {
  return IntegralAtImu<3>(
      log, attitude, [earth_axis](const Eigen::Quaterniond& q, const Eigen::Vector3d&) {
        return Eigen::Vector3d(q.toRotationMatrix().row(earth_axis).transpose());
      });
}

PairsAt AccelerationPairs(const RunningIntegral<3>& force, const std::vector<Bend>& bends) {
  return [&force, &bends](double lag) {
    std::vector<VectorPair> pairs;
    pairs.reserve(bends.size());
    for (const Bend& bend : bends) {
      if (!force.Knows(bend.t - lag - bend.half, bend.t - lag + bend.half)) continue;
      pairs.push_back({bend.t, bend.acceleration, UnderTriangle(force, bend, lag)});
    }
    return pairs;
  };
}

PairsAt FixPairs(const FlightLog& log) {
  return [&log](double lag) {
    const LogClock clock(log);
    std::vector<VectorPair> pairs;
    const std::size_t every = std::max<std::size_t>(1, log.fixes.size() / kMostPairs);
    for (std::size_t i = 0; i < log.fixes.size(); i += every) {
      const Fix& fix = log.fixes[i];
      if (const auto p = PositionAt(log.mocap, fix.t - FromSeconds(lag))) {
        pairs.push_back({clock(fix.t), fix.p_E, *p});
      }
    }
    return pairs;
  };
}

}  // namespace trueline
