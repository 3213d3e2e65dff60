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
  // Of the log corrected for effects, by the log's path; and the log without the stream's noise,
  // whose derivatives by the sizes of effects are not biased by it (errors in variables).
  std::function<StreamRows(const FlightLog& corrected)> rows;
  std::function<FlightLog(const FlightLog& log)> noiseless;
  // Of the ordinary sizes: the stream's own errors of the same kind, such as scale and delay.
  double own_errors = 0.0;
  // Effects whose size a column of `rows`' offsets is, by id: no path is needed for them.
  std::map<std::string, int> stated_by = {};
  // How often the log is corrected by what was found and compared again, where a large error spoils
  // what `noiseless` makes of it.
  int passes = 1;
  // False if the fit used the same: mocap's positions, turned by the logged attitude.
  bool independent = true;
};

// Whether mocap's positions are among the fixes that were fitted (gate -1).
bool IsFittedToMocap(const FlightLog& data);

// None for an effect that no stream shows without the vehicle's model.
std::optional<StreamComparison> ComparisonFor(const EffectInfo& info, const MocapComparison& mocap,
                                              bool fitted_to_mocap);

// The accelerometer against mocap; the fit may have used the same.
StreamComparison AgainstAcceleration(const MocapComparison& mocap, bool fitted_to_mocap);
// The logged attitude against the gyroscope, which measures how the vehicle turned.
StreamComparison AgainstGyroscope();

// All comparisons with mocap that use nothing of what the fit used.
std::vector<StreamComparison> IndependentComparisons(const MocapComparison& mocap,
                                                     bool fitted_to_mocap);

// Huber weights, for each of x, y, z in its own scale. Rows of zeros (no data) get none.
Eigen::VectorXd RobustWeightsByAxis(const Eigen::VectorXd& residual);

// Mean distance between a corrected stream and mocap, by second since the log's start: of the
// seconds that `counts` chooses, constant offsets (a bias, turned frames) fitted to them.
std::map<int, double> DistancesFromMocap(const StreamRows& rows,
                                         const std::function<bool(double t)>& counts);

}  // namespace trueline
