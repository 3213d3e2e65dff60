#include "problems/calibration/without_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/calibration/write_calibration.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kJackknifeParts = 10;
constexpr double kStudent = 1.155;                        // 95 % of nine degrees of freedom: factor
constexpr double kLongestLag = 0.4, kShortestLag = 5e-4;  // s
constexpr double kSlowestImu = 80.0, kSlowestInput = 40.0;                // Hz
constexpr double kShortestFlight = 15.0, kLongestGap = 0.1, kEnds = 2.0;  // s
// Of thrust: what an accelerometer is off by, and the curve of commands beside its hover.
constexpr double kBiasSigma = 0.02, kCurveSigma = 0.03;
constexpr double kFilterSigma = 0.002;  // s, of a lag, by the delays of filters and stamps
constexpr double kAverage = 0.04, kAverageSigma = 0.01;  // s, of smoothed samples, and of their lag
// Gain from which samples move without noise of their own from one to the next.
constexpr double kSmoothThrust = 0.5, kSmoothTurn = 0.95;
constexpr int kThrust = 3;  // the channel after the three turn rates

// The whole flight, then the flight without each of its parts.
using Jackknifed = Eigen::Array<double, 1 + kJackknifeParts, 1>;

double SigmaOf(const Jackknifed& x) {
  const auto left_out = x.tail<kJackknifeParts>();
  constexpr double kShare = (kJackknifeParts - 1.0) / kJackknifeParts;
  return kStudent * std::sqrt(kShare * (left_out - left_out.mean()).square().sum());
}
bool IsClear(const Jackknifed& x) { return x[0] > 3.0 * SigmaOf(x); }

struct EvenFlight {
  double dt;        // s
  bool speeds;      // inputs are rotor speeds, else commands
  MatrixXd inputs;  // by time, then rotor
  MatrixXd accel, gyro;
};

struct ChannelModel {
  double lag, idle;     // s, share of the full speed at no command
  double level, slope;  // gains of the steady filter that predicts what the rotors do not
  bool averaged;        // samples over kAverage
};

// Integrals. By the past alone: a measurement's own sample would enter what predicts it.
MatrixXd PastSum(const MatrixXd& x, double dt) {
  MatrixXd sum = MatrixXd::Zero(x.rows(), x.cols());
  for (Eigen::Index k = 1; k < x.rows(); ++k) sum.row(k) = sum.row(k - 1) + dt * x.row(k - 1);
  return sum;
}

MatrixXd Averages(const MatrixXd& x, double dt) {
  const Eigen::Index n = std::max<Eigen::Index>(1, std::lround(kAverage / dt));
  MatrixXd out(x.rows() / n, x.cols());
  for (Eigen::Index k = 0; k < out.rows(); ++k) {
    out.row(k) = x.middleRows(k * n, n).colwise().mean();
  }
  return out;
}

// What predicts a channel, and the channel as the last column. The first is the rotors' squared
// speeds, behind a lag of first order, by their weights. Others: damping and, of rates, the product
// of the other two and (yaw) the rotors' own angular momentum.
MatrixXd Columns(const EvenFlight& flight, const VectorXd& weights, int channel,
                 const ChannelModel& m) {
  MatrixXd speeds = flight.inputs;
  const double left = std::exp(-flight.dt / m.lag);
  for (Eigen::Index k = 1; k < speeds.rows(); ++k) {
    speeds.row(k) =
        flight.inputs.row(k - 1) + left * (speeds.row(k - 1) - flight.inputs.row(k - 1));
  }
  speeds = m.idle + (1.0 - m.idle) * speeds.array();
  VectorXd push = speeds.cwiseAbs2() * weights;
  const Eigen::Index n = push.size();
  if (channel == kThrust) {
    const VectorXd y = -flight.accel.col(2);
    MatrixXd all(n, 3);
    all << push, PastSum(y.array() - y.mean(), flight.dt), y;
    if (!m.averaged) return all;
    all.col(1).swap(all.col(2));
    return Averages(all.leftCols(2), flight.dt);
  }
  push.head(n - 1) = 0.5 * (push.head(n - 1) + push.tail(n - 1)).eval();
  const VectorXd y = flight.gyro.col(channel);
  MatrixXd drive(n, 3);
  drive << push, y,
      flight.gyro.col((channel + 1) % 3).cwiseProduct(flight.gyro.col((channel + 2) % 3));
  MatrixXd all(n, channel == 2 ? 5 : 4);
  all.leftCols(3) = PastSum(drive, flight.dt);
  if (channel == 2) all.col(3) = speeds * weights;
  all.rightCols(1) = y;
  return all;
}

