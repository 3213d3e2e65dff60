#include "problems/against/references.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

// ln(command) by ln(voltage): 0.05 +- 0.07 and 0.49 +- 0.09 on two vehicles (CrazyPAD) whose
// firmware compensates for the battery. Without it a thrust goes with the square of the voltage:
// -2.
constexpr double kUsualSlope = 0.2, kUsualSlopeSigma = 0.8;

// Sums of squares of deviations, split into the mean of the channels and what is left of each.
struct Squares {
  double common = 0.0, own = 0.0;
  int dof = 0;  // of `common`; `own` has one less than channels times as many

  void Add(const Eigen::VectorXd& deviation) {
    common += deviation.mean() * deviation.mean();
    own += (deviation.array() - deviation.mean()).square().sum();
  }
};

// One channel is the total thrust: the mean of at least so many rotors.
constexpr double kRotorsOfOneChannel = 4.0;

TrimScatter Drawn(const TrimScatter& usual, const Squares& found, int channels) {
  const double n = channels;
  const double weight = kUsualCounts + found.dof;
  const double own = channels < 2
                         ? 0.0  // one channel has no own part
                         : (kUsualCounts * usual.own * usual.own + found.own / (n - 1.0)) / weight;
  const double rotors = channels < 2 ? kRotorsOfOneChannel : n;
  const double usual_mean = usual.common * usual.common + usual.own * usual.own / rotors;
  const double mean = (kUsualCounts * usual_mean + found.common) / weight;
  return {std::sqrt(std::max(0.0, mean - own / n)), std::sqrt(own),
          weight * std::max(1.0, n - 1.0)};
}

bool AreOfOneSession(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return (a - b).cwiseAbs().maxCoeff() < kSessionGap;
}

// Numbers sessions from 0; those without a stated one by chains of like trims.
std::vector<int> SessionsOf(const std::vector<ReferenceFlight>& flights,
                            const std::vector<Eigen::VectorXd>& ln_command) {
  std::vector<int> label(flights.size());
  for (std::size_t i = 0; i < flights.size(); ++i) {
    label[i] = static_cast<int>(i);
    for (std::size_t j = 0; j < i; ++j) {
      const bool same = flights[i].session >= 0 || flights[j].session >= 0
                            ? flights[i].session == flights[j].session
                            : AreOfOneSession(ln_command[i], ln_command[j]);
      if (same) std::replace(label.begin(), label.end(), label[i], label[j]);
    }
  }
  std::vector<int> names = label;
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  for (int& l : label) {
    l = static_cast<int>(std::lower_bound(names.begin(), names.end(), l) - names.begin());
  }
  return label;
}

std::vector<Eigen::VectorXd> MeansOf(const std::vector<Eigen::VectorXd>& values,
                                     const std::vector<int>& session_of) {
  const auto sessions = static_cast<std::size_t>(*std::ranges::max_element(session_of)) + 1;
  std::vector<Eigen::VectorXd> means(sessions, Eigen::VectorXd::Zero(values.front().size()));
  std::vector<double> count(sessions, 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto s = static_cast<std::size_t>(session_of[i]);
    means[s] += values[i];
    count[s] += 1.0;
  }
  for (std::size_t s = 0; s < sessions; ++s) means[s] /= count[s];
  return means;
}

// Slope of ln(command) by ln(voltage) within the sessions, drawn to the usual one. `noise` is the
// standard deviation of ln(command). Flights that state no voltage have the mean one.
void LearnSlope(const std::vector<double>& ln_volts, const std::vector<Eigen::VectorXd>& values,
                double noise, References* learned) {
  std::vector<Eigen::VectorXd> pairs;  // voltage, mean of ln(command)
  for (std::size_t i = 0; i < ln_volts.size(); ++i) {
    pairs.push_back(Eigen::Vector2d(ln_volts[i], values[i].mean()));
  }
  const std::vector<Eigen::VectorXd> means = MeansOf(pairs, learned->session_of);
  double information = 1.0 / (kUsualSlopeSigma * kUsualSlopeSigma);
  double sum = kUsualSlope * information;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::VectorXd d = pairs[i] - means[static_cast<std::size_t>(learned->session_of[i])];
    information += d[0] * d[0] / (noise * noise);
    sum += d[0] * d[1] / (noise * noise);
  }
  learned->slope = sum / information;
  learned->slope_sigma = 1.0 / std::sqrt(information);
}

