// A trajectory in flat outputs, flown by a rotor-driven vehicle: its states, inputs and their
// series.
#pragma once

#include <utility>
#include <vector>

#include "problems/rotor/rotor_vehicle.h"
#include "problems/trajectory/flatness.h"
#include "problems/trajectory/nominal.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

// State and input series at the start of one stretch of time.
template <class C, int kOrder>
struct SegmentStart {
  std::vector<C> x;
  std::vector<Taylor<C, kOrder>> u;
};

// `flat`: series known to order kOrder + 4; `parameters`: the model's kStates numbers.
template <class C, int kOrder>
SegmentStart<C, kOrder> StartFromFlat(const FlatVehicle& vehicle,
                                      const std::vector<double>& parameters,
                                      const Vec4<Taylor<C, kOrder + 4>>& flat) {
  const auto state = StateFromFlat(vehicle, flat);
  SegmentStart<C, kOrder> start;
  start.x.reserve(RotorDrivenModel::kStates);
  for (const double value : parameters) start.x.push_back(C(value));
  for (int i = 0; i < 4; ++i) start.x[RotorDrivenModel::kAttitude + i] = state.q[i][0];
  for (int i = 0; i < 3; ++i) {
    start.x[RotorDrivenModel::kPosition + i] = state.p[i][0];
    start.x[RotorDrivenModel::kVelocity + i] = state.v[i][0];
    start.x[RotorDrivenModel::kRate + i] = state.w[i][0];
  }
  for (const auto& series : state.u) {
    auto u = Taylor<C, kOrder>::Start(series[0]);
    for (int j = 1; j <= kOrder; ++j) u.Append(series[j]);
    start.u.push_back(u);
  }
  return start;
}

class RotorFlight {
 public:
  RotorFlight(const RotorVehicle& vehicle, PiecewisePolynomial path)
      : vehicle_(MakeFlatVehicle(vehicle.model, vehicle.parameters)),
        parameters_(vehicle.parameters),
        path_(std::move(path)) {}

  const FlatVehicle& vehicle() const { return vehicle_; }
  const std::vector<double>& parameters() const { return parameters_; }
  const PiecewisePolynomial& path() const { return path_; }

  NominalPoint At(double t) const {
    const auto flat = FlatSeries<Taylor<double, 4>>(path_.Expand(t, 4));
    const auto start = StartFromFlat<double, 0>(vehicle_, parameters_, flat);
    NominalPoint point{start.x, {}};
    for (const auto& u : start.u) point.u.push_back(u[0]);
    return point;
  }

  NominalFlight Nominal() const {
    return {path_.start(), path_.end(), [this](double t) { return At(t); }};
  }

 private:
  FlatVehicle vehicle_;
  std::vector<double> parameters_;
  PiecewisePolynomial path_;
};

}  // namespace trueline
