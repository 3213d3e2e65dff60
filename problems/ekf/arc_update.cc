#include "problems/ekf/arc_update.h"

#include <Eigen/Dense>

namespace trueline {

void PredictOver(const ImuInputs& imu, TimeNs t0, TimeNs t1, Ekf* filter) {
  if (t1 <= t0) return;
  imu.ForEachStep(t0, t1, [&](const ImuInput& input, double dt) { filter->Predict(input, dt); });
}

bool IteratedArcUpdate(const ImuInputs& imu, AttitudeForm form, TimeNs t0, const Fix& fix,
                       Ekf* filter) {
  constexpr int kMaxRounds = 4;
  constexpr double kSettled = 1e-3;  // sigmas, convergence in every state
  const Ekf at_start = *filter;
  const Matrix15d& P0 = at_start.cov();
  Vector15d shift = Vector15d::Zero();
  for (int round = 0; round < kMaxRounds; ++round) {
    *filter = at_start;
    filter->SetState(Moved(form, at_start.state(), shift));
    filter->RecordTransitions();
    PredictOver(imu, t0, fix.t, filter);
    // The end of the unshifted state, by the new linearisation.
    const Matrix15d& F = filter->recorded_transitions();
    filter->SetState(Moved(form, filter->state(), -(F * shift)));
    const Eigen::Matrix3d S = filter->InnovationCovariance(fix.sigma);
    const Eigen::Vector3d weighted = S.llt().solve(filter->Innovation(fix.p_E));
    const Vector15d next = P0 * F.topRows<3>().transpose() * weighted;
    const Vector15d change =
        (next - shift).cwiseAbs().cwiseQuotient(P0.diagonal().cwiseSqrt().cwiseMax(1e-12));
    if (change.maxCoeff() < kSettled) break;
    shift = next;
  }
  filter->StopRecording();
  return filter->Update(fix.p_E, fix.sigma);
}

}  // namespace trueline
