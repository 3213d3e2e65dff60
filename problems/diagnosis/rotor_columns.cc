#include "problems/diagnosis/rotor_columns.h"

#include <cmath>
#include <functional>

namespace trueline {

LaggedRotorData::LaggedRotorData(const FlightLog& log, int rotors, RotorDataOptions options)
    : log_(log), rotors_(rotors), options_(std::move(options)) {}

std::shared_ptr<const RotorData> LaggedRotorData::With(double lag) const {
  std::shared_ptr<const RotorData>& data = made_[lag];
  if (!data) {
    RotorDataOptions options = options_;
    options.motor_lag = lag;
    data = std::make_shared<const RotorData>(MakeRotorData(log_, rotors_, options));
  }
  return data;
}

RotorSetup MakeRotorSetup(const FlightLog& log, const RotorCalibrationOptions& options,
                          const LaggedRotorData& data, const std::vector<Effect>& effects) {
  std::vector<Effect> all = options.effects;
  all.insert(all.end(), effects.begin(), effects.end());
  const RotorExtension found = RotorExtensionOf(effects);
  const double lag = options.data.motor_lag + found.motor_lag;
  RotorSetup setup{
      RotorAeroModel(options.vehicle.model.rotors(), log.gravity, RotorEffectsOn(log, all)),
      data.With(lag), options.prior, lag};
  setup.prior.mean += found.added;
  return setup;
}

RotorVariant VariantOf(const FlightLog& log, const RotorCalibrationOptions& options,
                       const LaggedRotorData& data, const RotorSetup& setup,
                       const std::vector<Effect>& effects) {
  RotorSetup moved = MakeRotorSetup(log, options, data, effects);
  const bool other_data = moved.motor_lag != setup.motor_lag;
  return {moved.model, moved.prior.mean - setup.prior.mean, other_data ? moved.data : nullptr};
}

namespace {

using Eigen::Vector3d;

// Place counts from the middle of the flight.
struct TermInputs : TermMotion {
  Vector3d Down() const { return R_E_B.row(2).transpose(); }  // in body axes
};

using Term = std::function<Vector3d(const TermInputs&)>;

// What a term of the library changes: the vehicle's specific force or angular acceleration, or a
// sensor's reading directly. In the order of the rows of SegmentModel::AccelerationsByColumn and
// RotorColumns::ReadFunction.
enum class Changes { kForce, kTurn, kAccelerometer, kGyro, kPosition, kAttitude };
constexpr int kAccelerationRows = 12, kReadRows = 6;

struct NamedTerms {
  std::string name;
  Changes on;
  std::vector<Term> terms;
  bool of_all_vehicles = false;
};

// One term for each of the given body axes, `size` along it.
std::vector<Term> Along(const std::vector<int>& axes,
                        const std::function<double(const TermInputs&)>& size) {
  std::vector<Term> terms;
  terms.reserve(axes.size());
  for (const int axis : axes) {
    terms.emplace_back(
        [axis, size](const TermInputs& a) -> Vector3d { return size(a) * Vector3d::Unit(axis); });
  }
  return terms;
}

const std::vector<NamedTerms>& Library() {
  using S = const TermInputs&;
  using enum Changes;
  const auto thrust = [](S a) { return a.thrust; };
  static const std::vector<NamedTerms> library = {
      {"square of speed",
       kForce,
       {[](S a) { return Vector3d(a.v_B.norm() * a.v_B.x(), a.v_B.norm() * a.v_B.y(), 0); },
        [](S a) { return Vector3d(0, 0, a.v_B.norm() * a.v_B.z()); }}},
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
        [](S a) { return Vector3d(0, 0, a.w_B.z()); }},
       true},  // rotors brake turns: a hub that rises meets more air (Leishman, ch. 5)
      {"speed, as a moment",
       kTurn,
       {[](S a) { return Vector3d(a.v_B.y(), 0, 0); },
        [](S a) { return Vector3d(0, a.v_B.x(), 0); }}},
      {"time, as a moment", kTurn, Along({0, 1, 2}, [](S a) { return a.s; })},
      {"thrust, as the accelerometer reads it", kAccelerometer, Along({2}, thrust)},
      {"thrust, as the accelerometer reads it across", kAccelerometer, Along({0, 1}, thrust)},
      {"turn rates, as the gyro reads them",
       kGyro,
       {[](S a) { return Vector3d(a.w_B.x(), 0, 0); },
        [](S a) { return Vector3d(0, a.w_B.y(), 0); },
        [](S a) { return Vector3d(0, 0, a.w_B.z()); }}},
      {"heading, as the attitude is read",
       kAttitude,
       {[](S a) -> Vector3d { return std::sin(a.Heading()) * a.Down(); },
        [](S a) -> Vector3d { return std::cos(a.Heading()) * a.Down(); },
        [](S a) -> Vector3d { return std::sin(2.0 * a.Heading()) * a.Down(); },
        [](S a) -> Vector3d { return std::cos(2.0 * a.Heading()) * a.Down(); }}},
      {"a constant moment", kTurn, Along({2}, [](S) { return 1.0; })},
  };
  return library;
}

bool IsOfSensor(Changes on) { return on != Changes::kForce && on != Changes::kTurn; }

