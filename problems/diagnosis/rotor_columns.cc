#include "problems/diagnosis/rotor_columns.h"

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

// Rows of SegmentModel::AccelerationsByColumn and of RotorColumns::ReadFunction, and where a term
// stands in them.
constexpr int kAccelerationRows = 12, kReadRows = 6;

int AccelerationRow(TermOn on) {
  switch (on) {
    case TermOn::kForce:
      return 0;
    case TermOn::kTurn:
      return 3;
    case TermOn::kAccelerometer:
      return 6;
    case TermOn::kGyro:
      return 9;
    default:
      return -1;
  }
}

TermMotion MotionAt(const RotorSetup& setup, double t, const RotorState& x) {
  const RotorInput input = setup.data->InputAt(t);
  TermMotion at;
  at.t = input.t;
  at.R_E_B = AttitudeOf(x);
  at.v_B = at.R_E_B.transpose() * x.segment<3>(RotorDrivenModel::kVelocity);
  at.w_B = x.segment<3>(RotorDrivenModel::kRate);
  at.p_E = x.segment<3>(RotorDrivenModel::kPosition);
  at.thrust = -setup.model.BodyAccelerationOf(x.data(), input).force.z();
  return at;
}

}  // namespace

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
      const int row = AccelerationRow(terms[i].on);
      if (row >= 0) accelerations->col(i).segment<3>(row) = terms[i].At(at);
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
