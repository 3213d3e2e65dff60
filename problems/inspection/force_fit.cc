#include "problems/inspection/force_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/inspection/clear.h"
#include "problems/inspection/vector_match.h"

namespace trueline {
namespace {

constexpr double kAlikeBends = 10.0;  // neighbours whose errors are one error

using Vector9 = Eigen::Matrix<double, 9, 1>;

// Of y = X l, l the rows of L one after another.
using Normal = NormalSums<9>;

double BestScale(const Normal& normal, const Vector9& l) {
  return normal.b.dot(l) / std::max(1e-12, l.dot(normal.a * l));
}

struct Row {
  std::size_t block;
  Vector9 x;  // of L
  Eigen::Vector3d of_bias;
  double y;        // m/s^2, the acceleration less gravity
  double gravity;  // m/s^2, along the row's axis
};

Vector9 RowsOf(const Eigen::Matrix3d& m) {
  Vector9 l;
  for (Eigen::Index k = 0; k < 3; ++k) l.segment<3>(3 * k) = m.row(k).transpose();
  return l;
}

// None where they are too few.
std::vector<Row> RowsOfBends(const BodyForce& force, const std::vector<Bend>& bends) {
  std::vector<Row> rows;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < bends.size(); ++i) {
      const Bend& bend = bends[i];
      if (!force.Knows(bend)) continue;
      const double gravity = axis == 2 ? force.gravity() : 0.0;
      rows.push_back({i * kBlocks / bends.size(), force.Force(axis, bend), force.Axes(axis, bend),
                      bend.acceleration[axis] - gravity, gravity});
    }
  }
  if (rows.size() < 300) rows.clear();
  return rows;
}

BlocksOf<Normal> NormalOf(const std::vector<Row>& rows) {
  BlocksOf<Normal> blocks;
  for (const Row& row : rows) blocks[row.block].Add(row.x, row.y);
  return blocks;
}

// Least squares of N numbers beside a bias of the body, which is zero but for its usual size.
template <int N>
class BiasedFit {
 public:
  struct Solution {
    Eigen::Vector<double, N> value, sigma;
  };

  void Add(std::size_t block, const Eigen::Vector<double, N>& x, const Eigen::Vector3d& of_bias,
           double y) {
    Eigen::Vector<double, N + 3> row;
    row << x, of_bias;
    blocks_[block].Add(row, y);
  }

  Solution Solve() const {
    const Sums all = Total(blocks_);
    double square = kForceNoise * kForceNoise;  // of a row's noise
    Eigen::Vector<double, N + 3> best;
    for (int pass = 0; pass < 3; ++pass) {
      best = Best(all, square);
      square = std::max(all.Cost(best) / all.n, kForceNoise * kForceNoise);
    }
    const Matrix open = kAlikeBends * square * Weighed(all, square).inverse();
    Solution solution{best.template head<N>(), {}};
    for (int k = 0; k < N; ++k) {
      const auto of = [&](const Sums& sums) { return Best(sums, square)[k]; };
      solution.sigma[k] = std::hypot(JackknifeSigma(blocks_, of), std::sqrt(open(k, k)));
    }
    return solution;
  }

 private:
  using Matrix = Eigen::Matrix<double, N + 3, N + 3>;
  using Sums = NormalSums<N + 3>;

  static Matrix Weighed(const Sums& sums, double square) {
    Matrix a = sums.a;
    a.template bottomRightCorner<3, 3>() +=
        kAlikeBends * square / (kBodyBias * kBodyBias) * Eigen::Matrix3d::Identity();
    return a;
  }
  static Eigen::Vector<double, N + 3> Best(const Sums& sums, double square) {
    return Weighed(sums, square).ldlt().solve(sums.b);
  }

  BlocksOf<Sums> blocks_;
};

// The rotation about `start` that lowers the cost, by Gauss-Newton on angles and scale.
Eigen::Matrix3d Refine(const Normal& normal, Eigen::Matrix3d turn) {
  for (int pass = 0; pass < 8; ++pass) {
    const double scale = BestScale(normal, RowsOf(turn));
    Eigen::Matrix<double, 9, 4> j;
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
      cross((k + 2) % 3, (k + 1) % 3) = 1.0;
      cross((k + 1) % 3, (k + 2) % 3) = -1.0;
      j.col(k) = scale * RowsOf(cross * turn);
    }
    j.col(3) = RowsOf(turn);
    const Vector9 l = scale * RowsOf(turn);
    const Eigen::Vector4d step =
        (j.transpose() * normal.a * j).ldlt().solve(j.transpose() * (normal.b - normal.a * l));
    if (!step.allFinite()) return turn;
    const Eigen::Vector3d angle = step.head<3>();
    if (angle.norm() > 1e-12) {
      turn = Eigen::AngleAxisd(std::min(0.5, angle.norm()), angle.normalized()) * turn;
    }
  }
  return turn;
}

double ScaledCost(const Normal& normal, const Eigen::Matrix3d& turn) {
  const Vector9 l = RowsOf(turn);
  return normal.Cost(std::max(0.0, BestScale(normal, l)) * l);
}

Eigen::Matrix3d BestTurn(const Normal& normal, const std::vector<Eigen::Matrix3d>& hints) {
  std::vector<Eigen::Matrix3d> tried = SignedPermutations();
  tried.insert(tried.end(), hints.begin(), hints.end());
  const auto less = [&](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    return ScaledCost(normal, a) < ScaledCost(normal, b);
  };
  const Eigen::Matrix3d plain = *std::min_element(tried.begin(), tried.end(), less);
  return Refine(normal, plain);
}