// Products of the one-step errors that a steady filter of level and slope makes of the columns, by
// part of the flight.
std::vector<MatrixXd> ProductsOf(const MatrixXd& columns, const ChannelModel& m) {
  MatrixXd errors(columns.rows(), columns.cols());
  Eigen::RowVectorXd at = columns.row(0), rate = Eigen::RowVectorXd::Zero(columns.cols());
  for (Eigen::Index k = 0; k < columns.rows(); ++k) {
    at += rate;
    errors.row(k) = columns.row(k) - at;
    at += m.level * errors.row(k), rate += m.slope * errors.row(k);
  }
  const Eigen::Index settled = m.averaged ? 20 : 100;
  const Eigen::Index each = (errors.rows() - settled) / kJackknifeParts;
  std::vector<MatrixXd> products;
  for (int p = 0; p < kJackknifeParts; ++p) {
    const auto part = errors.middleRows(settled + p * each, each);
    products.emplace_back(part.transpose() * part);
  }
  return products;
}

// Regression without a part (from 1; 0: of the whole): the first slope, and the logarithm of the
// squares that are left.
struct Regressed {
  double slope, cost;
};
Regressed Regress(const std::vector<MatrixXd>& products, int without) {
  MatrixXd sum = MatrixXd::Zero(products[0].rows(), products[0].cols());
  for (int p = 0; p < kJackknifeParts; ++p) {
    if (p + 1 != without) sum += products[static_cast<std::size_t>(p)];
  }
  const Eigen::Index n = sum.rows() - 1;
  const VectorXd right = sum.col(n).head(n), slopes = sum.topLeftCorner(n, n).ldlt().solve(right);
  return {slopes[0], std::log(sum(n, n) - right.dot(slopes))};
}

// The likelihood's maximum over logarithms of lag and gains and over the idle share of commands, by
// steps along each that shrink.
ChannelModel BestModel(const EvenFlight& flight, const VectorXd& weights, int channel,
                       bool averaged) {
  using Point = std::array<double, 4>;
  const auto share = [](double x) { return 1.0 / (1.0 + std::exp(-x)); };
  const auto model = [&](const Point& x) {
    const double level = share(x[1]), idle = flight.speeds ? 0.0 : -0.3 + 0.9 * share(x[3]);
    return ChannelModel{std::exp(x[0]), idle, level, level * level * share(x[2]), averaged};
  };
  const auto cost = [&](const Point& x) {
    const ChannelModel m = model(x);
    if (m.lag > kLongestLag || m.lag < kShortestLag) return HUGE_VAL;
    return Regress(ProductsOf(Columns(flight, weights, channel, m), m), 0).cost;
  };
  Point at = {std::log(0.04), channel == kThrust ? -3.0 : 0.0, -2.0, 0.0};
  double best = cost(at);
  const std::size_t free = flight.speeds ? 3 : 4;
  for (double step = 0.8; step > 0.02; step *= 0.5) {
    for (std::size_t i = 0, since = 0; since < free; i = (i + 1) % free, ++since) {
      for (const double by : {-step, step}) {
        Point next = at;
        next[i] += by;
        const double value = cost(next);
        if (!(value < best)) continue;
        best = value, at = next, since = 0;
        break;
      }
    }
  }
  return model(at);
}

struct ChannelFit {
  Jackknifed lag, slope;  // s; by a rotor's squared speed, or by its command near hover
  bool smooth = false;    // filters made the samples, which hide how the rotors act
};

