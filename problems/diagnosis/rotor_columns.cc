#include "problems/diagnosis/rotor_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/chain/damped_gauss_newton.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/rotor_flight.h"
#include "problems/diagnosis/thresholds.h"

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
  const std::vector<Effect> all = Concatenated(options.effects, effects);
  const RotorExtension found = RotorExtensionOf(effects);
  const double lag = options.data.motor_lag + found.motor_lag;
  RotorSetup setup{
      RotorAeroModel(options.vehicle.model.rotors(), log.gravity, RotorEffectsOn(log, all)),
      data.With(lag), options.prior, lag};
  setup.prior.mean += found.added;
  return setup;
}

namespace {

using Eigen::Vector3d;

// Rows of SegmentModel::AccelerationsByColumn and of RotorColumns::ReadFunction, and where a term
// stands in them.
constexpr int kAccelerationRows = 12, kReadRows = 6;
constexpr int kAccelerationRow[] = {0, 3, -1, -1, 6, 9};  // in the order of TermOn

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

// Columns of all variants, then those of `beside` (may be null; else it must outlive them).
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

constexpr double kRotorCluster = 1.0;  // s, over which residuals may be correlated

// The size of each parameter that one unit of a column at this value stands for.
Eigen::VectorXd UnitsAt(const Candidate& candidate, const Eigen::VectorXd& value) {
  const double share = value == candidate.Neutral() ? 1.0 : kSmallPart;
  return share * candidate.EachOf(&EffectParameterInfo::step);
}

}  // namespace

