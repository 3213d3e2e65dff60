// What a model other than that of a fit would push the vehicle with along the fitted flight, as
// columns for RotorNormal.
#pragma once

#include <memory>
#include <vector>

#include "problems/rotor_batch/rotor_normal.h"

namespace trueline {

// A model beside that of a fit. Its push less that of the fit's is a column.
struct RotorVariant {
  RotorAeroModel model;
  RotorConstants added;             // to the constants of the fit
  std::shared_ptr<RotorData> data;  // null: as in the fit
};

// One column each; `model` and `data` are the fit's and must outlive the result.
RotorColumns VariantColumns(const RotorAeroModel& model, const RotorData& data,
                            std::vector<RotorVariant> variants);

// Covariance (kConstants x kConstants, SI) that effects add to the constants of a fit that lacks
// them, each independent of the others and as large as its variant has it at one sigma: "consider"
// parameters (Schmidt 1966; Bierman 1977, ch. 8). It holds for any estimate that is the posterior
// mean given the same data, a filter's at its end among them.
Eigen::MatrixXd ConsideredCovariance(const RotorAeroModel& model, const RotorData& data,
                                     const RotorBatchOptions& options,
                                     const RotorBatchResult& batch,
                                     std::vector<RotorVariant> variants);

}  // namespace trueline