ChannelFit FitChannel(const EvenFlight& flight, const VectorXd& weights, int channel,
                      bool averaged) {
  constexpr int kGrid = 25;
  constexpr double kStep = 0.06;  // of the lag's logarithm
  const ChannelModel best = BestModel(flight, weights, channel, averaged);
  std::vector<std::vector<MatrixXd>> products;
  const auto lag_at = [&](double k) { return best.lag * std::exp(kStep * (k - kGrid)); };
  for (int k = 0; k <= 2 * kGrid; ++k) {
    ChannelModel m = best;
    m.lag = lag_at(k);
    products.push_back(ProductsOf(Columns(flight, weights, channel, m), m));
  }
  const double hover = best.idle + (1.0 - best.idle) * flight.inputs.mean();
  ChannelFit fit;
  for (int left_out = 0; left_out <= kJackknifeParts; ++left_out) {
    std::vector<double> costs;
    for (const auto& of_lag : products) costs.push_back(Regress(of_lag, left_out).cost);
    const auto k = static_cast<std::size_t>(std::ranges::min_element(costs) - costs.begin());
    double minimum = static_cast<double>(k);
    if (k > 0 && k + 1 < costs.size()) {
      const double left = costs[k - 1] - costs[k], right = costs[k + 1] - costs[k];
      if (left + right > 0.0) minimum += 0.5 * (left - right) / (left + right);
    }
    fit.lag[left_out] = lag_at(minimum);
    fit.slope[left_out] = Regress(products[k], left_out).slope *
                          (flight.speeds ? 1.0 : 2.0 * (1.0 - best.idle) * hover);
  }
  fit.smooth = best.level > (channel == kThrust ? kSmoothThrust : kSmoothTurn);
  return fit;
}

// The longest stretch in flight (inputs above 0.7 of their median) without gaps, less its ends.
EvenFlight FlightOf(const FlightLog& log, const std::vector<ChannelsSample>& inputs,
                    const RotorDataOptions& data) {
  const auto rotors = std::ssize(inputs[0].values);
  std::vector<double> sums;
  for (const ChannelsSample& s : inputs) {
    sums.push_back(Eigen::Map<const VectorXd>(s.values.data(), rotors).sum());
  }
  std::vector<double> sorted = sums;
  std::ranges::sort(sorted);
  const double least = 0.7 * sorted[sorted.size() / 2];
  const TimeNs first = log.imu.front().t + FromSeconds(data.start);
  const TimeNs last = log.imu.back().t - FromSeconds(data.end);
  TimeNs begin = 0, end = 0, from = 0;
  std::size_t i = 0, u = 0;
  for (std::size_t k = 1; k < inputs.size(); ++k) {
    const TimeNs before = inputs[k - 1].t, t = inputs[k].t;
    bool gap = SecondsBetween(before, t) > kLongestGap || before < first || t > last;
    for (; i + 1 < log.imu.size() && log.imu[i].t < t; ++i) {
      gap = gap || SecondsBetween(log.imu[i].t, log.imu[i + 1].t) > kLongestGap;
    }
    if (gap || from == 0 || sums[k] < least) from = t;
    if (t - from > end - begin) begin = from, end = t;
  }
  begin += FromSeconds(kEnds), end -= FromSeconds(kEnds);
  const auto step_of = [](const auto& samples) {
    return SecondsBetween(samples.front().t, samples.back().t) /
           static_cast<double>(samples.size() - 1);
  };
  const double dt = step_of(log.imu), seconds = SecondsBetween(begin, end);
  if (seconds < kShortestFlight || dt * kSlowestImu > 1.0 ||
      step_of(inputs) * kSlowestInput > 1.0) {
    throw ErrorAt(log.directory, 0,
                  fmt::format("without poses a flight needs {} s in the air without gaps, the IMU "
                              "at {} Hz and its rotors at {} Hz; here are {:.1f} s, {:.0f} and "
                              "{:.0f} Hz",
                              kShortestFlight, kSlowestImu, kSlowestInput, std::max(0.0, seconds),
                              1.0 / dt, 1.0 / step_of(inputs)));
  }
  const auto count = static_cast<Eigen::Index>(seconds / dt);
  EvenFlight flight{dt, &inputs == &log.rotors, MatrixXd(count, rotors), MatrixXd(count, 3),
                    MatrixXd(count, 3)};
  i = 0;
  for (Eigen::Index k = 0; k < count; ++k) {
    const TimeNs t = begin + FromSeconds(dt * static_cast<double>(k));
    while (i + 2 < log.imu.size() && log.imu[i + 1].t <= t) ++i;
    while (u + 1 < inputs.size() && inputs[u + 1].t <= t + FromSeconds(0.25 * dt)) ++u;
    const ImuSample &a = log.imu[i], &b = log.imu[i + 1];
    const double share = std::clamp(SecondsBetween(a.t, t) / SecondsBetween(a.t, b.t), 0.0, 1.0);
    flight.accel.row(k) = a.accel + share * (b.accel - a.accel);
    flight.gyro.row(k) = a.gyro + share * (b.gyro - a.gyro);
    flight.inputs.row(k) = Eigen::Map<const Eigen::RowVectorXd>(inputs[u].values.data(), rotors);
  }
  return flight;
}

