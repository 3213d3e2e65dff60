// Observable and unobservable states of a system: rank and null space of an observability matrix in
// exact arithmetic, with names.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "problems/observability/row_reduction.h"
#include "problems/observability/state_info.h"

namespace trueline {

// States that the data show only in combination (a single one: not at all). The null space is the
// direct sum of its blocks, and no finer split exists.
struct NullBlock {
  std::string label;           // "" for a single unobservable state, else J1, J2, ...
  std::vector<int> states;     // indices of error states
  std::vector<int> free;       // those set to 1 in turn, one for each null vector
  Eigen::MatrixXd support;     // states x free.size(): 1 where the null vector is not zero
  Eigen::MatrixXd directions;  // states x free.size(), physical units; empty until filled
};

struct RankReport {
  std::vector<int> states;  // the error states asked about
  int rank = 0;
  bool exact = true;
  std::vector<NullBlock> blocks;

  int nullity() const { return static_cast<int>(states.size()) - rank; }
  // "ok", "unobservable" or "joint: J1", by index of the error state.
  std::string StatusOf(int state) const;
};

// Rank and blocks of the columns `states` of an observability matrix modulo p.
RankReport ExactRank(const DynamicMatrix<Modular>& observability, const std::vector<int>& states);

// Fills in the null vectors of each block in physical units at the point of `observability`
// (doubles, with the rows of the exact matrix). The supports stay those of the exact computation.
void FillDirections(const Eigen::MatrixXd& observability, const std::vector<StateInfo>& info,
                    RankReport* report);

// Numerical rank by singular values, where no exact point exists (a recorded flight): a direction
// is unobservable if its singular value is below `tolerance` times the largest. `matrix` is any K
// with change of outputs = K * change of states, columns scaled.
RankReport NumericalRank(const Eigen::MatrixXd& matrix, const std::vector<int>& states,
                         double tolerance);

}  // namespace trueline
