// What the reference flights of a vehicle say of the next one: the trim to expect, and how far
// flights scatter about it within a session and between sessions.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "problems/against/command_trim.h"

namespace trueline {

// Standard deviations of ln(command): one that all channels share, and one of each channel's own.
struct TrimScatter {
  double common = 0.0, own = 0.0;
  double dof = 0.0;  // degrees of freedom that it is known by

  Eigen::MatrixXd Cov(int channels) const;
  double OfOneChannel() const;
};

// What small quadrotors scatter by (CrazyPAD: 0.9 % within a session, 3.3 % between sessions, by
// motor).
struct UsualScatter {
  TrimScatter within = {0.005, 0.007}, between = {0.025, 0.022};
};

struct ReferenceFlight {
  CommandTrim trim;
  int session = -1;  // as stated by the user; -1: found by the trims
};

struct References {
  int flights = 0;
  std::vector<int> session_of;              // by flight, from 0
  std::vector<Eigen::VectorXd> ln_command;  // mean of each session, at `ln_voltage`
  std::vector<int> size;                    // flights of each session
  TrimScatter within, between;
  bool between_is_usual = false;          // one session: not learned
  std::optional<double> ln_voltage;       // of V, mean
  double slope = 0.0, slope_sigma = 0.0;  // of ln(command) by ln(voltage)

  int sessions() const { return static_cast<int>(ln_command.size()); }
};

// Throws InputError if flights differ in their channels.
void RequireSameChannels(const std::vector<ReferenceFlight>& flights);

// ln(command / mass) where all flights state their mass, else ln(command).
Eigen::VectorXd LnCommand(const CommandTrim& trim, bool by_mass);

// Flights without a stated session are of one where some chain of them differs by less than
// `kSessionGap` from flight to flight in every channel. The scatter is that of the flights, drawn
// to the usual one, which counts as much as `kUsualCounts` flights or sessions. The flights have
// the same channels.
References LearnFrom(const std::vector<ReferenceFlight>& flights, bool by_mass,
                     const UsualScatter& usual = {});

inline constexpr double kSessionGap = 0.025;
inline constexpr double kUsualCounts = 6.0;

}  // namespace trueline