std::array<ChannelFit, 4> FitChannels(const EvenFlight& flight, const RotorVehicle& vehicle) {
  const std::vector<Rotor>& rotors = vehicle.model.rotors();
  const double* centre = &vehicle.parameters[RotorDrivenModel::kCentre];
  MatrixXd weights(std::ssize(rotors), 4);
  for (Eigen::Index i = 0; i < weights.rows(); ++i) {
    const Rotor& r = rotors[static_cast<std::size_t>(i)];
    weights.row(i) << centre[1] - r.position.y(), r.position.x() - centre[0], -r.spin, 1.0;
  }
  std::array<ChannelFit, 4> fits;
  for (std::size_t c = 0; c < fits.size(); ++c) {
    const auto channel = static_cast<int>(c);
    fits[c] = FitChannel(flight, weights.col(channel), channel, false);
    if (channel != kThrust || !fits[c].smooth) continue;
    fits[c] = FitChannel(flight, weights.col(channel), channel, true);
    fits[c].smooth = true;
  }
  return fits;
}

// Of thrust, roll and pitch where they show it, widened where they differ.
void AddLag(const std::array<ChannelFit, 4>& fits, PoselessCalibration* result) {
  double weights = 0.0, sum = 0.0, squares = 0.0, count = 0.0;
  for (const std::size_t c : {3U, 0U, 1U}) {
    const double lag = fits[c].lag[0];
    const double sigma = std::hypot(SigmaOf(fits[c].lag), fits[c].smooth ? kAverageSigma : 0.0);
    const bool inside = lag > 2.0 * kShortestLag && lag < 0.9 * kLongestLag;
    if (!inside || !(sigma > 0.0) || (c != kThrust && fits[c].smooth)) continue;
    const double weight = 1.0 / (sigma * sigma);
    weights += weight, sum += weight * lag, squares += weight * lag * lag, count += 1.0;
  }
  const double lag = sum / weights, scatter = (squares - sum * lag) / std::max(1.0, count - 1.0);
  const double sigma = std::hypot(std::sqrt(std::max(1.0, scatter) / weights), kFilterSigma);
  if (sigma < 0.5 * lag) {
    result->parameters.push_back({"motor_lag", lag, sigma, "s", "identified"});
  } else {
    result->not_shown.emplace_back("motor_lag: change thrust quickly, up and down");
  }
}

}  // namespace

