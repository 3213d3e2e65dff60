// Analysis of the misfit: growth of the simulation error when the measured flight is replayed open
// loop with constant parameters, and the variables that this error is correlated with.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "problems/diagnosis/diagnosed_flight.h"

namespace trueline {

struct MisfitRow {
  ReplayError before, after;
  ReplaySituation at;
};

// RMS over all replays of one length, m.
struct MisfitGrowth {
  double horizon;  // s
  int replays;
  Eigen::Vector3d before_E, after_E, before_B, after_B;
};

// Share of the variance of the horizontal error that a variable explains (one-way analysis of
// variance over bins, less the share expected by chance), and its p-value.
struct MisfitShare {
  std::string by;
  double body, earth;  // in body axes, in E
  double p;            // of the larger one
};

struct Misfit {
  std::string measured_by;                  // what the replays are compared with: mocap, ...
  double shares_horizon = kHeldOutHorizon;  // s
  std::vector<MisfitRow> rows;
  std::vector<MisfitGrowth> growth;
  std::vector<MisfitShare> shares;  // before; largest first
};

// `before` and `after` the causes; `after` may be empty if no cause was found.
Misfit MisfitOf(const DiagnosedFlight& flight, const std::vector<ReplayError>& before,
                const std::vector<ReplayError>& after);

// The value of a slow stream at t: its last sample before; NaN before its first one.
double LastBefore(const std::vector<ScalarSample>& samples, TimeNs t);

// Bins of about equal count, numbered from 0; -1 for missing values.
std::vector<int> QuantileBins(const std::vector<double>& values, int bins);

// Share of the variance of an error that a variable explains: one-way analysis of variance.
struct VarianceShare {
  double share;  // 0 to 1, less the share expected by chance
  double p;      // probability of as much by chance
};

// Over both axes together; entries with the same bin form a group.
VarianceShare VarianceShareOf(const std::vector<Eigen::Vector2d>& errors,
                              const std::vector<int>& bin);

// Texts, with their values, of learned noise that exceeds what ordinary flights have at most.
struct NoiseFinding {
  double value, most;
  std::string text;
};
std::vector<std::string> Extraordinary(const std::vector<NoiseFinding>& noise);

struct TimedResidual {
  double t;  // s
  Eigen::VectorXd value;
};

// Two-sided p-value of the correlation between neighbours, at most `apart` seconds from each other,
// under whiteness. The statistic is the sum of products over its own empirical scatter, so heavy
// tails do not bias it; it is compared with the normal distribution.
double WhitenessOf(const std::vector<TimedResidual>& residuals, double apart);

// Sums over consecutive blocks of at least `length` seconds, each at its first time.
std::vector<TimedResidual> SumsOfBlocks(const std::vector<TimedResidual>& residuals, double length);

}  // namespace trueline
