#include "problems/inspection/heading.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>

#include "problems/inspection/position_witness.h"
#include "problems/vgd/line_fit.h"
#include "problems/vgd/passes.h"

namespace trueline {
namespace {

constexpr double kAgrees = 0.7;                 // correlation
constexpr LagSearch kHeadingLag = {0.5, 0.02};  // s
constexpr std::size_t kLeastArcs = 8;

// Horizontal changes of speed over an arc, north + i east [m/s].
struct SpeedChange {
  std::complex<double> seen;  // by the fixes
  std::complex<double> sure;  // by the specific force
};

// Mean velocity over a pass, from an unknown one at the start of the log.
struct PassSpeed {
  double t;              // s, of the middle
  Eigen::Vector3d seen;  // m/s, in the positions' earth
  Eigen::Vector3d sure;  // m/s, in the attitude's earth, without gravity
};

std::vector<PassSpeed> SpeedsOf(const FlightLog& log) {
  const RunningIntegral<3> force = ForceIntegral(log, log.attitude);
  const LogClock clock(log);
  std::vector<PassSpeed> speeds;
  for (const Pass& pass : FindPasses(log.fixes, {})) {
    const double from = clock(pass.begin), to = clock(pass.end);
    if (!(to > from) || !force.Knows(from, to)) continue;
    speeds.push_back({0.5 * (from + to), FitLine(log.fixes, pass.first, pass.last, pass.begin).v,
                      (force.At(to) - force.At(from)) / (to - from)});
  }
  return speeds;
}

std::vector<SpeedChange> ChangesOf(const FlightLog& log) {
  const double longest = PassOptions().max_arc;
  const RunningIntegral<3> force = ForceIntegral(log, log.attitude);
  std::vector<SpeedChange> changes;
  const std::vector<PassSpeed> speeds = SpeedsOf(log);
  for (std::size_t i = 1; i < speeds.size(); ++i) {
    if (speeds[i].t - speeds[i - 1].t > longest) continue;
    if (!force.Knows(speeds[i - 1].t, speeds[i].t)) continue;
    const Eigen::Vector3d seen = speeds[i].seen - speeds[i - 1].seen;
    const Eigen::Vector3d sure = speeds[i].sure - speeds[i - 1].sure;
    changes.push_back({{seen.x(), seen.y()}, {sure.x(), sure.y()}});
  }
  return changes;
}

// Sum of seen over sure, whose angle is the heading; without one arc.
std::complex<double> Sum(const std::vector<SpeedChange>& changes, std::size_t without) {
  std::complex<double> sum = 0.0;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (i != without) sum += changes[i].seen * std::conj(changes[i].sure);
  }
  return sum;
}

}  // namespace

std::optional<Heading> HeadingByBends(const Examination& e, const std::string& stream) {
  const auto witness = PositionWitnessOf(e, stream);
  if (!witness) return std::nullopt;
  const RunningIntegral<3> force = ForceIntegral(e.fixed, e.fixed.attitude);
  const auto match = MatchVectors(AccelerationPairs(force, witness->bends), kHeadingLag);
  if (!match || match->correlation < kAgrees) return std::nullopt;
  const Eigen::Matrix3d& turn = match->turn;
  if (turn.determinant() < 0.0 || turn(2, 2) < 0.97) return std::nullopt;  // other axes
  return Heading{std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1)),
                 std::sqrt(match->turn_cov(2, 2))};
}

std::optional<Heading> HeadingByPasses(const Examination& e) {
  const std::vector<SpeedChange> changes = ChangesOf(e.fixed);
  if (changes.size() < kLeastArcs) return std::nullopt;
  double seen = 0.0, sure = 0.0;
  for (const SpeedChange& change : changes) {
    seen += std::norm(change.seen);
    sure += std::norm(change.sure);
  }
  const std::complex<double> sum = Sum(changes, changes.size());
  if (std::abs(sum) < kAgrees * std::sqrt(seen * sure)) return std::nullopt;
  std::vector<double> without;  // rad, beside the angle of all
  for (std::size_t i = 0; i < changes.size(); ++i) {
    without.push_back(std::arg(Sum(changes, i) / sum));
  }
  return Heading{std::arg(sum), JackknifeSigma(without)};
}

}  // namespace trueline
