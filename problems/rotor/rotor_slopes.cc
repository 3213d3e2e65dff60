#include "problems/rotor/rotor_slopes.h"

#include <algorithm>
#include <array>
#include <span>

#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

using Model = RotorAeroModel;
using Base = RotorDrivenModel;
using Jet = ceres::Jet<double, 4>;
using Jets = std::array<Jet, Model::kStates>;

constexpr int ColumnOf(int state) { return state - 1; }  // of the error state; no attitude

// Columns of the error state that the model must be evaluated for: those that motion depends on,
// then those that only readings depend on, then the motors' unknowns, which matter where speeds
// come from commands. All other derivatives are known.
struct ActiveColumns {
  std::array<int, Model::kErrors> columns{};
  int motion = 0, readings = 0, all = 0;  // how many

  std::span<const int> First(const RotorInput& input, int without_motors) const {
    return std::span(columns).first(input.slopes.empty() ? without_motors : all);
  }
};

constexpr ActiveColumns kActive = [] {
  ActiveColumns active;
  const auto add = [&](int first, int more) {
    for (int i = 0; i < more; ++i) active.columns[active.all++] = first + i;
  };
  const auto add_group = [&](RotorConstantGroup group) {
    for (int i = 0; i < Model::kConstants; ++i) {
      if (kRotorConstants[i].group == group) add(ColumnOf(Model::kMoving + i), 1);
    }
  };
  add(0, 3);                              // attitude
  add(ColumnOf(Base::kPosition + 2), 7);  // height, velocity, rates
  add_group(RotorConstantGroup::kMotion);
  active.motion = active.all;
  add_group(RotorConstantGroup::kImuArm);
  active.readings = active.all;
  add_group(RotorConstantGroup::kCommands);
  return active;
}();

// Calls `of(jets, columns)` for a few of `columns` at a time; the jets are `x` seeded in these
// columns.
template <class Function>
void ByColumns(const RotorState& x, std::span<const int> columns, const Function& of) {
  while (!columns.empty()) {
    const auto some = columns.first(std::min<std::size_t>(Jet::DIMENSION, columns.size()));
    Jets jets;
    for (int i = 0; i < Model::kStates; ++i) jets[i] = Jet(x[i]);
    for (std::size_t j = 0; j < some.size(); ++j) {
      SeedError(x, some[j], static_cast<int>(j), jets.data());
    }
    of(jets, some);
    columns = columns.subspan(some.size());
  }
}

}  // namespace

RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input) {
  RotorReading reading;
  reading.slope.setZero();
  reading.slope.middleCols<6>(ColumnOf(Base::kAccelBias)).setIdentity();
  ByColumns(x, kActive.First(input, kActive.readings),
            [&](const Jets& at, std::span<const int> columns) {
              std::array<Jet, 6> y;
              model.Imu(at.data(), input, y.data());
              for (int i = 0; i < 6; ++i) {
                reading.y[i] = y[i].a;
                for (std::size_t j = 0; j < columns.size(); ++j)
                  reading.slope(i, columns[j]) = y[i].v[j];
              }
            });
  return reading;
}

RotorStepMatrix StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                              const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                              RotorState* x) {
  RotorStepMatrix slope = RotorStepMatrix::Zero();
  slope.leftCols<Model::kMovingErrors>().setIdentity();
  std::array<Jet, 6> held;
  for (int i = 0; i < 6; ++i) held[i] = Jet(disturbance[i]);
  RotorState end;
  ByColumns(*x, kActive.First(input, kActive.motion), [&](Jets& at, std::span<const int> columns) {
    RotorMidpointStep(model, input, held.data(), dt, at.data());
    const auto moved = MovingSensitivity(at.data());
    for (std::size_t j = 0; j < columns.size(); ++j) slope.col(columns[j]) = moved.col(j);
    for (int i = 0; i < Model::kStates; ++i) end[i] = at[i].a;
  });
  *x = end;
  return slope;
}

}  // namespace trueline
