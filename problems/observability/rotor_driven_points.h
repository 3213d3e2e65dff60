// Random points of the rotor-driven model at which ranks are evaluated, unrestricted or within a
// kind of motion (hover, straight up and down, straight ahead and back). In GF(p) they are exact: a
// unit quaternion is r * r / |r|^2 for a random r, and trims solve linear equations.
#pragma once

#include <string>
#include <vector>

#include "problems/common/error.h"
#include "problems/common/random.h"
#include "problems/observability/lie_derivatives.h"
#include "problems/observability/rotor_driven_system.h"

namespace trueline {

enum class Motion {
  kVarying,   // any state, inputs that vary
  kConstant,  // any state, constant inputs
  kHover,     // trim: no rotation, no acceleration, any constant velocity
  kVertical,  // straight up and down
  kStraight   // in the vertical plane of the body's x axis, pitching
};

// `mean` + `spread` * random, or any number of GF(p).
template <class C>
C RandomScalar(Random* random, double mean, double spread) {
  if constexpr (std::is_same_v<C, Modular>) {
    return Modular::FromResidue(random->engine()());
  } else {
    return C(mean + spread * random->Normal());
  }
}

// Draws points for one vehicle. Parameters of double points come from `nominal` (kStates numbers);
// in GF(p) they are random. Rotors are always the vehicle's.
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

}  // namespace trueline
