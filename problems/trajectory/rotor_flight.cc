#include "problems/trajectory/rotor_flight.h"

#include <Eigen/SVD>

#include "problems/common/error.h"

namespace trueline {

FlatVehicle MakeFlatVehicle(const RotorDrivenModel& model, const std::vector<double>& parameters) {
  const int rotors = model.num_rotors();
  for (int i = 0; i < rotors; ++i) {
    if (model.rotors()[i].axis == Eigen::Vector3d(0.0, 0.0, -1.0)) continue;
    throw InputError(fmt::format(
        "rotor {} is tilted: trajectories in position and yaw need rotors along [0, 0, -1]; ask "
        "for its exact observability (inputs: varying) instead",
        i + 1));
  }
  Eigen::Matrix<double, 4, Eigen::Dynamic> allocation(4, rotors);
  constexpr double kReference = 1e6;  // rad^2/s^2
  for (int i = 0; i < rotors; ++i) {
    std::vector<double> u(rotors, 0.0);
    u[i] = kReference;
    const auto wrench = model.ForceAndMoment(parameters.data(), u.data());
    allocation.col(i) << -wrench.force.z(), wrench.moment;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(allocation,
                                              Eigen::ComputeThinU | Eigen::ComputeThinV);
  if (rotors < 4 || svd.singularValues()[3] < 1e-6 * svd.singularValues()[0]) {
    throw InputError(
        "these rotors can't give thrust and all three moments; check their positions, "
        "spins and k_m");
  }
  FlatVehicle vehicle;
  vehicle.mass = parameters[RotorDrivenModel::kMass];
  vehicle.inertia = RotorDrivenModel::Vector(parameters.data(), RotorDrivenModel::kInertia);
  vehicle.gravity = model.gravity();
  vehicle.speeds_from_wrench = svd.solve(Eigen::MatrixXd::Identity(4, 4)) * kReference;
  return vehicle;
}

}  // namespace trueline
