// The forces that each candidate would add along a fitted flight, as columns for RotorNormal.
#pragma once

#include <string>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/effects/rotor_extension.h"
#include "problems/rotor_batch/rotor_variant.h"
#include "problems/rotor_diagnosis/rotor_catalogue.h"

namespace trueline {

// Data, model and prior of a fit with given effects in the model.
struct RotorWorld {
  RotorAeroModel model;
  RotorData data;
  RotorPrior prior;
};
RotorWorld MakeRotorWorld(const FlightLog& log, const RotorCalibrationOptions& options,
                          const std::vector<Effect>& effects);

// The model in which parameter `parameter` of `candidate` is `move` away from `value`, with the
// effects `others` too. `world` is the fit's: `others` and the candidate at `value`.
RotorVariant VariantOf(const FlightLog& log, const RotorCalibrationOptions& options,
                       const RotorWorld& world, const std::vector<Effect>& others,
                       const Candidate& candidate, const Eigen::VectorXd& value, int parameter,
                       double move);

// A term that is not an effect: products of velocity, rates, thrust, place and time that act as
// specific force, as angular acceleration or as a direct error of a reading. Terms describe a
// residual; they never become a cause.
struct RotorTerm {
  std::string name;  // the variable that the residual is correlated with
  int first, count;  // columns
  bool of_sensor;    // read, and no motion of the vehicle
};
// All terms for one flight; `world` must outlive it.
struct RotorLibrary {
  std::vector<RotorTerm> terms;
  RotorColumns columns;
};
RotorLibrary MakeRotorLibrary(const RotorWorld& world);

// Columns of all variants, then of the library, side by side.
RotorColumns ColumnsOf(const RotorWorld& world, std::vector<RotorVariant> variants,
                       const RotorLibrary* library);

}  // namespace trueline