RotorColumns OpenRotorTerms(const RotorSetup& setup, const std::vector<TermForm>& terms) {
  const int count = static_cast<int>(terms.size());
  RotorColumns columns;
  columns.count = count;
  columns.accelerations = [&setup, terms, count](double t, const RotorState& x,
                                                 Eigen::MatrixXd* accelerations) {
    const TermMotion at = MotionAt(setup, t, x);
    accelerations->setZero(kAccelerationRows, count);
    for (int i = 0; i < count; ++i) {
      const int row = kAccelerationRow[static_cast<int>(terms[i].on)];
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

std::vector<RotorVariant> RotorDrivenFlight::VariantsFor(const Candidate& candidate,
                                                         const Eigen::VectorXd& value,
                                                         const std::vector<Effect>& others) const {
  const Eigen::VectorXd moves = UnitsAt(candidate, value);
  std::vector<RotorVariant> variants;
  for (int i = 0; i < value.size(); ++i) {
    std::vector<Effect> effects = others;
    effects.push_back(candidate.At(value + moves[i] * Eigen::VectorXd::Unit(value.size(), i)));
    const RotorSetup moved = MakeRotorSetup(log_, options_, *lagged_, effects);
    const bool other_data = moved.motor_lag != fit_.setup->motor_lag;
    variants.push_back({moved.model, moved.prior.mean - fit_.setup->prior.mean,
                        other_data ? moved.data : nullptr});
  }
  return variants;
}

std::vector<RotorVariant> RotorDrivenFlight::VariantsOfFound() const {
  std::vector<RotorVariant> variants;
  for (std::size_t k = 0; k < fit_.found.size(); ++k) {
    std::vector<Effect> others = EffectsOf(fit_.found);
    EraseAt(k, &others);
    for (RotorVariant& v : VariantsFor(fit_.found[k].candidate, fit_.found[k].value, others)) {
      variants.push_back(std::move(v));
    }
  }
  return variants;
}

RotorNormal RotorDrivenFlight::NormalWith(std::vector<RotorVariant> variants,
                                          const RotorColumns* beside,
                                          const RotorWeights* weights) const {
  return {fit_.setup->model,
          *fit_.setup->data,
          BatchOptions(),
          fit_.batch,
          ColumnsOf(*fit_.setup, std::move(variants), beside),
          kRotorCluster,
          weights};
}

const RotorNormal& RotorDrivenFlight::Normal() const {
  if (!normal_) normal_ = NormalWith(VariantsOfFound());
  return *normal_;
}

bool RotorDrivenFlight::Step(std::vector<Found>* found) const {
  const RotorWeights weights = fit_.weights.By();
  const RotorNormal normal = NormalWith(VariantsOfFound(), nullptr, &weights);
  Eigen::VectorXd lowest = Eigen::VectorXd::Constant(normal.border(), -INFINITY);
  int at = constants();
  for (const Found& f : *found) {
    const Eigen::VectorXd units = UnitsAt(f.candidate, f.value);
    for (int i = 0; i < f.value.size(); ++i, ++at) {
      const EffectParameterInfo& info = f.candidate.info->parameters[i];
      if (!info.either_sign) lowest[at] = (1e-3 * info.step - f.value[i]) / units[i];
    }
  }
  const Eigen::VectorXd highest = Eigen::VectorXd::Constant(normal.border(), INFINITY);
  const Eigen::VectorXd z = BoundedStep(normal.M(), normal.b(), lowest, highest);
  const Eigen::VectorXd sigma = normal.Covariance().diagonal().cwiseSqrt();
  bool settled = true;
  at = constants();
  for (Found& f : *found) {
    const Eigen::VectorXd units = UnitsAt(f.candidate, f.value);
    for (int i = 0; i < f.value.size(); ++i, ++at) {
      f.value[i] += z[at] * units[i];
      settled = settled && std::abs(z[at]) < kSmallPart * sigma[at];
    }
  }
  return settled;
}

std::unique_ptr<Linearisation> RotorDrivenFlight::Linearise(
    const std::vector<Candidate>& candidates, bool terms) const {
  std::vector<RotorVariant> variants;
  if (!candidates.empty() || terms) variants = VariantsOfFound();
  const std::vector<Effect> effects = EffectsOf(fit_.found);
  for (const Candidate& c : candidates) {
    for (RotorVariant& v : VariantsFor(c, c.Neutral(), effects)) variants.push_back(std::move(v));
  }
  const TermScope scope{drive(), log_, terms ? Motions() : std::vector<TermMotion>()};
  const std::vector<TermGroup> groups = terms ? TermGroups(scope) : std::vector<TermGroup>();
  const RotorColumns of_terms = OpenRotorTerms(*fit_.setup, TermsOf(groups));
  ColumnPlaces places;
  places.nuisances = places.Next(constants());
  for (const Found& f : fit_.found) {
    places.found.push_back({places.Next(f.candidate.size()), UnitsAt(f.candidate, f.value)});
  }
  for (const Candidate& c : candidates) {
    places.candidates.push_back({places.Next(c.size()), UnitsAt(c, c.Neutral())});
  }
  for (const TermGroup& group : groups) {
    places.terms.push_back(TermColumnsOf(group, scope.motions, places.Next(group.terms.size())));
  }
  const bool as_fitted = candidates.empty() && !terms;
  return std::make_unique<Linearisation>(
      as_fitted ? Normal() : NormalWith(std::move(variants), terms ? &of_terms : nullptr),
      std::move(places));
}

std::vector<TermMotion> RotorDrivenFlight::Motions() const {
  std::vector<TermMotion> motions;
  for (std::size_t k = 0; k < fit_.batch.nodes.size(); ++k) {
    motions.push_back(MotionAt(*fit_.setup, fit_.setup->data->poses[k].t,
                               Joined(fit_.batch.nodes[k].motion, fit_.batch.mean)));
  }
  return motions;
}

std::unique_ptr<Linearisation> RotorDrivenFlight::LineariseTerms(
    const std::vector<TermForm>& terms) const {
  const RotorColumns columns = OpenRotorTerms(*fit_.setup, terms);
  std::vector<RotorVariant> variants = VariantsOfFound();
  ColumnPlaces places;
  places.nuisances = places.Next(constants() + variants.size());
  for (const TermForm& term : terms) places.terms.push_back({term.Name(), places.Next(1), {}});
  return std::make_unique<Linearisation>(NormalWith(std::move(variants), &columns),
                                         std::move(places));
}

std::vector<std::string> RotorDrivenFlight::ExtraordinaryNoise() const {
  const RotorNoise &is = options_.noise, &said = stated_;
  return Extraordinary({
      {is.accel / said.accel, 3.0, "an accelerometer that scatters {:.1f} times as stated"},
      {is.gyro / said.gyro, 3.0, "a gyro that scatters {:.1f} times as stated"},
      {is.position / said.position, 3.0, "a position that scatters {:.1f} times as stated"},
      {is.attitude / said.attitude, 3.0, "an attitude that scatters {:.1f} times as stated"},
      {is.force_density, 0.5, "unmodelled white forces of {:.2f} m/s^2/sqrt(Hz)"},
      {is.angular_density, 10.0, "unmodelled white moments of {:.1f} rad/s^2/sqrt(Hz)"},
      {is.angular_drift, 5.0,
       "unmodelled moments that last, of {:.1f} rad/s^2 for " +
           fmt::format("{:.1f} s", is.angular_drift_time)},
  });
}

}  // namespace trueline
