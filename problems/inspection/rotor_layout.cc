#include "problems/inspection/rotor_layout.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/inspection/clear.h"
#include "problems/inspection/vector_match.h"

namespace trueline {
namespace {

constexpr int kMostRotors = 8;
// After the rotors a constant, three rates, and three products of rates.
enum : int { kConstant = kMostRotors, kTerms = kConstant + 7, kOthers = kTerms - kMostRotors };
// Of the largest eigenvalue of the channels' motion: less is what a motor's lag leaves of a mixer's
// directions, not one of the mixer.
constexpr double kLeastMotion = 1e-3;

using Terms = Eigen::Matrix<double, kTerms, 1>;
using Squares = Eigen::Matrix<double, kMostRotors, 1>;

// Of the angular acceleration by axis.
struct LayoutNormal : NormalSums<kTerms, 3> {
  // Unused terms have no data; a small ridge keeps them at zero.
  Eigen::Matrix<double, kTerms, 3> Solve() const {
    const Eigen::VectorXd ridge = 1e-9 * a.diagonal().array() + 1e-12;
    return (a + Eigen::MatrixXd(ridge.asDiagonal())).ldlt().solve(b);
  }
  Eigen::Vector3d Explained() const {
    const Eigen::Matrix<double, kTerms, 3> s = Solve();
    const Eigen::RowVector3d y = b.row(kConstant);  // sums
    Eigen::Vector3d share;
    for (int axis = 0; axis < 3; ++axis) {
      const double total = yy[axis] - y[axis] * y[axis] / n;
      const double rest = yy[axis] - s.col(axis).dot(b.col(axis));
      share[axis] = total > 0.0 ? 1.0 - std::max(0.0, rest) / total : 0.0;
    }
    return share;
  }
};

// The sums over `count` channels that remain once the other terms and the channels' sum are fitted.
MomentSums MomentsOf(const LayoutNormal& normal, Eigen::Index count) {
  Eigen::MatrixXd nuisance = Eigen::MatrixXd::Zero(kTerms, kOthers + 1);
  nuisance.bottomLeftCorner(kOthers, kOthers).setIdentity();
  nuisance.col(kOthers).head(count).setOnes();
  const Eigen::MatrixXd seen = normal.a * nuisance;
  const Eigen::MatrixXd own = nuisance.transpose() * seen;
  const Eigen::MatrixXd fitted = own.ldlt().solve(seen.transpose());
  const Eigen::MatrixXd squares = normal.a - seen * fitted;
  const Eigen::MatrixXd moments = normal.b - fitted.transpose() * (nuisance.transpose() * normal.b);
  return {squares.topLeftCorner(count, count), moments.topRows(count).transpose()};
}

// Channels scaled to squares of about 1, with the scale.
RunningIntegral<kMostRotors> SquaresOf(const FlightLog& log,
                                       const std::vector<ChannelsSample>& channels, double* scale) {
  const std::size_t n = channels.front().values.size();
  const auto squares_of = [n](const ChannelsSample& sample) {
    Squares s = Squares::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      s[static_cast<Eigen::Index>(i)] = sample.values[i] * sample.values[i];
    }
    return s;
  };
  double sum = 0.0;
  for (const ChannelsSample& sample : channels) {
    sum += squares_of(sample).sum() / static_cast<double>(n);
  }
  *scale = std::max(1e-12, sum / static_cast<double>(channels.size()));
  const LogClock clock(log);
  RunningIntegral<kMostRotors> squares(GridStep(log), 0.15);
  // Stamps far from the flight's would make a grid without end.
  constexpr double kAround = 2.0;  // s
  const double end = clock(log.imu.back().t);
  for (const ChannelsSample& sample : channels) {
    const double t = clock(sample.t);
    if (t < -kAround || t > end + kAround) continue;
    squares.Add(t, squares_of(sample) / *scale);
  }
  return std::move(squares).Integrated();
}

class LayoutFit {
 public:
  LayoutFit(const FlightLog& log, const std::vector<ChannelsSample>& channels)
      : gyro_(GyroIntegral(log)) {
    const LogClock clock(log);
    squares_ = SquaresOf(log, channels, &scale_);
    const double end = clock(log.imu.back().t);
    const double step = std::max(0.01, end / static_cast<double>(kMostPairs));
    for (double t = 0.5; t < end - 0.5; t += step) times_.push_back(t);
  }

  BlocksOf<LayoutNormal> Blocks(double lag) const {
    BlocksOf<LayoutNormal> blocks;
    for (std::size_t i = 0; i < times_.size(); ++i) {
      const double t = times_[i], at = t - lag;
      if (!gyro_.Knows(t - kCoarseStep, t + kCoarseStep) ||
          !squares_.Knows(at - kCoarseStep, at + kCoarseStep))
        continue;
      const Eigen::Vector3d after = gyro_.Mean(t, t + kCoarseStep),
                            before = gyro_.Mean(t - kCoarseStep, t);
      const Eigen::Vector3d w = 0.5 * (after + before);
      Terms x;
      x << (squares_.At(at + kCoarseStep) - 2.0 * squares_.At(at) + squares_.At(at - kCoarseStep)) /
               (kCoarseStep * kCoarseStep),
          1.0, w, w.y() * w.z(), w.z() * w.x(), w.x() * w.y();
      blocks[i * kBlocks / times_.size()].Add(x, (after - before) / kCoarseStep);
    }
    return blocks;
  }
  double scale() const { return scale_; }

