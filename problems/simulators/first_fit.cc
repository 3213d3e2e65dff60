#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "problems/simulators/flight_estimate.h"
#include "problems/simulators/judge_flights.h"

namespace trueline {
namespace {

constexpr double kWindow = 0.08;    // s, over which turn rates and moments are compared
constexpr double kUsualLag = 0.05;  // s
constexpr double kThreeSigma = 3.0;

// Squared speeds at `t`: of the last sample.
const ChannelsSample& At(const std::vector<ChannelsSample>& samples, TimeNs t) {
  auto next = std::upper_bound(samples.begin(), samples.end(), t,
                               [](TimeNs at, const ChannelsSample& s) { return at < s.t; });
  return next == samples.begin() ? *next : *std::prev(next);
}

// What a flight shows of its rotors' moments.
struct Turns {
  double force = 0.0;       // m/s^2, sum of the thrust that the accelerometer shows
  Eigen::VectorXd squares;  // rad^2/s^2, the same sum of squared speeds, by rotor
  // By pair of neighbouring windows: change of the mean rates (rad/s), and integrals of squared
  // speeds that make it (rad^2/s).
  Eigen::MatrixX3d changes;
  Eigen::MatrixXd pushes;
};

// `lag` (s): of the rotors behind `speeds`.
Turns TurnsOf(const std::vector<ChannelsSample>& speeds, double lag,
              const std::vector<ImuSample>& imu) {
  Turns turns;
  const auto rotors = static_cast<int>(speeds.front().values.size());
  turns.squares = Eigen::VectorXd::Zero(rotors);
  Eigen::VectorXd push = turns.squares, push_before = turns.squares;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero(), rate_before = rate;
  std::vector<Eigen::Vector3d> changes;
  std::vector<Eigen::VectorXd> pushes;
  double length = 0.0;
  int count = 0;
  bool first = true;
  // Mean rates of neighbouring windows differ by the acceleration between their middles: half of
  // what the rotors do in each.
  for (std::size_t i = 1; i < imu.size(); ++i) {
    const ImuSample& sample = imu[i];
    const TimeNs t = sample.t - FromSeconds(lag);
    if (t < speeds.front().t || t > speeds.back().t) continue;
    const std::vector<double>& now = At(speeds, t).values;
    const Eigen::VectorXd squares =
        Eigen::Map<const Eigen::VectorXd>(now.data(), rotors).cwiseAbs2();
    const double dt = SecondsBetween(imu[i - 1].t, sample.t);
    turns.force -= sample.accel.z();
    turns.squares += squares;
    push += squares * dt;
    rate += sample.gyro, ++count, length += dt;
    if (length < kWindow) continue;
    rate /= count;
    if (!first) {
      changes.emplace_back(rate - rate_before);
      pushes.emplace_back(0.5 * (push + push_before));
    }
    first = false;
    rate_before = rate, push_before = push;
    rate.setZero(), push.setZero(), count = 0, length = 0.0;
  }
  turns.changes.resize(static_cast<int>(changes.size()), 3);
  turns.pushes.resize(static_cast<int>(changes.size()), rotors);
  for (int i = 0; i < turns.changes.rows(); ++i) {
    turns.changes.row(i) = changes[static_cast<std::size_t>(i)];
    turns.pushes.row(i) = pushes[static_cast<std::size_t>(i)];
  }
  return turns;
}

// Slope and correlation of y over x, each less its mean.
void Regress(const Eigen::ArrayXd& x, const Eigen::ArrayXd& y, double* slope, double* correlation) {
  if (x.size() < 10) return;
  const double xy = ((x - x.mean()) * (y - y.mean())).sum();
  const double xx = (x - x.mean()).square().sum(), yy = (y - y.mean()).square().sum();
  if (!(xx > 0.0 && yy > 0.0)) return;
  *slope = xy / xx;
  *correlation = xy / std::sqrt(xx * yy);
}

FirstFit FitTo(const Turns& turns, const NeutralVehicle& vehicle) {
  FirstFit fit;
  double thrust = 0.0;
  for (int i = 0; i < turns.squares.size(); ++i) thrust += vehicle.Get("k_f", i) * turns.squares[i];
  if (thrust > 0.0) fit.thrust = turns.force * vehicle.Get("m") / thrust;
  const Eigen::MatrixX3d by_rotors = turns.pushes * TurnBySquares(vehicle);
  for (int k = 0; k < 3; ++k) {
    Regress(by_rotors.col(k), turns.changes.col(k), &fit.turn[k], &fit.correlation[k]);
  }
  return fit;
}

bool FitTheRotors(const std::vector<ChannelsSample>& speeds, const FlightLog& log,
                  const NeutralVehicle& vehicle) {
  return !speeds.empty() && !log.imu.empty() &&
         speeds.front().values.size() == vehicle.rotors.size();
}

constexpr int kParts = 8;  // of the flight, each fitted alone: their scatter is the sigma
constexpr double kShortestPart = 1.0;                       // s
constexpr double kMostScatter = 0.2, kMostSeconds = 0.003;  // of a lag that is shown: a share, s
constexpr double kExplained = 0.5;     // of the speeds' squares, that commands explain at least
constexpr double kResolution = 0.005;  // of the search: a share
constexpr double kLongestLag = 0.5;    // s
constexpr double kBend = 0.5;          // of a response beyond the speeds that were flown

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

Eigen::MatrixX3d TurnBySquares(const NeutralVehicle& v) {
  Eigen::MatrixX3d turn(static_cast<int>(v.rotors.size()), 3);
  for (int i = 0; i < turn.rows(); ++i) {
    const double k_f = v.Get("k_f", i);
    turn.row(i) << -v.Get("y_M", i) * k_f / v.Get("I_x"), v.Get("x_M", i) * k_f / v.Get("I_y"),
        -v.Get("spin_k_m", i) / v.Get("I_z");
  }
  return turn;
}

FirstFit FitFirst(const FlightLog& log, const NeutralVehicle& vehicle) {
  if (!FitTheRotors(log.rotors, log, vehicle)) return {};
  return FitTo(TurnsOf(log.rotors, 0.0, log.imu), vehicle);
}

RotorOrder OrderByFlight(const FlightLog& log, const NeutralVehicle& vehicle) {
  RotorOrder stated{std::vector<int>(vehicle.rotors.size())};
  std::iota(stated.rotors.begin(), stated.rotors.end(), 0);
  // Commands stand for speeds that follow them.
  const bool measured = !log.rotors.empty();
  const std::vector<ChannelsSample>& speeds = measured ? log.rotors : log.motors;
  if (!FitTheRotors(speeds, log, vehicle) || stated.rotors.size() > 6) return stated;
  const Turns turns = TurnsOf(speeds, measured ? 0.0 : kUsualLag, log.imu);
  const auto roll_and_pitch = [&](const std::vector<int>& by) {
    NeutralVehicle v = vehicle;
    for (std::size_t i = 0; i < by.size(); ++i) {
      v.rotors[i] = vehicle.rotors[static_cast<std::size_t>(by[i])];
    }
    const FirstFit fit = FitTo(turns, v);
    return std::min(fit.correlation[0], fit.correlation[1]);
  };
  RotorOrder best = stated;
  std::vector<int> order = stated.rotors;
  const double own = roll_and_pitch(order);
  double most = own;
  while (std::next_permutation(order.begin(), order.end())) {
    const double score = roll_and_pitch(order);
    if (score > most) most = score, best.rotors = order;
  }
  // By chance a correlation has a sigma of one over the root of the count.
  const double chance = kThreeSigma / std::sqrt(1.0 + static_cast<double>(turns.changes.rows()));
  if (most < chance || (own > 0.0 && own > 0.5 * most)) best = stated;
  best.shown = roll_and_pitch(best.rotors) > chance;
  return best;
}

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
  const double tails = TailsOf(kParts - 1);
  // What commands did between samples is not known.
  const double between = SecondsBetween(log.motors.front().t, log.motors.back().t) /
                         (std::sqrt(12.0) * static_cast<double>(log.motors.size()));
  const double lag_sigma = std::hypot(std::max(tails * scatter, kResolution * lag), between);
  const auto [speed, speed_sigma] = mean_and_sigma(speeds);
  // The response may bend where the flight has not been.
  double fastest = 0.0;
  for (const ChannelsSample& sample : log.rotors) {
    fastest = std::max(fastest, *std::ranges::max_element(sample.values));
  }
  const double beyond = kBend * std::max(0.0, speed - fastest);
  return MotorResponse{lag, lag_sigma, speed, std::hypot(tails * speed_sigma, beyond)};
}

}  // namespace trueline
