#include "problems/simulators/motor_response.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace trueline {
namespace {

constexpr int kParts = 8;  // of the flight, each fitted alone: their scatter is the sigma
constexpr double kShortestPart = 1.0;                       // s
constexpr double kMostScatter = 0.2, kMostSeconds = 0.003;  // of a lag that is shown: a share, s
constexpr double kExplained = 0.5;  // of the speeds' squares, that commands explain at least
constexpr double kResolution = 0.005, kFinest = 1e-4;  // of the search: a share, s
constexpr double kLongestLag = 0.5;                    // s

struct LagFit {
  double lag, cost, full_speed, squares;
};

// Commands as they pass a lag of first order, at the times of the speeds.
Eigen::VectorXd Lagged(const FlightLog& log, std::size_t rotor, double lag, std::size_t begin,
                       std::size_t end) {
  Eigen::VectorXd passed(static_cast<Eigen::Index>(end - begin));
  const auto& motors = log.motors;
  const auto after = [&](TimeNs t) {
    return std::upper_bound(motors.begin(), motors.end(), t,
                            [](TimeNs at, const ChannelsSample& s) { return at < s.t; });
  };
  auto next = after(log.rotors[begin].t);
  double state = (next == motors.begin() ? next : std::prev(next))->values[rotor];
  for (std::size_t i = begin; i < end; ++i) {
    if (i > begin) {
      TimeNs from = log.rotors[i - 1].t;
      const TimeNs to = log.rotors[i].t;
      while (from < to) {
        const double u = (next == motors.begin() ? next : std::prev(next))->values[rotor];
        const TimeNs until = next == motors.end() ? to : std::min(to, next->t);
        state = u + std::exp(-SecondsBetween(from, until) / lag) * (state - u);
        from = until;
        if (next != motors.end() && next->t <= from) ++next;
      }
    }
    passed[static_cast<Eigen::Index>(i - begin)] = state;
  }
  return passed;
}

// All rotors with one lag; slope and offset of each.
LagFit CostOf(const FlightLog& log, double lag, std::size_t begin, std::size_t end) {
  LagFit fit{lag, 0.0, 0.0, 0.0};
  const std::size_t rotors = log.rotors.front().values.size();
  for (std::size_t r = 0; r < rotors; ++r) {
    const Eigen::VectorXd u = Lagged(log, r, lag, begin, end);
    Eigen::VectorXd w(u.size());
    for (Eigen::Index i = 0; i < w.size(); ++i) {
      w[i] = log.rotors[begin + static_cast<std::size_t>(i)].values[r];
    }
    const double mean_u = u.mean(), mean_w = w.mean();
    const Eigen::ArrayXd du = u.array() - mean_u, dw = w.array() - mean_w;
    const double slope = (du * dw).sum() / std::max(du.square().sum(), 1e-12);
    fit.cost += (dw - slope * du).square().sum();
    fit.squares += dw.square().sum();
    fit.full_speed += (mean_w + slope * (1.0 - mean_u)) / static_cast<double>(rotors);
  }
  return fit;
}

// Golden section in the logarithm, after a scan.
LagFit BestLag(const FlightLog& log, std::size_t begin, std::size_t end) {
  constexpr double kShortest = 5e-4, kStep = 1.4, kEnough = 1.005;
  LagFit best = CostOf(log, kShortest, begin, end);
  for (double lag = kShortest * kStep; lag < kLongestLag; lag *= kStep) {
    const LagFit fit = CostOf(log, lag, begin, end);
    if (fit.cost < best.cost) best = fit;
  }
  for (double step = std::sqrt(kStep); step > kEnough; step = std::sqrt(step)) {
    for (const double lag : {best.lag / step, best.lag * step}) {
      const LagFit fit = CostOf(log, lag, begin, end);
      if (fit.cost < best.cost) best = fit;
    }
  }
  return best;
}

}  // namespace

std::optional<MotorResponse> FindMotorResponse(const FlightLog& log) {
  if (log.rotors.size() < 100 || log.motors.size() < 100) return std::nullopt;
  if (log.rotors.front().values.size() != log.motors.front().values.size()) return std::nullopt;
  const double seconds = SecondsBetween(log.rotors.front().t, log.rotors.back().t);
  if (seconds < kParts * kShortestPart) return std::nullopt;
  std::vector<double> lags, speeds;
  double cost = 0.0, squares = 0.0;
  const std::size_t length = log.rotors.size() / kParts;
  for (int part = 0; part < kParts; ++part) {
    const std::size_t begin = static_cast<std::size_t>(part) * length;
    const LagFit fit = BestLag(log, begin, begin + length);
    lags.push_back(fit.lag), speeds.push_back(fit.full_speed);
    cost += fit.cost, squares += fit.squares;
  }
  const auto mean_and_sigma = [](const std::vector<double>& x) {
    const Eigen::Map<const Eigen::ArrayXd> a(x.data(), static_cast<Eigen::Index>(x.size()));
    const double mean = a.mean(), n = static_cast<double>(x.size());
    return std::pair(mean, std::sqrt((a - mean).square().sum() / (n * (n - 1.0))));
  };
  const auto [lag, scatter] = mean_and_sigma(lags);
  if (!(cost < (1.0 - kExplained) * squares)) return std::nullopt;
  if (scatter > std::max(kMostScatter * lag, kMostSeconds)) return std::nullopt;
  const double lag_sigma = std::max({scatter, kResolution * lag, kFinest});
  const auto [speed, speed_sigma] = mean_and_sigma(speeds);
  return MotorResponse{lag, lag_sigma, speed, speed_sigma};
}

}  // namespace trueline
