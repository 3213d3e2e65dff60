// What estimators do about terms of the open catalogue.
#include <algorithm>

#include "cost_functions/models/rotation.h"
#include "problems/effects/declaration.h"
#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

SizedTerm SizedOf(const Effect& effect) { return effect.term->Sized(effect["size"]); }

// The motion at the log's samples: velocity and place from a path, the rest from the log.
class TermMotionOfLog {
 public:
  TermMotionOfLog(const CorrectionContext& context, SizedTerm term)
      : context_(context), path_(context.Path()), term_(std::move(term)) {
    const FlightLog& log = context.original;
    BindTerms(log, &term_.with);
    using enum TermQuantity;
    for (int i = 0; i < 3; ++i) {
      rates_[i] = SeriesOf(log, static_cast<TermQuantity>(static_cast<int>(kRateX) + i), 0.0);
    }
    thrust_ = SeriesOf(log, kThrust, 0.0);
  }

  // What the term adds at `t`, in body axes. `gate`: that of a fix; may be null.
  Vector3d At(TimeNs t, const Quaterniond& q_E_B, const Gate* gate = nullptr) const {
    TermState<double> state;
    state.t = context_.Since(t);
    state.R_E_B = q_E_B.toRotationMatrix();
    SetPlace(t, &state);
    state.v_B = state.R_E_B.transpose() * state.v_B;
    for (int i = 0; i < 3; ++i) state.w_B[i] = rates_[i].At(state.t);
    state.thrust = thrust_.At(state.t);
    if (gate != nullptr) state.to_gate = gate->position - state.p_E;
    return term_.InBody(state);
  }

 private:
  // Place, and velocity in E; at rest before and after the path.
  void SetPlace(TimeNs t, TermState<double>* state) const {
    if (path_.empty()) return;
    const auto after = std::ranges::lower_bound(path_, t, {}, &VelocitySample::t);
    if (after == path_.begin() || after == path_.end()) {
      state->p_E = after == path_.end() ? path_.back().p_E : path_.front().p_E;
      return;
    }
    const VelocitySample &a = *std::prev(after), &b = *after;
    const double u = SecondsBetween(a.t, t) / SecondsBetween(a.t, b.t);
    state->p_E = a.p_E + u * (b.p_E - a.p_E);
    state->v_B = a.v_E + u * (b.v_E - a.v_E);
  }

  const CorrectionContext& context_;
  std::vector<VelocitySample> path_;
  SizedTerm term_;
  TermSeries rates_[3], thrust_;
};

void UndoAttitudeTerm(const Effect& effect, const CorrectionContext& context, FlightLog* log) {
  const TermMotionOfLog motion(context, SizedOf(effect));
  for (AttitudeSample& s : log->attitude) {
    s.q_Ep_I = s.q_Ep_I * RotationByVector(-motion.At(s.t, s.q_Ep_I));
  }
}

void UndoFixTerm(const Effect& effect, const CorrectionContext& context, FlightLog* log) {
  const TermMotionOfLog motion(context, SizedOf(effect));
  if (context.original.attitude.empty()) return;
  for (Fix& fix : log->fixes) {
    const Quaterniond& q_E_B = AttitudeNear(context.original, fix.t);
    fix.p_E -= q_E_B * motion.At(fix.t, q_E_B, GateOf(context.original, fix.gate));
  }
}

EffectInfo Declare(TermOn on) {
  EffectInfo info{
      .id = "term",
      .enters = on == TermOn::kAttitude ? EntersAt::kAttitude
                : on == TermOn::kFix    ? EntersAt::kFix
                                        : EntersAt::kForce,
      .parameters = {{"size", "unit of where over with", 1e-3, 1e9, 0.0}},
      .physics = "a force, a moment or an error that no named effect states",
      .definition = "what `where` names += size times what `with` names",
      .separate_by = "vary what the term goes with while all else stays",
      .role = Role::kNuisance,
  };
  if (on == TermOn::kForce) {
    info.add_force = [](const Effect& e, ForceEffects* all) { all->terms.push_back(SizedOf(e)); };
  }
  if (on == TermOn::kAttitude) {
    info.correct_at = CorrectionStage::kAttitude;
    info.correct = UndoAttitudeTerm;
  }
  if (on == TermOn::kFix) {
    info.correct_at = CorrectionStage::kFixClock;
    info.correct = UndoFixTerm;
  }
  if (on == TermOn::kForce || on == TermOn::kTurn) {
    info.extend = [](const Effect& e, RotorExtension* all) {
      all->effects.terms.push_back(SizedOf(e));
    };
  }
  return info;
}

}  // namespace

const EffectInfo& TermInfo(TermOn on) {
  static const EffectInfo infos[] = {Declare(TermOn::kForce), Declare(TermOn::kTurn),
                                     Declare(TermOn::kAttitude), Declare(TermOn::kFix)};
  return infos[static_cast<int>(on)];
}

}  // namespace trueline