TermMotion MotionAt(const RotorSetup& setup, double t, const RotorState& x) {
  const RotorInput input = setup.data->InputAt(t);
  TermMotion at;
  at.t = input.t;
  at.R_E_B = AttitudeOf(x);
  at.v_B = at.R_E_B.transpose() * x.segment<3>(RotorDrivenModel::kVelocity);
  at.w_B = x.segment<3>(RotorDrivenModel::kRate);
  at.p_E = x.segment<3>(RotorDrivenModel::kPosition);
  at.thrust = -setup.model.BodyAccelerationOf(x.data(), input).force.z();
  at.s = 2.0 * t / setup.data->poses.back().t - 1.0;
  return at;
}

TermInputs TermInputsAt(const RotorSetup& setup, const Vector3d& middle, double t,
                        const RotorState& x) {
  TermInputs at{MotionAt(setup, t, x)};
  at.p_E -= middle;
  at.thrust -= setup.model.base().gravity();  // above hover
  return at;
}

// One column for each term: force rows (AccelerationsByColumn) above pose-reading rows
// (ReadFunction).
Eigen::MatrixXd ValuesOf(const TermInputs& at, int count) {
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(kAccelerationRows + kReadRows, count);
  int column = 0;
  for (const NamedTerms& named : Library()) {
    const int row = 3 * static_cast<int>(named.on);
    for (const Term& term : named.terms) values.col(column++).segment<3>(row) = term(at);
  }
  return values;
}

}  // namespace

RotorTerms MakeRotorTerms(const RotorSetup& setup) {
  RotorTerms library;
  int& count = library.columns.count;
  for (const NamedTerms& named : Library()) {
    const int terms = static_cast<int>(named.terms.size());
    library.terms.push_back({named.name, terms, named.of_all_vehicles || IsOfSensor(named.on)});
    count += terms;
  }
  const RotorData& data = *setup.data;
  Vector3d middle = Vector3d::Zero();
  for (const RotorPose& pose : data.poses) middle += pose.p_E;
  middle /= static_cast<double>(data.poses.size());
  const auto terms_at = [&setup, middle, count](double t, const RotorState& x) {
    return ValuesOf(TermInputsAt(setup, middle, t, x), count);
  };
  library.columns.accelerations = [terms_at](double t, const RotorState& x,
                                             Eigen::MatrixXd* accelerations) {
    *accelerations = terms_at(t, x).topRows<kAccelerationRows>();
  };
  library.columns.read = [terms_at](double t, const RotorState& x, Eigen::MatrixXd* read) {
    *read = terms_at(t, x).bottomRows<kReadRows>();
  };
  return library;
}

RotorColumns ColumnsOf(const RotorSetup& setup, std::vector<RotorVariant> variants,
                       const RotorColumns* beside) {
  RotorColumns columns = VariantColumns(setup.model, *setup.data, std::move(variants));
  if (beside == nullptr) return columns;
  const auto accelerations = [variants = columns.accelerations, beside](
                                 double t, const RotorState& x, Eigen::MatrixXd* out) {
    variants(t, x, out);
    Eigen::MatrixXd described;
    beside->accelerations(t, x, &described);
    out->rightCols(beside->count) = described;
  };
  const auto read = [beside](double t, const RotorState& x, Eigen::MatrixXd* out) {
    Eigen::MatrixXd described;
    beside->read(t, x, &described);
    out->rightCols(beside->count) = described;
  };
  return {columns.count + beside->count, accelerations, read};
}

std::vector<TermMotion> MotionsOf(const RotorSetup& setup, const RotorBatchResult& batch) {
  std::vector<TermMotion> motions;
  for (std::size_t k = 0; k < batch.nodes.size(); ++k) {
    motions.push_back(
        MotionAt(setup, setup.data->poses[k].t, Joined(batch.nodes[k].motion, batch.mean)));
  }
  return motions;
}

RotorColumns OpenRotorTerms(const RotorSetup& setup, const std::vector<TermForm>& terms) {
  const int count = static_cast<int>(terms.size());
  RotorColumns columns;
  columns.count = count;
  columns.accelerations = [&setup, terms, count](double t, const RotorState& x,
                                                 Eigen::MatrixXd* accelerations) {
    const TermMotion at = MotionAt(setup, t, x);
    accelerations->setZero(kAccelerationRows, count);
    for (int i = 0; i < count; ++i) {
      if (terms[i].on == TermOn::kForce) accelerations->col(i).head<3>() = terms[i].At(at);
      if (terms[i].on == TermOn::kTurn) accelerations->col(i).segment<3>(3) = terms[i].At(at);
    }
  };
  columns.read = [&setup, terms, count](double t, const RotorState& x, Eigen::MatrixXd* read) {
    const TermMotion at = MotionAt(setup, t, x);
    read->setZero(kReadRows, count);
    for (int i = 0; i < count; ++i) {
      if (terms[i].on == TermOn::kAttitude) read->col(i).tail<3>() = terms[i].At(at);
      if (terms[i].on == TermOn::kFix) read->col(i).head<3>() = at.R_E_B * terms[i].At(at);
    }
  };
  return columns;
}

}  // namespace trueline
