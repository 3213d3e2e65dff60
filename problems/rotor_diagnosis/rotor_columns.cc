#include "problems/rotor_diagnosis/rotor_columns.h"

#include <cmath>
#include <functional>

namespace trueline {

RotorWorld MakeRotorWorld(const FlightLog& log, const RotorCalibrationOptions& options,
                          const std::vector<Effect>& effects) {
  std::vector<Effect> all = options.effects;
  all.insert(all.end(), effects.begin(), effects.end());
  const RotorExtension found = RotorExtensionOf(effects);
  RotorDataOptions streams = options.data;
  streams.motor_lag += found.motor_lag;
  const RotorDrivenModel& vehicle = options.vehicle.model;
  RotorWorld world{RotorAeroModel(vehicle.rotors(), log.gravity, RotorExtensionOf(all).effects),
                   MakeRotorData(log, vehicle.num_rotors(), streams), options.prior};
  world.prior.mean += found.added;
  return world;
}

RotorVariant VariantOf(const FlightLog& log, const RotorCalibrationOptions& options,
                       const RotorWorld& world, const std::vector<Effect>& others,
                       const Candidate& candidate, const Eigen::VectorXd& value, int parameter,
                       double move) {
  std::vector<Effect> effects = others;
  effects.push_back(candidate.At(value + move * Eigen::VectorXd::Unit(value.size(), parameter)));
  const RotorConstants before = world.prior.mean;
  if (candidate.info->id == "motor_lag") {
    RotorWorld moved = MakeRotorWorld(log, options, effects);
    return {moved.model, moved.prior.mean - before,
            std::make_shared<RotorData>(std::move(moved.data))};
  }
  std::vector<Effect> all = options.effects;
  all.insert(all.end(), effects.begin(), effects.end());
  const RotorConstants added =
      options.prior.mean + RotorExtensionOf(effects).added - world.prior.mean;
  return {
      RotorAeroModel(options.vehicle.model.rotors(), log.gravity, RotorExtensionOf(all).effects),
      added, nullptr};
}

namespace {

using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// What a term may depend on.
struct Situation {
  Vector3d v_B, w_B;  // m/s, rad/s
  double thrust;      // m/s^2, above hover
  Eigen::Matrix3d R_E_B;
  Vector3d p_E;    // m, from the middle of the flight
  double s;        // time from -1 to 1 over the flight
  double heading;  // rad
};

using Term = std::function<Vector3d(const Situation&)>;

// Specific force and angular acceleration of the vehicle, or what sensors read beyond its motion.
enum class TermOn { kForce, kTurn, kAccelerometer, kGyro };

struct NamedTerms {
  std::string name;
  TermOn on;
  std::vector<Term> terms;
};

// One term for each of the given body axes, `size` along it.
std::vector<Term> Along(const std::vector<int>& axes,
                        const std::function<double(const Situation&)>& size) {
  std::vector<Term> terms;
  for (const int axis : axes) {
    terms.emplace_back(
        [axis, size](const Situation& a) -> Vector3d { return size(a) * Vector3d::Unit(axis); });
  }
  return terms;
}

const std::vector<NamedTerms>& Library() {
  using S = const Situation&;
  using enum TermOn;
  const auto thrust = [](S a) { return a.thrust; };
  static const std::vector<NamedTerms> library = {
      {"square of speed", kForce, {[](S a) -> Vector3d { return a.v_B.norm() * a.v_B; }}},
      {"sideways speed, across axes",
       kForce,
       {[](S a) { return Vector3d(a.v_B.y(), 0, 0); },
        [](S a) { return Vector3d(0, a.v_B.x(), 0); }}},
      {"turn rates, as a force", kForce, Along({0, 1, 2}, [](S a) { return a.w_B.norm(); })},
      {"thrust, as a force", kForce, Along({0, 1, 2}, thrust)},
      {"square of thrust", kForce, Along({2}, [](S a) { return a.thrust * a.thrust; })},
      {"time, as a force in body axes", kForce, Along({0, 1, 2}, [](S a) { return a.s; })},
      {"place, north to south",
       kForce,
       {[](S a) -> Vector3d { return a.p_E.x() * a.R_E_B.row(0).transpose(); },
        [](S a) -> Vector3d { return a.p_E.x() * a.R_E_B.row(1).transpose(); }}},
      {"place, east to west",
       kForce,
       {[](S a) -> Vector3d { return a.p_E.y() * a.R_E_B.row(0).transpose(); },
        [](S a) -> Vector3d { return a.p_E.y() * a.R_E_B.row(1).transpose(); }}},
      {"a force from one side",
       kForce,
       {[](S a) -> Vector3d { return a.R_E_B.row(0).transpose(); },
        [](S a) -> Vector3d { return a.R_E_B.row(1).transpose(); }}},
      {"turn rates, as a moment",
       kTurn,
       {[](S a) { return Vector3d(a.w_B.x(), 0, 0); },
        [](S a) { return Vector3d(0, a.w_B.y(), 0); },
        [](S a) { return Vector3d(0, 0, a.w_B.z()); }}},
      {"speed, as a moment",
       kTurn,
       {[](S a) { return Vector3d(a.v_B.y(), 0, 0); },
        [](S a) { return Vector3d(0, a.v_B.x(), 0); }}},
      {"time, as a moment", kTurn, Along({0, 1, 2}, [](S a) { return a.s; })},
      {"thrust, as the accelerometer reads it", kAccelerometer, Along({0, 1, 2}, thrust)},
      {"turn rates, as the gyro reads them",
       kGyro,
       {[](S a) { return Vector3d(a.w_B.x(), 0, 0); },
        [](S a) { return Vector3d(0, a.w_B.y(), 0); },
        [](S a) { return Vector3d(0, 0, a.w_B.z()); }}},
      {"a constant moment", kTurn, Along({2}, [](S) { return 1.0; })},
  };
  return library;
}

}  // namespace

RotorLibrary MakeRotorLibrary(const RotorWorld& world, const RotorConstants& constants) {
  RotorLibrary library;
  for (const NamedTerms& named : Library()) {
    const int count = static_cast<int>(named.terms.size());
    const bool of_sensor = named.on == TermOn::kAccelerometer || named.on == TermOn::kGyro;
    library.terms.push_back({named.name, library.columns, count, of_sensor});
    library.columns += count;
  }
  const RotorData& data = world.data;
  Vector3d middle = Vector3d::Zero();
  for (const RotorPose& pose : data.poses) middle += pose.p_E;
  middle /= static_cast<double>(data.poses.size());
  const double length = data.poses.back().t;
  library.push = [&world, constants, middle, length](double t, const RotorState& x,
                                                     Eigen::MatrixXd* push) {
    Situation at;
    const Eigen::Quaterniond q(x[0], x[1], x[2], x[3]);
    at.R_E_B = q.normalized().toRotationMatrix();
    at.v_B = at.R_E_B.transpose() * x.segment<3>(RotorDrivenModel::kVelocity);
    at.w_B = x.segment<3>(RotorDrivenModel::kRate);
    at.p_E = x.segment<3>(RotorDrivenModel::kPosition) - middle;
    at.thrust = -world.model.PushOn(x.data(), world.data.InputAt(t)).force.z() -
                world.model.base().gravity();
    at.s = 2.0 * t / length - 1.0;
    int column = 0;
    for (const NamedTerms& named : Library()) {
      for (const Term& term : named.terms) {
        push->col(column).setZero();
        push->col(column).segment<3>(3 * static_cast<int>(named.on)) = term(at);
        ++column;
      }
    }
  };
  return library;
}

RotorColumns ColumnsOf(const RotorWorld& world, std::vector<RotorVariant> variants,
                       const RotorLibrary* library) {
  RotorColumns columns = VariantColumns(world.model, world.data, std::move(variants));
  if (library == nullptr) return columns;
  const auto push = [variants = columns.push, library](double t, const RotorState& x,
                                                       Eigen::MatrixXd* out) {
    variants(t, x, out);
    Eigen::MatrixXd described = Eigen::MatrixXd::Zero(12, library->columns);
    library->push(t, x, &described);
    out->rightCols(library->columns) = described;
  };
  return {columns.count + library->columns, push};
}

}  // namespace trueline