PoselessCalibration CalibrateWithoutPoses(const FlightLog& log,
                                          const RotorCalibrationOptions& options) {
  const std::vector<Rotor>& rotors = options.vehicle.model.rotors();
  const auto n = static_cast<double>(rotors.size());
  const auto has = [&](const std::vector<ChannelsSample>& inputs) {
    return inputs.size() > 1 && inputs.front().values.size() == rotors.size();
  };
  if (!has(log.rotors) && !has(log.motors)) {
    throw ErrorAt(log.directory, 0,
                  fmt::format("has neither speeds (rotors.csv) nor commands (motors.csv) of the "
                              "vehicle's {} rotors",
                              n));
  }
  PoselessCalibration result;
  const auto add = [&](const char* name, double value, double sigma, const char* unit) {
    result.parameters.push_back({name, value, sigma, unit, "identified"});
  };
  std::array<ChannelFit, 4> fits;
  Jackknifed thrust;  // m/s^2 by a rotor's squared speed, or command
  double systematic = kCurveSigma;
  if (has(log.motors)) {
    const EvenFlight flight = FlightOf(log, log.motors, options.data);
    fits = FitChannels(flight, options.vehicle);
    thrust = fits[kThrust].slope;
    AddLag(fits, &result);
    add("hover_command", flight.inputs.mean(), 0.0, "1");
    const double relative = n / -flight.accel.col(2).mean();
    if (IsClear(thrust)) {
      add("thrust_slope", relative * thrust[0],
          relative * std::hypot(SigmaOf(thrust), systematic * thrust[0]), "1");
    }
  } else {
    result.not_shown.emplace_back("motor_lag: log motor commands, too");
  }
  const double mass = options.vehicle.parameters[RotorDrivenModel::kMass];
  if (has(log.rotors)) {
    const EvenFlight flight = FlightOf(log, log.rotors, options.data);
    fits = FitChannels(flight, options.vehicle);
    thrust.setConstant(-flight.accel.col(2).mean() / flight.inputs.rowwise().squaredNorm().mean());
    systematic = kBiasSigma;
    double nominal = 0.0;
    for (const Rotor& rotor : rotors) nominal += rotor.k_f / n;
    add("k_f", thrust[0] * mass / nominal, systematic * thrust[0] * mass / nominal, "1");
  }
  constexpr std::array kNames = {"I_x", "I_y", "k_m/(k_f I_z)"};
  const bool smooth = fits[0].smooth || fits[1].smooth || fits[2].smooth;
  for (std::size_t c = 0; c < kNames.size(); ++c) {
    const Jackknifed x =
        c < 2 ? (mass * thrust / fits[c].slope).eval() : (fits[c].slope / thrust / mass).eval();
    const char* why = smooth ? "the gyroscope's samples are smoothed; log them unfiltered"
                      : c == 2 && !has(log.rotors) ? "commands tell too little; log rotor speeds"
                      : !IsClear(fits[c].slope) || !IsClear(thrust)
                          ? "turns do not follow the rotors; check their order and spins, and turn "
                            "hard to both sides"
                          : nullptr;
    if (why != nullptr) {
      result.not_shown.push_back(fmt::format("{}: {}", kNames[c], why));
    } else {
      add(kNames[c], x[0], std::hypot(SigmaOf(x), systematic * x[0]),
          c < 2 ? "kg m^2" : "1/(kg m)");
    }
  }
  result.not_shown.emplace_back("m: the stated mass scales k_f and inertia; weigh it");
  result.not_shown.emplace_back(
      "drag, centre of mass, places and biases of sensors, k_m apart from I_z: log poses");
  const bool shown =
      std::ranges::any_of(result.parameters, [](const auto& p) { return p.sigma > 0; });
  result.verdict.word = shown ? "usable" : "unusable";
  return result;
}

void WriteCalibration(const PoselessCalibration& c, const YAML::Node& provenance,
                      const std::filesystem::path& directory) {
  YAML::Node node = VerdictNode(c.verdict, {});
  node["estimator"] = "without_poses";
  node["drive"] = "rotors";
  node["parameters"] = ParameterNode(c.parameters);
  node["unobservable"] = c.not_shown;
  node["provenance"] = provenance;
  WriteFileAtomically(directory / "calibration.yaml", TextOf(node));
}

std::string CalibrationTable(const PoselessCalibration& c) {
  std::string table = "without poses: what IMU and rotors show alone\n";
  for (const ParameterEstimate& p : c.parameters) {
    table += fmt::format("{:<14}{:>13.5g}{:>12.2g}  {}\n", p.name, p.value, p.sigma, p.unit);
  }
  for (const std::string& text : c.not_shown) table += "not shown: " + text + "\n";
  return table + VerdictText(c.verdict);
}

}  // namespace trueline
