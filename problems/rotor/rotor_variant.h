// Forces of an alternative model along the fitted flight, less those of the fit's model, as columns
// for RotorNormal.
#pragma once

#include <memory>
#include <vector>

#include "problems/rotor/rotor_normal.h"

namespace trueline {

// An alternative to the fit's model. The difference of their forces is one column.
struct RotorVariant {
  RotorAeroModel model;
  RotorConstants added;                   // to the constants of the fit
  std::shared_ptr<const RotorData> data;  // null: the fit's
};

// One column each; `model` and `data` are the fit's and must outlive the result.
RotorColumns VariantColumns(const RotorAeroModel& model, const RotorData& data,
                            std::vector<RotorVariant> variants);

// Covariance (kConstants x kConstants, SI) that unmodelled effects add to the constants of a fit:
// "consider" parameters (Schmidt 1966; Bierman 1977, ch. 8). Each variant is one effect at one
// sigma, independent of the others. It holds for any estimate that is the posterior mean given the
// same data, such as a filter's at its end.
Eigen::MatrixXd ConsideredCovariance(const RotorAeroModel& model, const RotorData& data,
                                     const RotorBatchOptions& options,
                                     const RotorBatchResult& batch,
                                     std::vector<RotorVariant> variants);

}  // namespace trueline