// Least squares of three unknowns: a factor and biases of x and y, or biases of all three axes.
struct ThreeFit {
  Eigen::Vector3d value;  // factor or bias of z first, then biases of x and y [m/s^2]
  double rms;             // m/s^2, of the residual
};
ThreeFit FitThree(const NormalSums<3>& sums) {
  const Eigen::Vector3d value = sums.a.ldlt().solve(sums.b);
  const double rest = std::max(0.0, sums.yy - sums.b.dot(value));
  return {value, std::sqrt(rest / std::max(1.0, sums.n))};
}

BlocksOf<NormalSums<3>> SumThree(const std::vector<Row>& rows, bool factor) {
  BlocksOf<NormalSums<3>> blocks;
  const Vector9 one = RowsOf(Eigen::Matrix3d::Identity());
  for (const Row& row : rows) {
    const double force = row.x.dot(one);
    blocks[row.block].Add({factor ? force : row.of_bias.z(), row.of_bias.x(), row.of_bias.y()},
                          factor ? row.y : row.y - force);
  }
  return blocks;
}

}  // namespace

BodyForce::BodyForce(const FlightLog& log, const std::vector<AttitudeSample>& attitude)
    : gravity_(log.gravity) {
  for (int axis = 0; axis < 3; ++axis) {
    force_[static_cast<std::size_t>(axis)] = AxisForceIntegral(log, attitude, axis);
    axes_[static_cast<std::size_t>(axis)] = AxisIntegral(log, attitude, axis);
  }
}

bool BodyForce::Knows(const Bend& bend) const {
  return force_[0].Knows(bend.t - bend.half, bend.t + bend.half);
}

Eigen::Matrix<double, 9, 1> BodyForce::Force(int earth_axis, const Bend& bend) const {
  return UnderTriangle(force_[static_cast<std::size_t>(earth_axis)], bend, 0.0);
}

Eigen::Vector3d BodyForce::Axes(int earth_axis, const Bend& bend) const {
  return UnderTriangle(axes_[static_cast<std::size_t>(earth_axis)], bend, 0.0);
}

std::optional<ForceFit> FitForce(const BodyForce& force, const std::vector<Bend>& bends,
                                 const std::vector<Eigen::Matrix3d>& hints) {
  const std::vector<Row> rows = RowsOfBends(force, bends);
  if (rows.empty()) return std::nullopt;
  const BlocksOf<Normal> blocks = NormalOf(rows);
  const Normal all = Total(blocks);
  ForceFit fit;
  fit.turn = BestTurn(all, hints);
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  fit.as_read = std::sqrt(ScaledCost(all, one) / all.n);
  fit.residual = std::sqrt(ScaledCost(all, fit.turn) / all.n);
  const auto gain = [&](const Normal& normal) {  // in cost
    return ScaledCost(normal, one) - ScaledCost(normal, fit.turn);
  };
  fit.clearly = gain(all) / std::max(1e-9, JackknifeSigma(blocks, gain));
  return fit;
}

double ForceResidual(const BodyForce& force, const std::vector<Bend>& bends,
                     const Eigen::Matrix3d& turn) {
  const std::vector<Row> rows = RowsOfBends(force, bends);
  if (rows.empty()) return std::numeric_limits<double>::infinity();
  const Normal all = Total(NormalOf(rows));
  return std::sqrt(ScaledCost(all, turn) / all.n);
}

std::optional<LateralForce> FitLateralForce(const BodyForce& force,
                                            const std::vector<Bend>& bends) {
  const std::vector<Row> rows = RowsOfBends(force, bends);
  if (rows.empty()) return std::nullopt;
  BiasedFit<9> biased;
  for (const Row& row : rows) biased.Add(row.block, row.x, row.of_bias, row.y);
  const auto solution = biased.Solve();
  LateralForce fit;
  for (int k = 0; k < 6; ++k) {
    fit.share(k / 3, k % 3) = solution.value[k];
    fit.sigma(k / 3, k % 3) = solution.sigma[k];
  }
  return fit;
}

std::optional<PositionScale> FitPositionScale(const BodyForce& force,
                                              const std::vector<Bend>& bends) {
  const std::vector<Row> rows = RowsOfBends(force, bends);
  if (rows.empty()) return std::nullopt;
  const Vector9 one = RowsOf(Eigen::Matrix3d::Identity());
  double seen = 0.0, sure = 0.0;
  for (const Row& row : rows) {
    seen += std::pow(row.y + row.gravity, 2);
    sure += std::pow(row.x.dot(one) + row.gravity, 2);
  }
  if (!(seen > 0.0) || !(sure > 0.0)) return std::nullopt;
  const double unit = std::sqrt(seen / sure);  // in which a bias has its usual size
  BiasedFit<1> biased;
  for (const Row& row : rows) {
    biased.Add(row.block, Eigen::Vector<double, 1>(row.x.dot(one) + row.gravity), row.of_bias,
               (row.y + row.gravity) / unit);
  }
  const auto solution = biased.Solve();
  return PositionScale{unit * solution.value[0], unit * solution.sigma[0]};
}

std::optional<ForceScale> FitForceScale(const BodyForce& force, const std::vector<Bend>& bends) {
  const std::vector<Row> rows = RowsOfBends(force, bends);
  if (rows.empty()) return std::nullopt;
  const auto factors = SumThree(rows, true);
  const ThreeFit factor = FitThree(Total(factors)), bias = FitThree(Total(SumThree(rows, false)));
  const auto factor_of = [](const NormalSums<3>& sums) { return FitThree(sums).value[0]; };
  return ForceScale{factor.value[0],
                    JackknifeSigma(factors, factor_of),
                    {bias.value[1], bias.value[2], bias.value[0]},
                    factor.rms,
                    bias.rms};
}

}  // namespace trueline
