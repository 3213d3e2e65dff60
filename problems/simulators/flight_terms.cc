#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "problems/simulators/flight_estimate.h"
#include "problems/simulators/judge_flights.h"
#include "problems/simulators/vehicle_replay.h"

namespace trueline {
namespace {

constexpr double kMeansOver = 0.08;    // s, over which means are compared
constexpr int kBlocks = 16;            // of the flight; each is left out once
constexpr double kBySampling = 0.005;  // of an equation's spread, that samples leave uncertain

// Regressors, as means over windows: turns (rad/s^2) by rotors, rates, air speed in body axes, and
// products of rates and the rotors' angular momentum by J_r.
enum Feature : int {
  kUnit,
  kByTurn,                 // three
  kByRate = kByTurn + 3,   // three, rad/s
  kByAir = kByRate + 3,    // three, m/s
  kByGyro = kByAir + 3,    // three: of roll, pitch; the last is the momentum itself
  kByTwice = kByGyro + 3,  // two, m/s: air speed that is turned into the body once more
  kByLift = kByTwice + 2,  // m^2/s^2
  kByThrust,               // m/s^2
  kByEuler,                // three, rad/s^2: of the body's own momentum, known
  kLastFeature = kByEuler + 2,
  kFeatures
};
using Features = Eigen::Matrix<double, kFeatures, 1>;

// An equation is the force along an axis (0 to 2) or the moment about it (3 to 5).
struct Term {
  const char* name;
  int equation, feature;
};
constexpr Term kTerms[] = {
    {"K_x", 0, kByAir},      {"K_xy", 0, kByAir + 1},
    {"K_y", 1, kByAir + 1},  {"K_yx", 1, kByAir},
    {"K_z", 2, kByAir + 2},  {"translational_lift", 2, kByLift},
    {"L_p", 3, kByRate},     {"L_u", 3, kByAir},
    {"L_v", 3, kByAir + 1},  {"J_r_roll", 3, kByGyro},
    {"M_q", 4, kByRate + 1}, {"M_u", 4, kByAir},
    {"M_v", 4, kByAir + 1},  {"J_r_pitch", 4, kByGyro + 1},
    {"N_r", 5, kByRate + 2}, {"J_r_yaw", 5, kByGyro + 2},
};

struct Window {
  double middle = 0.0, begin = 0.0;  // s
  Eigen::Vector3d rate = Eigen::Vector3d::Zero(), force = rate;
  Features features = Features::Zero();
  // Of the features: weighted by the share of the window that has passed.
  Features late = features;
};

// Means of rates in neighbouring windows differ by the acceleration weighted by a triangle.
Features Between(const Window& a, const Window& b) { return a.late + b.features - b.late; }

std::vector<Window> WindowsOf(const FlightLog& log, const FlightEstimate& estimate) {
  const NeutralVehicle& v = estimate.vehicle;
  const int n = static_cast<int>(v.rotors.size());
  const MeasuredFlight flight = MeasuredStates(log, n, estimate.constants);
  const Eigen::MatrixX3d turn = TurnBySquares(v);
  const Eigen::Vector3d inertia(v.Get("I_x"), v.Get("I_y"), v.Get("I_z"));
  std::vector<Window> windows;
  Window now;
  int count = 0;
  std::size_t at_state = 0, at_speed = 0;
  const auto advance = [](const std::vector<double>& times, double t, std::size_t* at) {
    while (*at + 1 < times.size() && times[*at + 1] <= t) ++*at;
  };
  for (const ImuSample& sample : log.imu) {
    const double t = ToSeconds(sample.t);
    advance(flight.states.t, t, &at_state), advance(flight.speed_times, t, &at_speed);
    if (t < flight.states.t.front() || at_state + 1 >= flight.states.t.size()) continue;
    const auto speed = [&](std::size_t i) -> Eigen::Vector3d {
      const MovingState& x = flight.states.states[i];
      const Eigen::Quaterniond q(x[0], x[1], x[2], x[3]);
      return q.conjugate() * x.segment<3>(RotorDrivenModel::kVelocity);
    };
    const double from = flight.states.t[at_state], to = flight.states.t[at_state + 1];
    const double share = (t - from) / (to - from);
    const Eigen::Vector3d air = (1.0 - share) * speed(at_state) + share * speed(at_state + 1);
    const MovingState& x = flight.states.states[at_state];
    const Eigen::Vector3d twice = Eigen::Quaterniond(x[0], x[1], x[2], x[3]).conjugate() * air;
    const Eigen::Map<const Eigen::ArrayXd> w(flight.speeds[at_speed].data(), n);
    double momentum = 0.0, thrust = 0.0;
    for (int i = 0; i < n; ++i) {
      momentum += v.Get("spin", i) * w[i];
      thrust += v.Get("k_f", i) * w[i] * w[i] / v.Get("m");
    }
    const Eigen::Vector3d& p = sample.gyro;
    Features f;
    f << 1.0, turn.transpose() * w.square().matrix(), p, air, -p.y() * momentum / inertia.x(),
        p.x() * momentum / inertia.y(), -momentum / inertia.z(), twice.head<2>(),
        -air.head<2>().squaredNorm(), -thrust, 0.0, 0.0, 0.0;
    f.segment<3>(kByEuler) = -p.cross(inertia.cwiseProduct(p)).cwiseQuotient(inertia);
    if (count++ == 0) now.begin = t;
    now.features += f, now.rate += p, now.force += sample.accel, now.middle += t;
    now.late += (t - now.begin) / kMeansOver * f;
    if (t - now.begin < kMeansOver) continue;
    now.features /= count, now.late /= count, now.rate /= count, now.force /= count;
    now.middle /= count;
    windows.push_back(now);
    now = {}, count = 0;
  }
  return windows;
}

// Values of the unknowns, each with its sigma.
struct Fit {
  Eigen::VectorXd value, sigma;
};
Fit LeaveOut(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  const auto solve = [&](Eigen::Index begin, Eigen::Index length) -> Eigen::VectorXd {
    const auto a = X.middleRows(begin, length);
    const Eigen::MatrixXd square = X.transpose() * X - a.transpose() * a;
    return square.ldlt().solve(X.transpose() * y - a.transpose() * y.segment(begin, length));
  };
  Fit fit{solve(0, 0), Eigen::VectorXd::Zero(X.cols())};
  const Eigen::Index length = X.rows() / kBlocks;
  for (int part = 0; part < kBlocks; ++part) {
    fit.sigma += (solve(part * length, length) - fit.value).cwiseAbs2();
  }
  fit.sigma = TailsOf(kBlocks - 1) * ((kBlocks - 1.0) / kBlocks * fit.sigma).cwiseSqrt();
  return fit;
}

// With what samples leave uncertain.
FlightValue ValueOf(const Fit& fit, const Eigen::MatrixXd& X, const Eigen::VectorXd& y,
                    Eigen::Index column, bool moment = false) {
  const auto rows = static_cast<double>(X.rows());
  const double size = std::sqrt(X.col(column).squaredNorm() / rows);
  const double spread = std::sqrt((y.array() - y.mean()).square().sum() / rows);
  const double sigma = std::hypot(fit.sigma[column], kBySampling * spread / size);
  return {fit.value[column], sigma, true, size, moment};
}

// Thrust, by that of `v`, beside what air speed adds to it. It is hardly told from a bias, which is
// the fit's.
FlightValue Thrust(const std::vector<Window>& windows, double bias, const NeutralVehicle& v) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(windows.size()), 3);
  Eigen::VectorXd y(X.rows());
  for (Eigen::Index k = 0; k < X.rows(); ++k) {
    const Window& window = windows[static_cast<std::size_t>(k)];
    X.row(k) << window.features[kByThrust] / v.Get("k_f"), window.features[kByAir + 2],
        window.features[kByLift];
    y[k] = window.force.z() - bias;
  }
  return ValueOf(LeaveOut(X, y), X, y, 0);
}

