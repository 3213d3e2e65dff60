// What another stream says directly of the causes that a diagnosis names: the logged attitude, the
// accelerometer and the fixes against mocap, or the attitude against the gyroscope, without the
// model of the vehicle. Also where the fit did not use mocap.
#pragma once

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// Asks for each cause's size and stores it as `witness`. Causes that act on one stream are asked
// for together. `log`: as fitted, with the attitude that was used; `recorded`: with the fixes that
// the fit left out; `fitted`: the path of the fit, used where there is no mocap.
void AskWitnesses(const FlightLog& log, const FlightLog& recorded,
                  const std::vector<VelocitySample>& fitted, std::vector<Cause>* causes);

// False for a sigma that says that the stream does not show the parameter.
bool Shown(const EffectParameterInfo& parameter, double sigma);

// "w_x = 1.49 +- 0.043 m/s, w_y = ...": the parameters that are shown.
std::string SizesText(const EffectInfo& info, const Eigen::VectorXd& value,
                      const Eigen::VectorXd& sigma);

// The witness's verdict on an effect that the fit states. It refutes a size that differs from its
// own by 3 sigmas of both if it shows less than half of it. Otherwise it confirms the effect if it
// shows a significant size of the same sign itself; WidenByWitness treats a size that is off.
// `value` and `sigma` of the witness must be set.
std::string WitnessVerdict(const Witness& witness, const Cause& cause);

// Where fit and witness differ by more than twice the sigma of both, one of them errs by more than
// it states: the cause's sigma then includes the difference (the variance between two methods of
// DerSimonian and Laird 1986). A cause that its witness refutes is left as it is.
void WidenByWitness(Cause* cause);

}  // namespace trueline
