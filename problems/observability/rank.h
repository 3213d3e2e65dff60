// Observable and unobservable states of a system: rank and null space of an observability matrix in
// exact arithmetic, with names.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "cost_functions/numbers/modular.h"

namespace trueline {

// Names of a system's error states. Frames and units are those of the model.
struct StateInfo {
  std::string name;
  std::string unit;
  bool moving = false;   // part of the trajectory, so of no interest itself
  double typical = 1.0;  // typical change, scales numerical ranks
};

inline std::vector<double> TypicalSizes(const std::vector<StateInfo>& states) {
  std::vector<double> sizes(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) sizes[i] = states[i].typical;
  return sizes;
}

// -1 if there is no such state.
inline int FindState(const std::vector<StateInfo>& states, const std::string& name) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

// Adds those of `more` that are not there yet: a state asked for twice would have no inverse.
inline void AddStates(const std::vector<int>& more, std::vector<int>* states) {
  for (const int state : more) {
    if (std::count(states->begin(), states->end(), state) == 0) states->push_back(state);
  }
}

// The states of constants of the rotor-driven model, each once. Calls fail(text) for another name.
template <class Fail>
std::vector<int> ConstantsNamed(const std::vector<StateInfo>& states,
                                const std::vector<std::string>& names, const Fail& fail) {
  std::vector<int> found;
  for (const std::string& name : names) {
    const int state = FindState(states, name);
    if (state < 0 || states[state].moving) {
      fail("'" + name +
           "' is no constant of the rotor-driven model; use m, I_x ..., r_BM_x ..., r_BP_x ..., "
           "r_BI_x ..., b_a_x ..., b_w_x ..., k_f, k_m");
    }
    AddStates({state}, &found);
  }
  return found;
}

// Gauss-Jordan elimination for exact numbers (Modular: any non-zero pivot) and for doubles (largest
// pivot; pivots below a tolerance are zero).
inline double PivotSize(Modular value) { return value == Modular() ? 0.0 : 1.0; }
inline double PivotSize(double value) { return std::abs(value); }

template <class C>
using DynamicMatrix = Eigen::Matrix<C, Eigen::Dynamic, Eigen::Dynamic>;
template <class C>
using DynamicVector = Eigen::Matrix<C, Eigen::Dynamic, 1>;

template <class C>
struct RowEchelon {
  DynamicMatrix<C> rows;    // rank x columns, reduced: each pivot is 1 and alone in its column
  std::vector<int> pivots;  // the column of each row's pivot
  std::vector<int> free;    // the other columns
};

// Reduced row echelon form of `a`. With `from_right` columns are processed from the last to the
// first, so that free columns come as early as possible. `tolerance` applies to pivots of doubles.
template <class C>
RowEchelon<C> RowReduce(DynamicMatrix<C> a, bool from_right = false, double tolerance = 1e-10) {
  RowEchelon<C> result;
  int rank = 0;
  for (int step = 0; step < a.cols(); ++step) {
    const int column = static_cast<int>(from_right ? a.cols() - 1 - step : step);
    int best = rank;
    for (int row = rank; row < a.rows(); ++row) {
      if (PivotSize(a(row, column)) > PivotSize(a(best, column))) best = row;
    }
    if (rank >= a.rows() || PivotSize(a(best, column)) <= tolerance) {
      result.free.push_back(column);
      continue;
    }
    a.row(best).swap(a.row(rank));
    const C inverse = C(1.0) / a(rank, column);
    for (int j = 0; j < a.cols(); ++j) a(rank, j) *= inverse;
    for (int row = 0; row < a.rows(); ++row) {
      const C factor = a(row, column);
      if (row == rank || PivotSize(factor) == 0.0) continue;
      for (int j = 0; j < a.cols(); ++j) a(row, j) -= factor * a(rank, j);
    }
    result.pivots.push_back(column);
    ++rank;
  }
  result.rows = a.topRows(rank);
  return result;
}

// Basis of the null space, one column for each free column of the echelon: 1 there, 0 at the other
// free ones.
template <class C>
DynamicMatrix<C> NullSpace(const RowEchelon<C>& echelon) {
  const Eigen::Index columns =
      static_cast<Eigen::Index>(echelon.pivots.size() + echelon.free.size());
  DynamicMatrix<C> basis(columns, static_cast<Eigen::Index>(echelon.free.size()));
  basis.setConstant(C(0.0));
  for (std::size_t k = 0; k < echelon.free.size(); ++k) {
    basis(echelon.free[k], k) = C(1.0);
    for (std::size_t row = 0; row < echelon.pivots.size(); ++row) {
      basis(echelon.pivots[row], k) = -echelon.rows(row, echelon.free[k]);
    }
  }
  return basis;
}

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