// Drag along axes that are not the body's: by both horizontal forces, beside that along x and y.
FlightValue TurnedTwice(const std::vector<Window>& windows) {
  const auto pairs = static_cast<Eigen::Index>(windows.size()) - 1;
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(2 * pairs, 5);
  Eigen::VectorXd y(2 * pairs);
  for (Eigen::Index k = 0; k < 2 * pairs; ++k) {
    const Window& window = windows[static_cast<std::size_t>(k / 2)];
    const Eigen::Index axis = k % 2;
    X(k, axis) = 1.0, X(k, 2 + axis) = window.features[kByAir + axis];
    X(k, 4) = window.features[kByTwice + axis];
    y[k] = window.force[axis];
  }
  return ValueOf(LeaveOut(X, y), X, y, 4);
}

}  // namespace

std::map<std::string, FlightValue> TermsOf(const FlightLog& log, const FlightEstimate& estimate) {
  std::map<std::string, FlightValue> values;
  if (log.rotors.empty()) return values;
  const std::vector<Window> windows = WindowsOf(log, estimate);
  const auto pairs = static_cast<Eigen::Index>(windows.size()) - 1;
  if (pairs < 10 * kBlocks) return values;
  for (int equation = 0; equation < 6; ++equation) {
    const bool moment = equation >= 3;
    std::vector<int> columns = {kUnit};
    if (moment) columns.push_back(kByTurn + equation - 3);
    if (equation == 2) columns.push_back(kByThrust);
    // An accelerometer whose axes are those of another moment, as a filter or a converter may turn
    // them, shows thrust by rates.
    if (equation < 2) columns.push_back(kByRate + 1 - equation);
    const auto first = static_cast<Eigen::Index>(columns.size());
    std::vector<const char*> names;
    for (const Term& term : kTerms) {
      if (term.equation == equation) columns.push_back(term.feature), names.push_back(term.name);
    }
    Eigen::MatrixXd X(pairs, static_cast<Eigen::Index>(columns.size()));
    Eigen::VectorXd y(pairs);
    for (Eigen::Index k = 0; k < pairs; ++k) {
      const Window &a = windows[static_cast<std::size_t>(k)],
                   &b = windows[static_cast<std::size_t>(k) + 1];
      const double step = b.middle - a.middle;
      const int axis = equation % 3;
      const Features mean = moment ? Between(a, b) : a.features;
      y[k] = moment ? (b.rate[axis] - a.rate[axis]) / step - mean[kByEuler + axis] : a.force[axis];
      for (std::size_t j = 0; j < columns.size(); ++j) {
        const int c = columns[j];
        // The rotors' own moment is the change of their momentum.
        X(k, static_cast<Eigen::Index>(j)) =
            c == kByGyro + 2 ? (b.features[c] - a.features[c]) / step : mean[c];
      }
    }
    const Fit fit = LeaveOut(X, y);
    for (std::size_t j = 0; j < names.size(); ++j) {
      values[names[j]] = ValueOf(fit, X, y, first + static_cast<Eigen::Index>(j), moment);
    }
  }
  values["K_twice"] = TurnedTwice(windows);
  values["k_f"] = Thrust(windows, estimate.constants[FindRotorConstant("b_a_z")], estimate.vehicle);
  return values;
}

}  // namespace trueline
