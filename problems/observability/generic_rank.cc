#include <cmath>

#include "cost_functions/models/rigid_body.h"
#include "problems/common/error.h"
#include "problems/common/random.h"
#include "problems/observability/lie_derivatives.h"
#include "problems/observability/observe.h"

namespace trueline {
namespace {

// Rank and null space for `states`. The rank is the larger one at two points of GF(p), exact(order,
// k) for k = 0 and 1; null vectors are in physical units at `near`, whose inputs vary within
// `time_scale` seconds. n derivatives suffice for n unknowns (Sedoglavic 2002).
template <class System, class ExactPoint, int kOrder>
RankReport GenericRank(const System& system, const std::vector<int>& states,
                       const ExactPoint& exact, const SystemPoint<double, kOrder>& near,
                       double time_scale) {
  const auto rank = [&](int k) {
    const int order = static_cast<int>(states.size());
    const auto point = exact(order, k);
    return ExactRank(ObservabilityMatrix<System::kErrors, Modular>(system, point.x, point.u, order),
                     states);
  };
  RankReport report = rank(0);
  const RankReport again = rank(1);
  if (again.rank > report.rank) report = again;
  Eigen::MatrixXd matrix = ObservabilityMatrix<kOrder, double>(system, near.x, near.u, kOrder);
  const Eigen::Index outputs = system.num_outputs();
  for (int i = 0; i <= kOrder; ++i) {
    matrix.middleRows(i * outputs, outputs) *= std::pow(time_scale, i);
  }
  FillDirections(matrix, system.errors(), &report);
  return report;
}

// `mean` + `spread` * random, or any number of GF(p).
template <class C>
C RandomScalar(Random* random, double mean, double spread) {
  if constexpr (std::is_same_v<C, Modular>) {
    return Modular::FromResidue(random->engine()());
  } else {
    return C(mean + spread * random->Normal());
  }
}

// Random points of the rotor-driven model at which ranks are evaluated, unrestricted or within a
// kind of motion. In GF(p) they are exact: a unit quaternion is r * r / |r|^2 for a random r, and
// trims solve linear equations. Draws points for one vehicle. Parameters of double points come from
// `nominal` (kStates numbers); in GF(p) they are random. Rotors are always the vehicle's.
template <class C, int kMaxOrder>
class RotorDrivenPoints {
 public:
  using Model = RotorDrivenModel;
  using Series = Taylor<C, kMaxOrder>;
  // Time in which inputs of the double points change by their spread, s.
  static constexpr double kTimeScale = 0.2;

  RotorDrivenPoints(const Model& model, std::vector<double> nominal, std::uint64_t seed)
      : model_(model), nominal_(std::move(nominal)), random_(seed, "observability") {}

  SystemPoint<C, kMaxOrder> Draw(Motion motion, int order) {
    SystemPoint<C, kMaxOrder> point;
    point.x = DrawState(motion);
    point.u = DrawInputs(motion, point.x, order);
    return point;
  }

 private:
  std::vector<C> DrawState(Motion motion) {
    std::vector<C> x(Model::kStates, C(0.0));
    const bool level = motion == Motion::kHover || motion == Motion::kVertical;
    const bool planar = motion == Motion::kStraight;
    const C zero(0.0);
    const Vec4<C> r(RandomScalar<C>(&random_, 1.0, 0.0), level || planar ? zero : Small(),
                    level ? zero : Small(), planar ? zero : Small());
    const Vec4<C> square = HamiltonProduct(r, r);
    const C norm = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3];
    for (int i = 0; i < 4; ++i) x[i] = square[i] / norm;
    for (int i = 0; i < 3; ++i) {
      const bool out_of_line = motion == Motion::kVertical ? i < 2 : planar && i == 1;
      const bool no_turn = level || (planar && i != 1);
      x[Model::kPosition + i] = RandomScalar<C>(&random_, 0.0, 1.0);
      x[Model::kVelocity + i] = out_of_line ? zero : RandomScalar<C>(&random_, 0.0, 1.0);
      x[Model::kRate + i] = no_turn ? zero : RandomScalar<C>(&random_, 0.0, 2.0);
    }
    for (int i = Model::kMoving; i < Model::kStates; ++i) {
      x[i] = RandomScalar<C>(&random_, nominal_[i], 0.0);
    }
    return x;
  }

