// What each candidate would push the vehicle with along a fitted flight, as columns for
// RotorNormal.
#pragma once

#include <string>
#include <vector>

#include "problems/effects/rotor_extension.h"
#include "problems/rotor_batch/rotor_variant.h"
#include "problems/rotor_calibration/rotor_calibration.h"
#include "problems/rotor_diagnosis/rotor_catalogue.h"

namespace trueline {

// The flight with given effects in the model: what a fit needs.
struct RotorWorld {
  RotorAeroModel model;
  RotorData data;
  RotorPrior prior;
};
RotorWorld MakeRotorWorld(const FlightLog& log, const RotorCalibrationOptions& options,
                          const std::vector<Effect>& effects);

// `candidate` with parameter `parameter` moved by `move` from `value`, beside the effects `others`
// that are in the model. `world`: of the fit, with `others` and the candidate at `value` in it.
RotorVariant VariantOf(const FlightLog& log, const RotorCalibrationOptions& options,
                       const RotorWorld& world, const std::vector<Effect>& others,
                       const Candidate& candidate, const Eigen::VectorXd& value, int parameter,
                       double move);

// Terms of no effect: products of velocity, rates, thrust, place and time, as specific force or
// angular acceleration or as a reading beside the motion. They describe a residual, and name no
// cause.
struct RotorTerm {
  std::string name;  // what the residual goes with
  int first, count;  // columns
  bool of_sensor;    // read, and no motion of the vehicle
};
// Of one flight; `world` must outlive it.
struct RotorLibrary {
  std::vector<RotorTerm> terms;
  RotorColumns columns;
};
RotorLibrary MakeRotorLibrary(const RotorWorld& world);

// All variants and then the library, side by side.
RotorColumns ColumnsOf(const RotorWorld& world, std::vector<RotorVariant> variants,
                       const RotorLibrary* library);

}  // namespace trueline
