#include "problems/diagnosis/imu_columns.h"

#include <algorithm>

#include "cost_functions/models/rotation.h"
#include "problems/common/parallel.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

// A log with fixes, map and attitude only: effects on fixes need nothing else, unless they are
// terms.
FlightLog FixesOf(const FlightLog& log, bool with_terms) {
  FlightLog light;
  light.gates = log.gates;
  light.fixes = log.fixes;
  light.attitude = log.attitude;
  light.imu = with_terms ? log.imu : std::vector<ImuSample>{log.imu.front()};
  light.battery = log.battery;
  return light;
}

// Change of the corrected fixes, in place and time, between two parameter values. Rows are
// (position - fix) at the fix's time.
Eigen::VectorXd FixDifference(const SensitivityBase& base, const std::vector<Effect>& at,
                              const std::vector<Effect>& beyond, const BaseFlight& flight) {
  const bool terms = std::any_of(at.begin(), at.end(), [](const Effect& e) { return e.term; });
  FlightLog light = FixesOf(base.log, terms);
  // The fitted positions replace the fixes: the noise of a fix would enter the vector to the gate,
  // correlate with the fix's own residual, and look like a scale error.
  for (std::size_t i = 0; i < base.plan.fixes.size(); ++i) {
    light.fixes[base.plan.fixes[i]].p_E = flight.StateAtFix(i).head<3>();
  }
  const auto here = CorrectLog(light, at, base.path).fixes;
  const auto there = CorrectLog(light, beyond, base.path).fixes;
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(flight.rows());
  for (std::size_t i = 0; i < base.plan.fixes.size(); ++i) {
    const Fix &before = here[base.plan.fixes[i]], &after = there[base.plan.fixes[i]];
    const Eigen::Vector3d v_E = flight.StateAtFix(i).tail<3>();
    difference.segment<3>(3 * static_cast<Eigen::Index>(i)) =
        v_E * SecondsBetween(before.t, after.t) - (after.p_E - before.p_E);
  }
  return difference;
}

Eigen::VectorXd DriveResiduals(const SensitivityBase& base, const std::vector<Effect>& effects,
                               const FlightUnknowns& x) {
  const FlightLog log = CorrectLog(base.log, effects, base.path);
  BaseFlight flight(log, base.plan, base.options, ForceEffectsOf(effects));
  return flight.Evaluate(x, false).r;
}

Eigen::VectorXd ForceResiduals(const std::vector<Effect>& effects, const FlightUnknowns& x,
                               BaseFlight* flight) {
  flight->SetForceEffects(ForceEffectsOf(effects));
  return flight->Evaluate(x, false).r;
}

using Eigen::Vector3d;

Vector3d ToNearestGate(const FlightLog& log, const Vector3d& p_E) {
  const auto nearest = std::ranges::min_element(
      log.gates, {}, [&](const Gate& gate) { return (gate.position - p_E).squaredNorm(); });
  return nearest == log.gates.end() ? Vector3d::Zero() : Vector3d(nearest->position - p_E);
}

}  // namespace

Eigen::MatrixXd Sensitivity(const SensitivityBase& base, const Candidate& candidate,
                            const Eigen::VectorXd& parameters, const FlightUnknowns& x,
                            const Eigen::VectorXd& here, BaseFlight* flight) {
  const auto& infos = candidate.info->parameters;
  const EntersAt enters = candidate.info->enters;
  std::vector<Effect> at = base.effects;
  at.push_back(candidate.At(parameters));
  Eigen::MatrixXd columns(flight->rows(), infos.size());
  const auto fill = [&](int i) {
    Eigen::VectorXd moved = parameters;
    moved[i] += infos[i].step;
    std::vector<Effect> beyond = base.effects;
    beyond.push_back(candidate.At(moved));
    if (enters == EntersAt::kFix) {
      columns.col(i) = FixDifference(base, at, beyond, *flight) / infos[i].step;
    } else if (enters == EntersAt::kForce) {
      columns.col(i) = (ForceResiduals(beyond, x, flight) - here) / infos[i].step;
    } else {
      // Differences to one side leave a share of the step's square, which a large effect would pay.
      moved[i] -= 2.0 * infos[i].step;
      std::vector<Effect> below = base.effects;
      below.push_back(candidate.At(moved));
      columns.col(i) = (DriveResiduals(base, beyond, x) - DriveResiduals(base, below, x)) /
                       (2.0 * infos[i].step);
    }
  };
  // Force effects change the shared flight object, so they run in one thread.
  const int threads = enters == EntersAt::kForce ? 1 : 0;
  ParallelFor(static_cast<int>(infos.size()), threads, fill);
  if (enters == EntersAt::kForce) ForceResiduals(at, x, flight);
  return columns;
}

