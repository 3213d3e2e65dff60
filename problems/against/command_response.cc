#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/against/comparison.h"
#include "problems/against/references.h"

namespace trueline {
namespace {

constexpr double kStep = 0.01;                         // s, of the grid
constexpr int kWindow = 5;                             // steps, over which means are compared
constexpr double kTrimMemory = 2.0;                    // s
constexpr double kAcross = 0.03;                       // s, half of what a speed is the slope of
constexpr double kLeastFlown = 5.0;                    // of flight
constexpr double kDelays[] = {0.0, 0.01, 0.02, 0.03};  // s
constexpr double kLags[] = {0.01, 0.02, 0.03, 0.05, 0.08, 0.12};

// Sensors of one flight on an even grid, and when it flies.
struct EvenFlight {
  Eigen::MatrixX3d rate, air;  // rad/s; m/s in body axes
  std::vector<bool> flies;
  const FlightLog* log = nullptr;
  TimeNs start = 0;
  Eigen::Index steps = 0;

  TimeNs At(Eigen::Index i, double later = 0.0) const {
    return start + FromSeconds(kStep * static_cast<double>(i) + later);
  }
};

template <class Sample>
const Sample* LastBefore(const std::vector<Sample>& samples, TimeNs t) {
  const auto after = std::ranges::upper_bound(samples, t, {}, &Sample::t);
  return after == samples.begin() ? nullptr : &*(after - 1);
}

// The gyroscope's integral, so that means over steps of the grid hold all samples at any rate.
class AngleCursor {
 public:
  explicit AngleCursor(const std::vector<ImuSample>& imu) : imu_(imu) {}

  // rad, from the first sample on. Call with times that do not fall.
  Eigen::Vector3d At(TimeNs t) {
    for (; i_ + 2 < imu_.size() && imu_[i_ + 1].t <= t; ++i_) angle_ += Turned(imu_[i_ + 1].t);
    return angle_ + Turned(t);
  }

 private:
  Eigen::Vector3d Turned(TimeNs t) const {
    const ImuSample &from = imu_[i_], &to = imu_[i_ + 1];
    const double step = SecondsBetween(from.t, t), share = step / SecondsBetween(from.t, to.t);
    return step * (from.gyro + 0.5 * share * (to.gyro - from.gyro));
  }

  const std::vector<ImuSample>& imu_;
  std::size_t i_ = 0;
  Eigen::Vector3d angle_ = Eigen::Vector3d::Zero();
};

// Commands between samples, and the first before it.
Eigen::ArrayXd CommandAt(const std::vector<ChannelsSample>& motors, TimeNs t) {
  const auto values = [](const ChannelsSample& sample) {
    return Eigen::Map<const Eigen::ArrayXd>(sample.values.data(),
                                            static_cast<Eigen::Index>(sample.values.size()));
  };
  const auto after = std::ranges::upper_bound(motors, t, {}, &ChannelsSample::t);
  if (after == motors.begin()) return values(motors.front());
  if (after == motors.end()) return values(motors.back());
  const double share = SecondsBetween((after - 1)->t, t) / SecondsBetween((after - 1)->t, after->t);
  return (1.0 - share) * values(*(after - 1)) + share * values(*after);
}

EvenFlight Even(const FlightLog& log) {
  EvenFlight flight;
  flight.log = &log;
  const std::vector<PoseSample>& poses = log.mocap.empty() ? log.pose : log.mocap;
  if (log.motors.empty() || log.imu.size() < 2 || poses.empty()) return flight;
  flight.start = std::max({log.imu.front().t, log.motors.front().t, poses.front().t});
  const TimeNs end = std::min({log.imu.back().t, log.motors.back().t, poses.back().t});
  flight.steps = std::max(Eigen::Index{0},
                          static_cast<Eigen::Index>(SecondsBetween(flight.start, end) / kStep));
  flight.rate.resize(flight.steps, 3);
  flight.air.resize(flight.steps, 3);
  const double airborne = AirborneTotal(log.motors), height = LeastHeight(log);
  AngleCursor angle(log.imu);
  Eigen::Vector3d last = angle.At(flight.start);
  for (Eigen::Index i = 0; i < flight.steps; ++i) {
    const Eigen::Vector3d next = angle.At(flight.At(i + 1));
    flight.rate.row(i) = (next - last) / kStep;
    last = next;
    const PoseSample *before = LastBefore(poses, flight.At(i, 0.5 * kStep - kAcross)),
                     *now = LastBefore(poses, flight.At(i, 0.5 * kStep)),
                     *after = LastBefore(poses, flight.At(i, 0.5 * kStep + kAcross));
    const bool known = before != nullptr && after->t > before->t &&
                       SecondsBetween(before->t, after->t) < 4.0 * kAcross;
    flight.air.row(i).setZero();
    if (known) {
      const Eigen::Vector3d v_E = (after->p_E - before->p_E) / SecondsBetween(before->t, after->t);
      flight.air.row(i) = (now->q_E.conjugate() * v_E).transpose();
    }
    flight.flies.push_back(known && -now->p_E.z() > height &&
                           TotalOf(*LastBefore(log.motors, flight.At(i))) > airborne);
  }
  return flight;
}

// Rows of angular accelerations and of what they are sums of.
struct Rows {
  Eigen::MatrixXd features;
  Eigen::MatrixX3d turn;          // rad/s^2
  std::vector<Eigen::Index> use;  // rows in flight, in order of time
};

// Means over neighbouring windows differ by the acceleration weighted by a triangle.
Rows RowsOf(const EvenFlight& flight, double delay, double lag) {
  const std::vector<ChannelsSample>& motors = flight.log->motors;
  const auto n = static_cast<Eigen::Index>(motors.front().values.size());
  Eigen::MatrixXd even(flight.steps, 2 * n + 10);
  Eigen::ArrayXd speed;
  for (Eigen::Index i = 0; i < flight.steps; ++i) {
    // A step's mean turn rate is that at its middle.
    const Eigen::ArrayXd target =
        CommandAt(motors, flight.At(i, 0.5 * kStep - delay)).max(0.0).sqrt();
    if (i == 0) speed = target;
    const Eigen::ArrayXd change = -std::expm1(-kStep / lag) * (target - speed);
    speed += change;
    const Eigen::Vector3d w = flight.rate.row(i);
    even.row(i) << speed.square().transpose().matrix(), change.transpose().matrix(),
        flight.rate.row(i), w.y() * w.z(), w.x() * w.z(), w.x() * w.y(), flight.air.row(i), 1.0;
  }
  Rows rows;
  const Eigen::Index count = std::max(Eigen::Index{0}, flight.steps - 2 * kWindow + 1);
  rows.features.setZero(count, even.cols());
  rows.turn.resize(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) {
    bool flies = true;
    for (int j = 0; j < 2 * kWindow; ++j) {
      flies &= flight.flies[static_cast<std::size_t>(k + j)];
      const double weight = std::min(j, 2 * kWindow - j);
      rows.features.row(k) += weight / (kWindow * kWindow) * even.row(k + j);
    }
    rows.turn.row(k) = (flight.rate.middleRows(k + kWindow, kWindow).colwise().mean() -
                        flight.rate.middleRows(k, kWindow).colwise().mean()) /
                       (kWindow * kStep);
    if (flies) rows.use.push_back(k);
  }
  return rows;
}

// Sums of squares over the rows in flight.
struct Sums {
  Eigen::MatrixXd square, mixed;
  Eigen::Array3d left = Eigen::Array3d::Zero();  // of the turns

