// Taylor coefficients of the flat outputs as independent variables on the tape.
#pragma once

#include <vector>

#include "cost_functions/numbers/taylor.h"
#include "problems/observability/variable.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

template <int kOrder>
struct FlatVariables {
  Eigen::Matrix<Variable, kFlatOutputs, kOrder + 1> inputs;
  Vec4<Taylor<Variable, kOrder>> series;

  explicit FlatVariables(const FlatMatrix& expansion) {
    inputs = expansion.unaryExpr(&Variable::Independent);
    for (int i = 0; i < kFlatOutputs; ++i) {
      series[i] = Taylor<Variable, kOrder>::Start(inputs(i, 0));
      for (int j = 1; j <= kOrder; ++j) series[i].Append(inputs(i, j));
    }
  }
  // Their adjoints, given those of all entries.
  FlatMatrix Adjoints(const std::vector<double>& adjoints) const {
    FlatMatrix result(kFlatOutputs, kOrder + 1);
    for (int i = 0; i < kFlatOutputs; ++i) {
      for (int j = 0; j <= kOrder; ++j) result(i, j) = adjoints[inputs(i, j).entry()];
    }
    return result;
  }
};

}  // namespace trueline