Columns FreeColumns(const Eigen::MatrixXd& d_rows) {
  Columns free{d_rows, Eigen::VectorXd::Zero(d_rows.cols()), Eigen::VectorXd::Zero(d_rows.cols())};
  for (auto column : free.d_rows.colwise()) {
    if (!column.allFinite()) column.setZero();
  }
  return free;
}

ImuLinearisation::ImuLinearisation(std::shared_ptr<const BaseFlight> flight, const BaseFit& fit,
                                   int ordinary_errors, Columns columns,
                                   const NoiseStrengths& noise, ColumnPlaces places)
    : Linearisation(ChainSystem(LinearFlight{*flight, fit.rows, fit.x, fit.weight, columns}, noise)
                        .ByCluster(),
                    std::move(places)),
      flight_(std::move(flight)),
      fit_(fit),
      ordinary_errors_(ordinary_errors),
      columns_(std::move(columns)) {}

std::vector<Linearisation::Relearned> ImuLinearisation::Relearn(
    const std::vector<std::vector<int>>& sets) const {
  // Columns in the model, alone and then with each set.
  const std::vector<int> modelled = ColumnPlaces().Next(fit_.columns.count());
  std::vector<std::vector<int>> with = {modelled};
  for (const std::vector<int>& set : sets) {
    with.push_back(modelled);
    for (const int border : set) with.back().push_back(border - kThetaSize);
  }
  const LinearFlight linear{*flight_, fit_.rows, fit_.x, fit_.weight, columns_};
  const std::vector<LearnedStrengths> learned =
      LearnNoiseOfEach(linear, ordinary_errors_, with, fit_.noise);
  std::vector<Relearned> relearned(sets.size());
  ParallelFor(static_cast<int>(sets.size()), 0, [&](int k) {
    const auto& [noise, evidence] = learned[k + 1];
    ColumnPlaces places;
    places.nuisances = places.Next(kThetaSize + fit_.columns.count());
    places.candidates = {{places.Next(sets[k].size()), Eigen::VectorXd::Ones(std::ssize(sets[k]))}};
    relearned[k] = {2.0 * (evidence - learned.front().evidence),
                    std::make_unique<ImuLinearisation>(flight_, fit_, ordinary_errors_,
                                                       columns_.Only(with[k + 1]), noise, places)};
  });
  return relearned;
}

ImuOpenTerms::ImuOpenTerms(BaseFlight* flight, const FlightUnknowns& x, int parts)
    : flight_(*flight) {
  flight->Evaluate(x, false);
  const FlightPlan& plan = flight_.plan();
  const ThetaVector theta = flight_.scaling().mean + flight_.scaling().sigma.cwiseProduct(x.theta);
  const auto fitted = ImuDrivenParameters<double>::FromArray(theta.data());
  R_E_Ep_ = RotationFromEuler<double>(fitted.Phi_E_Ep).transpose();
  R_I_B_ = RotationFromEuler<double>(fitted.Phi_I_B).transpose();
  for (int i = 0; i < 3; ++i) {
    const auto rate = static_cast<TermQuantity>(static_cast<int>(TermQuantity::kRateX) + i);
    rates_[i] = SeriesOf(flight_.log(), rate, 0.0);
  }
  for (std::size_t s = 0; s < plan.segments.size(); ++s) {
    const auto& span = plan.segments[s];
    const double h = SecondsBetween(span.begin, span.end) / parts;
    std::vector<Part>& of = parts_.emplace_back();
    for (int k = 0; k < parts; ++k) {
      const TimeNs middle = span.begin + FromSeconds((k + 0.5) * h);
      of.push_back({At(x, static_cast<int>(s), middle), k * h, h});
    }
  }
  for (const std::size_t i : plan.forces) {
    const TimeNs t = flight_.forces()[i].t;
    const int s = plan.SegmentOf(t);
    at_forces_.push_back(parts == 1 ? parts_[s].front().motion : At(x, s, t));
  }
  for (const std::size_t i : plan.fixes) {
    const TimeNs t = flight_.log().fixes[i].t;
    at_fixes_.push_back(At(x, plan.SegmentOf(t), t));
    const Gate* gate = GateOf(flight_.log(), flight_.log().fixes[i].gate);
    at_fixes_.back().to_gate =
        gate == nullptr ? Vector3d::Zero() : Vector3d(gate->position - at_fixes_.back().p_E);
  }
}

