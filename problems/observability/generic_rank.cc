#include "problems/observability/generic_rank.h"

#include <cmath>

#include "cost_functions/models/rigid_body.h"
#include "problems/observability/rotor_driven_points.h"

namespace trueline {
namespace {

constexpr double kTimeScale = 0.5;  // s, of variation in the floating-point test points

template <class C, int kMaxOrder>
class Point : public SystemPoint<C, kMaxOrder> {
 public:
  using Series = Taylor<C, kMaxOrder>;

  Point(Turning turning, int order, std::uint64_t seed)
      : random_(seed, "imu_driven"), order_(turning == Turning::kNone ? 0 : order) {
    for (int i = 0; i < 3; ++i) x.push_back(RandomScalar<C>(&random_, 0.0, 1.0));
    for (int i = 0; i < 3; ++i) x.push_back(RandomScalar<C>(&random_, 2.0, 1.0));
    for (int i = 0; i < kMotionSize; ++i) {
      const double mean = kTheta[i].group == ParameterGroup::kDrag ? -0.5 : 0.0;
      x.push_back(RandomScalar<C>(&random_, mean, 0.02));
    }
    const Series level(0.0), one(1.0);
    const Series roll = turning == Turning::kPitch ? level : Vary(0.0, 0.2);
    const Series pitch = Vary(0.0, 0.2);
    const Series yaw = turning == Turning::kAny ? Vary(0.0, 0.3) : level;
    PutAttitude(Vec4<Series>(one, level, level, yaw), Vec4<Series>(one, roll, pitch, level));
    u.push_back(Vary(-9.81, 1.0));
  }

 private:
  using SystemPoint<C, kMaxOrder>::x;
  using SystemPoint<C, kMaxOrder>::u;

  Series Vary(double mean, double spread) {
    Series series = Series::Constant(RandomScalar<C>(&random_, mean, spread));
    if (order_ == 0) return series;
    series = Series::Start(series[0]);
    for (int i = 1; i <= order_; ++i) {
      series.Append(RandomScalar<C>(&random_, 0.0, spread * std::pow(kTimeScale, -i)));
    }
    return series;
  }
  // R(yaw * tilt) over the squared norm of the product: the factors need not have norm 1.
  void PutAttitude(const Vec4<Series>& yaw, const Vec4<Series>& tilt) {
    const Vec4<Series> q = HamiltonProduct(yaw, tilt);
    const Series square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const Series two(2.0), one(1.0);
    const auto entry = [&](int i, int j) {
      if (i == j) {
        const int a = (i + 1) % 3 + 1, b = (i + 2) % 3 + 1;
        return one - two * (q[a] * q[a] + q[b] * q[b]) / square;
      }
      const int k = 3 - i - j;
      const Series turn = q[0] * q[k + 1];
      const Series sign((j - i + 3) % 3 == 1 ? -1.0 : 1.0);
      return two * (q[i + 1] * q[j + 1] + sign * turn) / square;
    };
    for (int i = 0; i < 9; ++i) u.push_back(entry(i / 3, i % 3));
  }

  Random random_;
  int order_;
};

}  // namespace

RankReport ImuDrivenRank(const ImuDrivenSystem& system, const std::vector<int>& states,
                         Turning turning, std::uint64_t seed) {
  constexpr int kOrder = 10;
  const auto exact = [&](int order, int k) -> SystemPoint<Modular, ImuDrivenSystem::kErrors> {
    return Point<Modular, ImuDrivenSystem::kErrors>(turning, order, 2 * seed + k);
  };
  const SystemPoint<double, kOrder> near = Point<double, kOrder>(turning, kOrder, seed);
  return GenericRank(system, states, exact, near, kTimeScale);
}

RankReport RotorDrivenRank(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                           const std::vector<int>& states, Motion motion, std::uint64_t seed) {
  constexpr int kOrder = 12;
  using ExactPoints = RotorDrivenPoints<Modular, RotorDrivenSystem::kErrors>;
  using NearPoints = RotorDrivenPoints<double, kOrder>;
  const std::vector<double> none(RotorDrivenSystem::kStates, 0.0);
  const auto exact = [&](int order, int k) {
    return ExactPoints(system.model(), none, 2 * seed + k).Draw(motion, order);
  };
  return GenericRank(system, states, exact,
                     NearPoints(system.model(), nominal, seed).Draw(motion, kOrder),
                     NearPoints::kTimeScale);
}

}  // namespace trueline