  void Add(const Rows& rows) {
    const Eigen::MatrixXd X = rows.features(rows.use, Eigen::all),
                          y = rows.turn(rows.use, Eigen::all);
    if (square.size() == 0) square.setZero(X.cols(), X.cols()), mixed.setZero(X.cols(), 3);
    square += X.transpose() * X;
    mixed += X.transpose() * y;
    left += y.colwise().squaredNorm().transpose().array();
  }
  Eigen::MatrixXd Solve() const {
    const double ridge = 1e-9 * square.diagonal().maxCoeff();
    Eigen::MatrixXd regular = square;
    regular.diagonal().array() += ridge;
    return regular.ldlt().solve(mixed);
  }
  // Mean over the axes of the share of the references' squares that `b` leaves.
  double Left(const Eigen::MatrixXd& b) const {
    const Eigen::Array3d explained = (b.cwiseProduct(mixed)).colwise().sum().transpose().array();
    return (1.0 - explained / left).mean();
  }
};

// The trim before each row, followed by means that forget.
Eigen::Vector3d Explained(const Rows& rows, const Eigen::MatrixXd& b, bool follow_trim) {
  const Eigen::MatrixXd y = rows.turn(rows.use, Eigen::all);
  Eigen::MatrixXd left = y - rows.features(rows.use, Eigen::all) * b;
  const auto first = std::min(left.rows(), static_cast<Eigen::Index>(kTrimMemory / kStep) / 4);
  Eigen::RowVector3d trim = left.topRows(first).colwise().mean();
  for (Eigen::Index k = 0; follow_trim && k < left.rows(); ++k) {
    const Eigen::RowVector3d now = left.row(k);
    left.row(k) -= trim;
    // What the row shows is known once both of its windows have passed.
    if (k < 2 * kWindow) continue;
    trim += -std::expm1(-kStep / kTrimMemory) * (now - trim);
  }
  if (!follow_trim) left.rowwise() -= left.colwise().mean().eval();
  const Eigen::MatrixXd about = y.rowwise() - y.colwise().mean();
  return (1.0 - left.colwise().squaredNorm().array() / about.colwise().squaredNorm().array())
      .matrix()
      .transpose();
}

}  // namespace

std::optional<CommandResponse> ResponseOf(const FlightLog& log,
                                          const std::vector<const FlightLog*>& references) {
  const EvenFlight flight = Even(log);
  std::vector<EvenFlight> others;
  for (const FlightLog* reference : references) {
    others.push_back(Even(*reference));
    if (others.back().steps < kLeastFlown / kStep) others.pop_back();
  }
  if (others.empty() || flight.steps < kLeastFlown / kStep) return std::nullopt;
  CommandResponse best;
  Eigen::MatrixXd numbers;
  double least = std::numeric_limits<double>::infinity();
  for (const double delay : kDelays) {
    for (const double lag : kLags) {
      Sums sums;
      for (const EvenFlight& other : others) sums.Add(RowsOf(other, delay, lag));
      const Eigen::MatrixXd b = sums.Solve();
      if (!(sums.Left(b) < least)) continue;
      least = sums.Left(b), numbers = b, best.delay = delay, best.lag = lag;
    }
  }
  const Rows rows = RowsOf(flight, best.delay, best.lag);
  if (numbers.size() == 0 || static_cast<double>(rows.use.size()) < kLeastFlown / kStep) {
    return std::nullopt;
  }
  best.explained = Explained(rows, numbers, true);
  best.explained_without_trim = Explained(rows, numbers, false);
  return best;
}

}  // namespace trueline
