// The forces that each candidate would add along a fitted flight, as columns for RotorNormal.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/diagnosis/open_term.h"
#include "problems/effects/declaration.h"
#include "problems/rotor/rotor_normal.h"

namespace trueline {

// A flight's data by the motors' lag. Data of one lag are made once, since to smooth the rotors'
// speeds takes as long as a solve.
class LaggedRotorData {
 public:
  // `log` must outlive this object.
  LaggedRotorData(const FlightLog& log, int rotors, RotorDataOptions options);
  // `lag` (s) comes instead of that of the options.
  std::shared_ptr<const RotorData> With(double lag) const;

 private:
  const FlightLog& log_;
  int rotors_;
  RotorDataOptions options_;
  mutable std::map<double, std::shared_ptr<const RotorData>> made_;
};

// Data, model and prior of a fit with given effects in the model.
struct RotorSetup {
  RotorAeroModel model;
  std::shared_ptr<const RotorData> data;
  RotorPrior prior;
  double motor_lag;  // s, used
};
RotorSetup MakeRotorSetup(const FlightLog& log, const RotorCalibrationOptions& options,
                          const LaggedRotorData& data, const std::vector<Effect>& effects);

// Of the open catalogue, a column each; `setup` must outlive them.
RotorColumns OpenRotorTerms(const RotorSetup& setup, const std::vector<TermForm>& terms);

}  // namespace trueline