ImuOpenTerms::Motion ImuOpenTerms::At(const FlightUnknowns& x, int segment, TimeNs t) const {
  const auto& spans = flight_.plan().segments;
  const DriveTrack& track = flight_.track();
  const Drive drive = track.steps()[track.StepAt(t)].drive;
  Motion at;
  at.t = SecondsBetween(track.log_start(), t);
  at.R_E_B = R_E_Ep_ * drive.R_Ep_I * R_I_B_;
  // Between nodes the velocity changes about evenly.
  const auto& node = x.nodes[segment];
  Vector3d v_E = node.segment<3>(kStateAt + 3);
  const double since = SecondsBetween(spans[segment].begin, t);
  if (spans[segment].linked) {
    const double share = since / SecondsBetween(spans[segment].begin, spans[segment].end);
    v_E += share * (x.nodes[segment + 1].segment<3>(kStateAt + 3) - v_E);
  }
  at.v_B = at.R_E_B.transpose() * v_E;
  at.p_E = node.segment<3>(kStateAt) + 0.5 * since * (node.segment<3>(kStateAt + 3) + v_E);
  at.to_gate = ToNearestGate(flight_.log(), at.p_E);
  at.w_B =
      R_I_B_.transpose() * Vector3d(rates_[0].At(at.t), rates_[1].At(at.t), rates_[2].At(at.t));
  at.thrust = -drive.a_z;
  at.f_E = drive.a_z * at.R_E_B.col(2);
  return at;
}

std::vector<TermMotion> ImuOpenTerms::Motions() const {
  std::vector<TermMotion> motions;
  for (const std::vector<Part>& parts : parts_) {
    for (const Part& part : parts) motions.push_back(part.motion);
  }
  return motions;
}

// m/s^2 in E. The accelerometer measures a force's part along the thrust axis. The thrust of an
// attitude that is logged too far points too far.
Vector3d ImuOpenTerms::Acceleration(const TermForm& term, const Motion& at) {
  if (term.on == TermOn::kFix) return Vector3d::Zero();
  Vector3d unit_B = term.At(at);
  if (term.on == TermOn::kAttitude) return at.f_E.cross(at.R_E_B * unit_B);
  unit_B.z() = 0.0;
  return at.R_E_B * unit_B;
}

Eigen::VectorXd ImuOpenTerms::Column(const TermForm& term) const {
  const FlightPlan& plan = flight_.plan();
  std::vector<std::vector<Vector3d>> pushes;
  for (const std::vector<Part>& parts : parts_) {
    std::vector<Vector3d>& of = pushes.emplace_back();
    for (const Part& part : parts) of.push_back(Acceleration(term, part.motion));
  }
  // Changes of position and velocity `dt` after the begin of segment s.
  const auto moved = [&](std::size_t s, double dt) {
    Eigen::Matrix<double, 6, 1> change = Eigen::Matrix<double, 6, 1>::Zero();
    for (std::size_t k = 0; k < parts_[s].size(); ++k) {
      const Part& part = parts_[s][k];
      const double length = std::min(part.length, dt - part.begin);
      if (length <= 0.0) break;
      change.head<3>() += pushes[s][k] * length * (dt - part.begin - 0.5 * length);
      change.tail<3>() += pushes[s][k] * length;
    }
    return change;
  };
  Eigen::VectorXd column = Eigen::VectorXd::Zero(flight_.rows());
  for (std::size_t i = 0; i < plan.fixes.size(); ++i) {
    const TimeNs t = flight_.log().fixes[plan.fixes[i]].t;
    const int s = plan.SegmentOf(t);
    column.segment<3>(3 * static_cast<Eigen::Index>(i)) =
        moved(s, SecondsBetween(plan.segments[s].begin, t)).head<3>();
    if (term.on == TermOn::kFix) {
      column.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          at_fixes_[i].R_E_B * term.At(at_fixes_[i]);
    }
  }
  const auto forces_at = static_cast<Eigen::Index>(3 * plan.fixes.size());
  if (term.on == TermOn::kForce) {
    for (std::size_t i = 0; i < at_forces_.size(); ++i) {
      column.segment<2>(forces_at + 2 * static_cast<Eigen::Index>(i)) =
          term.At(at_forces_[i]).head<2>();
    }
  }
  for (std::size_t s = 0; s < plan.segments.size(); ++s) {
    if (!plan.segments[s].linked) continue;
    const double h = SecondsBetween(plan.segments[s].begin, plan.segments[s].end);
    column.segment<6>(flight_.LinkRow(static_cast<int>(s))) = -moved(s, h);
  }
  return column;
}

Eigen::MatrixXd ImuOpenTerms::Columns(const std::vector<TermForm>& terms) const {
  Eigen::MatrixXd columns(flight_.rows(), terms.size());
  ParallelFor(static_cast<int>(terms.size()), 0, [&](int i) { columns.col(i) = Column(terms[i]); });
  return columns;
}

}  // namespace trueline
