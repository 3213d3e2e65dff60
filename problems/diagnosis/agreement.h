// How well the streams of a log agree with mocap, without the model of the vehicle.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/diagnosis/mocap_rows.h"
#include "problems/effects/declaration.h"

namespace trueline {

// The comparison that shows an effect.
struct StreamComparison {
  std::string stream;  // in words
  std::string unit;    // of its errors
  // Effects that look alike at one frequency of turns: if one is asked for, all are free.
  std::vector<std::string> alike;
  MocapRows (MocapComparison::*rows)(const FlightLog&) const;
  // False if the fit used the same: mocap's positions, turned by the logged attitude.
  bool independent = true;
};

// Whether mocap's positions are among the fixes that were fitted (gate -1).
bool IsFittedToMocap(const FlightLog& data);

// None for an effect that no stream shows without the vehicle's model.
std::optional<StreamComparison> ComparisonFor(const EffectInfo& info, const MocapComparison& mocap,
                                              bool fitted_to_mocap);

// All comparisons that use nothing of what the fit used.
std::vector<StreamComparison> IndependentComparisons(const MocapComparison& mocap,
                                                     bool fitted_to_mocap);

// Huber weights, for each of x, y, z in its own scale. Rows of zeros (no data) get none.
Eigen::VectorXd RobustWeightsByAxis(const Eigen::VectorXd& residual);

// Mean distance between a corrected stream and mocap, by second since the log's start: of the
// seconds that `counts` chooses, constant offsets (a bias, turned frames) fitted to them.
std::map<int, double> DistancesFromMocap(const MocapRows& rows,
                                         const std::function<bool(double t)>& counts);

}  // namespace trueline
