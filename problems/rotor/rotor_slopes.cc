#include "problems/rotor/rotor_slopes.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <span>

#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

using Model = RotorAeroModel;
using Base = RotorDrivenModel;
using Jet = ceres::Jet<double, 4>;
using Jets = std::array<Jet, Model::kStates>;

constexpr int ColumnOf(int state) { return state - 1; }  // of the error state; no attitude

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

std::vector<int> AllRotorConstants() {
  std::vector<int> all(Model::kConstants);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

SlopeColumns::SlopeColumns(const std::vector<int>& constants) {
  std::size_t size = 0;
  const auto add = [&](int first, int more) {
    for (int i = 0; i < more; ++i) columns_[size++] = first + i;
    return size;
  };
  const auto add_group = [&](RotorConstantGroup group) {
    for (const int i : constants) {
      if (kRotorConstants[i].group == group) add(ColumnOf(Model::kMoving + i), 1);
    }
    return size;
  };
  motors_ = add_group(RotorConstantGroup::kCommands);
  add(0, 3);                              // attitude
  add(ColumnOf(Base::kPosition + 2), 7);  // height, velocity, rates
  step_ = add_group(RotorConstantGroup::kMotion);
  reading_ = add_group(RotorConstantGroup::kImuArm);
}

const SlopeColumns& SlopeColumns::All() {
  static const SlopeColumns all(AllRotorConstants());
  return all;
}

const SlopeColumns& SlopeColumns::Moving() {
  static const SlopeColumns moving({});
  return moving;
}

std::span<const int> SlopeColumns::OfStep(const RotorInput& input) const {
  const std::size_t first = input.slopes.empty() ? motors_ : 0;
  return std::span(columns_).subspan(first, step_ - first);
}

std::span<const int> SlopeColumns::OfReading(const RotorInput& input) const {
  const std::size_t first = input.slopes.empty() ? motors_ : 0;
  return std::span(columns_).subspan(first, reading_ - first);
}

RotorReading ReadWithSlope(const RotorAeroModel& model, const RotorState& x,
                           const RotorInput& input, const SlopeColumns& slopes) {
  RotorReading reading;
  reading.slope.setZero();
  reading.slope.middleCols<6>(ColumnOf(Base::kAccelBias)).setIdentity();
  ByColumns(x, slopes.OfReading(input), [&](const Jets& at, std::span<const int> columns) {
    std::array<Jet, 6> y;
    model.Imu(at.data(), input, y.data());
    for (int i = 0; i < 6; ++i) {
      reading.y[i] = y[i].a;
      for (std::size_t j = 0; j < columns.size(); ++j) reading.slope(i, columns[j]) = y[i].v[j];
    }
  });
  return reading;
}

RotorStepMatrix StepWithSlope(const RotorAeroModel& model, const RotorInput& input,
                              const Eigen::Matrix<double, 6, 1>& disturbance, double dt,
                              RotorState* x, const SlopeColumns& slopes) {
  RotorStepMatrix slope = RotorStepMatrix::Zero();
  slope.leftCols<Model::kMovingErrors>().setIdentity();
  std::array<Jet, 6> held;
  for (int i = 0; i < 6; ++i) held[i] = Jet(disturbance[i]);
  RotorState end;
  ByColumns(*x, slopes.OfStep(input), [&](Jets& at, std::span<const int> columns) {
    RotorMidpointStep(model, input, held.data(), dt, at.data());
    const auto moved = MovingSensitivity(at.data());
    for (std::size_t j = 0; j < columns.size(); ++j) slope.col(columns[j]) = moved.col(j);
    for (int i = 0; i < Model::kStates; ++i) end[i] = at[i].a;
  });
  *x = end;
  return slope;
}

}  // namespace trueline