 private:
  RunningIntegral<3> gyro_;
  RunningIntegral<kMostRotors> squares_;
  double scale_ = 1.0;
  std::vector<double> times_;
};

struct LagTrial {
  double lag = 0.0;  // s
  Eigen::Vector3d explained = Eigen::Vector3d::Zero();
};

LagTrial BestLag(const LayoutFit& fit, const UsualLag& range) {
  LagTrial best;
  const int first = static_cast<int>(std::round(range.least / kFineStep));
  const int last = static_cast<int>(std::round(range.most / kFineStep));
  for (int k = first; k <= last; ++k) {
    const LayoutNormal total = Total(fit.Blocks(k * kFineStep));
    if (total.n < 100.0) continue;
    const Eigen::Vector3d explained = total.Explained();
    if (explained.sum() > best.explained.sum()) best = {k * kFineStep, explained};
  }
  return best;
}

// What each block leaves unexplained by the solution of the whole, of each axis' total, summed.
std::array<double, kBlocks> RestOfBlocks(const LayoutFit& fit, double lag) {
  const auto blocks = fit.Blocks(lag);
  const LayoutNormal total = Total(blocks);
  const Eigen::Matrix<double, kTerms, 3> s = total.Solve();
  std::array<double, kBlocks> rest{};
  for (std::size_t k = 0; k < kBlocks; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const double square = blocks[k].yy[axis] - 2.0 * s.col(axis).dot(blocks[k].b.col(axis)) +
                            s.col(axis).dot(blocks[k].a * s.col(axis));
      rest[k] += square / std::max(1e-12, total.yy[axis]);
    }
  }
  return rest;
}

// Whether most parts of the flight, and not one manoeuvre alone, are explained better at `lag`.
bool IsClearlyBetter(const LayoutFit& fit, double lag, double other) {
  const auto rest = RestOfBlocks(fit, lag), rest_of_other = RestOfBlocks(fit, other);
  double sum = 0.0, squares = 0.0;
  for (std::size_t k = 0; k < kBlocks; ++k) {
    const double gain = rest_of_other[k] - rest[k];
    sum += gain;
    squares += gain * gain;
  }
  const double scatter = squares - sum * sum / kBlocks;
  return sum > 0.0 && sum * sum > kLikely * kLikely * scatter;
}

}  // namespace

MomentSums::MomentSums(Eigen::MatrixXd squares, Eigen::Matrix3Xd moments)
    : squares_(std::move(squares)), moments_(std::move(moments)) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> motion(squares_);
  const double least = kLeastMotion * motion.eigenvalues().maxCoeff();
  free_.setZero();
  Eigen::Index spanned = 0;
  for (Eigen::Index k = 0; k < squares_.cols(); ++k) {
    const double size = motion.eigenvalues()[k];
    if (!(size > least)) continue;
    ++spanned;
    free_ += (moments_ * motion.eigenvectors().col(k)).cwiseAbs2() / size;
  }
  spans_all_ = spanned + 1 >= squares_.cols();  // the channels' sum is one direction
}

double MomentSums::Explained(int axis, const Eigen::RowVectorXd& effects) const {
  const double moment = moments_.row(axis).dot(effects);
  const double square = effects.dot(effects * squares_);
  return square > 0.0 ? std::copysign(moment * moment / square, moment) : 0.0;
}

double MomentSums::Cosine(int axis, const Eigen::RowVectorXd& effects) const {
  const double explained = Explained(axis, effects);
  if (!(free_[axis] > 0.0)) return 0.0;
  return std::copysign(std::sqrt(std::min(1.0, std::abs(explained) / free_[axis])), explained);
}

int RotorLayout::Sign(std::size_t i, int axis, double sign) const {
  const double value = rotors[i].value[axis];
  if (!(std::abs(value) > kLikely * rotors[i].sigma[axis])) return 0;
  return sign * value > 0.0 ? 1 : -1;
}

std::optional<RotorLayout> FindLayout(const FlightLog& log,
                                      const std::vector<ChannelsSample>& channels,
                                      const UsualLag& usual, double reach) {
  if (channels.size() < 100 || log.imu.size() < 200) return std::nullopt;
  const std::size_t count = channels.front().values.size();
  if (count == 0 || count > kMostRotors) return std::nullopt;
  const LayoutFit fit(log, channels);
  const LagTrial any = BestLag(fit, {-reach, reach}), own = BestLag(fit, usual);
  if (any.explained.sum() <= 0.0) return std::nullopt;
  const bool keep = own.explained.sum() > 0.0 && !IsClearlyBetter(fit, any.lag, own.lag);
  RotorLayout layout;
  layout.lag = keep ? own.lag : any.lag;
  layout.explained = keep ? own.explained : any.explained;
  const auto blocks = fit.Blocks(layout.lag);
  const LayoutNormal total = Total(blocks);
  const Eigen::Matrix<double, kTerms, 3> all = total.Solve();
  layout.rotors.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    layout.rotors[i].value = all.row(static_cast<Eigen::Index>(i)).transpose() / fit.scale();
    layout.rotors[i].sigma.setZero();
  }
  for (const LayoutNormal& block : blocks) {
    LayoutNormal rest = total;
    rest -= block;
    if (rest.n < 50.0) continue;
    layout.without.push_back(MomentsOf(rest, static_cast<Eigen::Index>(count)));
    const Eigen::Matrix<double, kTerms, 3> without = rest.Solve();
    for (std::size_t i = 0; i < count; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const Eigen::Vector3d d = (without.row(row) - all.row(row)).transpose() / fit.scale();
      layout.rotors[i].sigma += 0.9 * d.cwiseAbs2();
    }
  }
  layout.all = MomentsOf(total, static_cast<Eigen::Index>(count));
  for (RotorEffect& rotor : layout.rotors) {
    rotor.sigma = rotor.sigma.cwiseSqrt();
    if (!layout.all->spans_all()) rotor.sigma.setConstant(std::numeric_limits<double>::infinity());
  }
  return layout;
}

}  // namespace trueline