  std::vector<Series> DrawInputs(Motion motion, const std::vector<C>& x, int order) {
    const int rotors = model_.num_rotors();
    const bool constant = motion == Motion::kHover || motion == Motion::kConstant;
    const DynamicMatrix<C> allowed = Allowed(motion, x);
    std::vector<Series> u(rotors);
    double spread = 0.2;
    for (int k = 0; k <= (constant ? 0 : order); ++k, spread /= kTimeScale) {
      DynamicVector<C> part(rotors);
      part.setConstant(C(0.0));
      const double mean = k == 0 && motion != Motion::kHover ? 1.0 : 0.0;
      for (Eigen::Index j = 0; j < allowed.cols(); ++j) {
        const C factor = RandomScalar<C>(&random_, mean, spread);
        for (int i = 0; i < rotors; ++i) part[i] += factor * allowed(i, j);
      }
      if (motion == Motion::kHover) part += HoverInputs(x);
      for (int i = 0; i < rotors; ++i) {
        if (k == 0) u[i] = constant ? Series::Constant(part[i]) : Series::Start(part[i]);
        if (k > 0) u[i].Append(part[i]);
      }
    }
    return u;
  }

  // Rows Fx Fy Fz Mx My Mz, a column for each rotor at the reference speed.
  DynamicMatrix<C> Allocation(const std::vector<C>& x) const {
    const int rotors = model_.num_rotors();
    DynamicMatrix<C> allocation(6, rotors);
    for (int j = 0; j < rotors; ++j) {
      std::vector<C> u(rotors, C(0.0));
      u[j] = C(kReference);
      const auto wrench = model_.ForceAndMoment(x.data(), u.data());
      for (int i = 0; i < 3; ++i) {
        allocation(i, j) = wrench.force[i];
        allocation(3 + i, j) = wrench.moment[i];
      }
    }
    return allocation;
  }

  // Basis of the inputs under which the motion stays within its kind (for hover: no change).
  DynamicMatrix<C> Allowed(Motion motion, const std::vector<C>& x) const {
    std::vector<int> rows;
    if (motion == Motion::kHover) rows = {0, 1, 2, 3, 4, 5};
    if (motion == Motion::kVertical) rows = {0, 1, 3, 4, 5};
    if (motion == Motion::kStraight) rows = {1, 3, 5};
    const DynamicMatrix<C> all = Allocation(x);
    DynamicMatrix<C> kept(rows.size(), all.cols());
    for (std::size_t i = 0; i < rows.size(); ++i) kept.row(i) = all.row(rows[i]);
    DynamicMatrix<C> basis = NullSpace(RowReduce<C>(kept));
    if (motion != Motion::kHover && basis.cols() == 0) Refuse();
    for (Eigen::Index i = 0; i < basis.size(); ++i) basis(i) *= C(kReference);
    return basis;
  }

  // One solution of F = (0, 0, -m g), M = 0.
  DynamicVector<C> HoverInputs(const std::vector<C>& x) const {
    const int rotors = model_.num_rotors();
    DynamicMatrix<C> augmented(6, rotors + 1);
    augmented.setConstant(C(0.0));
    augmented.leftCols(rotors) = Allocation(x);
    augmented(2, rotors) = -x[Model::kMass] * C(model_.gravity());
    const RowEchelon<C> echelon = RowReduce<C>(augmented);
    DynamicVector<C> u(rotors);
    u.setConstant(C(0.0));
    for (std::size_t row = 0; row < echelon.pivots.size(); ++row) {
      if (echelon.pivots[row] == rotors) Refuse();
      u[echelon.pivots[row]] = echelon.rows(row, rotors) * C(kReference);
    }
    return u;
  }

  [[noreturn]] static void Refuse() {
    throw InputError(
        "this vehicle has no inputs for the motion asked for (are its rotors tilted so that it "
        "can't hover level?); ask for motion: varying or constant");
  }
  C Small() { return RandomScalar<C>(&random_, 0.0, 0.2); }

  static constexpr double kReference = 1e6;  // rad^2/s^2
  Model model_;
  std::vector<double> nominal_;
  Random random_;
};

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