// Their ln(voltage), the mean one for flights that state none; empty where no flight does, or the
// battery does not drive the commands.
std::vector<double> LnVoltsOf(const std::vector<ReferenceFlight>& flights) {
  std::vector<double> known;
  for (const ReferenceFlight& flight : flights) {
    if (flight.trim.voltage && !flight.trim.is_speed)
      known.push_back(std::log(*flight.trim.voltage));
  }
  if (known.empty()) return {};
  std::vector<double> ln_volts;
  for (const ReferenceFlight& flight : flights) {
    const std::optional<double>& volts = flight.trim.voltage;
    ln_volts.push_back(volts ? std::log(*volts) : Mean(known));
  }
  return ln_volts;
}

}  // namespace

void RequireSameChannels(const std::vector<ReferenceFlight>& flights) {
  const CommandTrim& first = flights.front().trim;
  for (const ReferenceFlight& flight : flights) {
    const CommandTrim& trim = flight.trim;
    if (trim.channels() == first.channels() && trim.is_speed == first.is_speed) continue;
    throw ErrorAt(
        trim.log, 0,
        fmt::format("has {} {}, where {} has {} {}; give flights of one kind of log",
                    trim.channels(), trim.is_speed ? "rotor speeds" : "commands", first.log,
                    first.channels(), first.is_speed ? "rotor speeds" : "commands"));
  }
}

Eigen::MatrixXd TrimScatter::Cov(int channels) const {
  return common * common * Eigen::MatrixXd::Ones(channels, channels) +
         own * own * Eigen::MatrixXd::Identity(channels, channels);
}

double TrimScatter::OfOneChannel() const { return std::hypot(common, own); }

Eigen::VectorXd LnCommand(const CommandTrim& trim, bool by_mass) {
  return trim.command.array().log() - (by_mass ? std::log(*trim.mass) : 0.0);
}

References LearnFrom(const std::vector<ReferenceFlight>& flights, bool by_mass,
                     const UsualScatter& usual) {
  References learned;
  learned.flights = static_cast<int>(flights.size());
  std::vector<Eigen::VectorXd> values;
  for (const ReferenceFlight& flight : flights) values.push_back(LnCommand(flight.trim, by_mass));
  const std::vector<double> ln_volts = LnVoltsOf(flights);
  learned.session_of = SessionsOf(flights, values);
  if (!ln_volts.empty()) {
    LearnSlope(ln_volts, values, usual.within.OfOneChannel(), &learned);
    learned.ln_voltage = Mean(ln_volts);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i].array() -= learned.slope * (ln_volts[i] - *learned.ln_voltage);
    }
  }
  learned.ln_command = MeansOf(values, learned.session_of);
  const int channels = flights.front().trim.channels();
  learned.size.assign(learned.ln_command.size(), 0);
  Squares within, between;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto s = static_cast<std::size_t>(learned.session_of[i]);
    within.Add(values[i] - learned.ln_command[s]);
    ++learned.size[s];
  }
  within.dof = learned.flights - learned.sessions();
  const std::vector<int> one(learned.ln_command.size(), 0);
  const Eigen::VectorXd mean = MeansOf(learned.ln_command, one).front();
  for (const Eigen::VectorXd& session : learned.ln_command) between.Add(session - mean);
  between.dof = learned.sessions() - 1;
  learned.within = Drawn(usual.within, within, channels);
  learned.between = Drawn(usual.between, between, channels);
  learned.between_is_usual = learned.sessions() == 1;
  return learned;
}

}  // namespace trueline
