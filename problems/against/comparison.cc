#include "problems/against/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kSecondRotor = 0.05;  // chance of naming one more rotor than are weak
constexpr double kMisfit = 0.001;      // below: the trim has changed, whatever the cause
constexpr double kAlike = 3.0;         // of the score: fits as well
// Air speed and turns load the rotors unequally: sigma of ln(command) for each unit of
// CommandTrim::tilt, which grows with both.
constexpr double kByTilt = 0.3;

struct Pattern {
  std::string id;
  std::vector<int> channels;
  Eigen::MatrixXd columns;  // of ln(command)
};

std::vector<Pattern> PatternsOf(int channels) {
  const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(channels, channels);
  std::vector<Pattern> patterns = {{"thrust_scale", {}, Eigen::VectorXd::Ones(channels)}};
  if (channels == 1) return patterns;
  for (int i = 0; i < channels; ++i) {
    patterns.push_back({"rotor_loss", {i}, unit.col(i)});
    for (int j = i + 1; j < channels; ++j) {
      patterns.push_back({"rotor_loss", {i, j}, unit(Eigen::all, {i, j})});
    }
  }
  return patterns;
}

double AllDof(const TrimForecast& forecast) {
  return forecast.dof + static_cast<double>(forecast.mean.size());
}

// Chance that the forecast leaves as much as `chi2` in `count` directions.
double MisfitP(double chi2, double count, double dof) {
  return count > 0.0 ? FTail(chi2 / count, count, dof) : 1.0;
}

// Chance that `added` sizes, which chance alone fits, add as much evidence as `gain`. `all` is the
// number of degrees of freedom of the forecast and its channels, `left` what all sizes leave of it.
double ChanceOf(double gain, double added, double left, double all) {
  return FTail(std::expm1(2.0 * gain / all) * left / added, added, left);
}

// The F of `sizes` that names one of the causes tried.
double FNeeded(double alpha, std::size_t tried, double sizes, double all) {
  return FCritical(alpha / static_cast<double>(tried), sizes, all - sizes);
}

// The generalised least squares of the deviation by the pattern. A rotor is weaker or it is none.
TriedCause Try(const Pattern& pattern, const Eigen::VectorXd& deviation,
               const TrimForecast& forecast, const Eigen::MatrixXd& within, int tried) {
  const Eigen::MatrixXd information = forecast.cov.inverse();
  const auto fit_cov = [&](const Eigen::MatrixXd& of) -> Eigen::MatrixXd {
    return (pattern.columns.transpose() * of.inverse() * pattern.columns).inverse();
  };
  TriedCause cause;
  cause.id = pattern.id;
  cause.channels = pattern.channels;
  const Eigen::MatrixXd size_cov = fit_cov(forecast.cov);
  cause.size = size_cov * pattern.columns.transpose() * information * deviation;
  cause.sigma = size_cov.diagonal().cwiseSqrt();
  cause.sigma_flight = fit_cov(within).diagonal().cwiseSqrt();
  const bool is_loss = cause.id == "thrust_scale" || cause.size.minCoeff() > 0.0;
  if (!is_loss) cause.size.setZero();
  const Eigen::VectorXd left = deviation - pattern.columns * cause.size;
  const double chi2 = deviation.dot(information * deviation);
  const double chi2_left = left.dot(information * left);
  const auto sizes = static_cast<double>(cause.size.size());
  const double all = AllDof(forecast);
  cause.evidence = 0.5 * all * std::log((forecast.dof + chi2) / (forecast.dof + chi2_left));
  cause.p = std::min(1.0, tried * ChanceOf(cause.evidence, sizes, all - sizes, all));
  cause.misfit_p = MisfitP(chi2_left, static_cast<double>(deviation.size()) - sizes, forecast.dof);
  if (cause.size.size() == 2 && cause.size[1] > cause.size[0]) {
    std::swap(cause.channels[0], cause.channels[1]);
    for (Eigen::VectorXd* of : {&cause.size, &cause.sigma, &cause.sigma_flight})
      of->reverseInPlace();
  }
  return cause;
}

bool IsPartOf(const TriedCause& part, const TriedCause& whole) {
  return part.id == whole.id && std::ranges::all_of(part.channels, [&](int k) {
           return std::ranges::count(whole.channels, k) > 0;
         });
}

// The first cause, if it is proven. Of two rotors, the second one is left out where the first alone
// is proven and the second is not.
std::optional<TriedCause> NamedOf(const TrimForecast& forecast, double alpha,
                                  const std::vector<TriedCause>& tried) {
  const TriedCause& best = tried.front();
  if (best.p >= alpha) return std::nullopt;
  if (best.channels.size() != 2) return best;
  const auto single = std::ranges::find_if(tried, [&](const TriedCause& cause) {
    return cause.channels.size() == 1 && IsPartOf(cause, best);
  });
  if (single == tried.end() || single->p >= alpha) return best;
  const double all = AllDof(forecast);
  const double further_rotors = static_cast<double>(forecast.mean.size()) - 1.0;
  const double chance = ChanceOf(best.evidence - single->evidence, 1.0, all - 2.0, all);
  return further_rotors * chance < kSecondRotor ? best : *single;
}

Findings Search(const Eigen::VectorXd& ln_command, const TrimForecast& forecast,
                const Eigen::MatrixXd& within, double alpha) {
  const Eigen::VectorXd deviation = ln_command - forecast.mean;
  const std::vector<Pattern> patterns = PatternsOf(static_cast<int>(deviation.size()));
  Findings findings;
  findings.misfit_p = MisfitP(deviation.dot(forecast.cov.inverse() * deviation),
                              static_cast<double>(deviation.size()), forecast.dof);
  for (const Pattern& pattern : patterns) {
    findings.tried.push_back(
        Try(pattern, deviation, forecast, within, static_cast<int>(patterns.size())));
  }
  std::vector<TriedCause>& tried = findings.tried;
  std::ranges::stable_sort(tried, std::greater(), &TriedCause::Score);
  findings.named = NamedOf(forecast, alpha, tried);
  const TriedCause& best = tried.front();
  for (const TriedCause& other : tried) {
    const bool nested = IsPartOf(other, best) || IsPartOf(best, other);
    if (!nested && other.Score() > best.Score() - kAlike) findings.alike.push_back(other);
  }
  return findings;
}

// The session whose trim is nearest to the flight's.
std::size_t NearestSession(const References& references, const Eigen::VectorXd& ln_command) {
  const auto distance = [&](const Eigen::VectorXd& session) {
    return (session - ln_command).squaredNorm();
  };
  return static_cast<std::size_t>(std::ranges::min_element(references.ln_command, {}, distance) -
                                  references.ln_command.begin());
}

TrimForecast ForecastOf(const References& references, const CommandTrim& flight,
                        double greatest_tilt, const Eigen::VectorXd& ln_command,
                        SessionOfFlight session) {
  const int channels = flight.channels();
  const Eigen::MatrixXd within = references.within.Cov(channels);
  TrimForecast forecast;
  if (session == SessionOfFlight::kSame) {
    const std::size_t nearest = NearestSession(references, ln_command);
    forecast.mean = references.ln_command[nearest];
    forecast.cov = (1.0 + 1.0 / references.size[nearest]) * within;
    forecast.dof = references.within.dof;
  } else {
    const auto sessions = static_cast<double>(references.sessions());
    forecast.mean = Eigen::VectorXd::Zero(channels);
    for (const Eigen::VectorXd& mean : references.ln_command) forecast.mean += mean / sessions;
    forecast.cov = (1.0 + 1.0 / sessions) * references.between.Cov(channels) +
                   (1.0 + 1.0 / references.flights) * within;
    forecast.dof = references.between.dof;
  }
  const double of_speed = kByTilt * greatest_tilt;
  forecast.cov.diagonal() += flight.sigma.cwiseAbs2();
  forecast.cov.diagonal().array() += of_speed * of_speed;
  if (references.ln_voltage && flight.voltage) {
    const double ln_volts = std::log(*flight.voltage) - *references.ln_voltage;
    const double sigma = references.slope_sigma * ln_volts;
    forecast.mean.array() += references.slope * ln_volts;
    forecast.cov.array() += sigma * sigma;
  }
  return forecast;
}

std::string VerdictOf(const Findings& findings) {
  const double left = findings.named ? findings.named->misfit_p : findings.misfit_p;
  if (left < kMisfit) return "unexplained";
  return findings.named ? "ambiguous" : "clean";
}

}  // namespace

double Comparison::SigmasNeeded() const {
  return std::sqrt(FNeeded(alpha, findings.tried.size(), 1.0, AllDof(forecast)));
}

double Comparison::EvidenceNeeded() const {
  const double all = AllDof(forecast);
  const auto sizes = static_cast<double>(findings.tried.front().size.size());
  return 0.5 * all *
         std::log1p(sizes / (all - sizes) * FNeeded(alpha, findings.tried.size(), sizes, all));
}

AlikeLoad Comparison::LoadOf(const TriedCause& cause) const {
  const Eigen::ArrayXd usual = forecast.mean.array().exp();
  AlikeLoad load;
  if (cause.channels.empty()) {
    return {std::expm1(cause.size[0]), std::exp(cause.size[0]) * cause.sigma[0]};
  }
  double variance = 0.0;
  for (std::size_t i = 0; i < cause.channels.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double part = usual[cause.channels[i]] / usual.sum();
    load.share += part * std::expm1(cause.size[k]);
    variance += std::pow(part * std::exp(cause.size[k]) * cause.sigma[k], 2);
  }
  load.sigma = std::sqrt(variance);
  return load;
}

Comparison Compare(const CommandTrim& flight, const std::vector<ReferenceFlight>& references,
                   SessionOfFlight session, const ComparisonRules& rules) {
  Comparison comparison;
  comparison.flight = flight;
  comparison.session = session;
  comparison.alpha = rules.alpha;
  for (const ReferenceFlight& other : references) comparison.others.push_back(other.trim);
  std::vector<ReferenceFlight> all = references;
  all.push_back({flight, -1});
  RequireSameChannels(all);
  for (const ReferenceFlight& one : all) {
    comparison.warnings.insert(comparison.warnings.end(), one.trim.warnings.begin(),
                               one.trim.warnings.end());
  }
  comparison.by_mass = std::ranges::all_of(
      all, [](const ReferenceFlight& one) { return one.trim.mass.has_value(); });
  comparison.references = LearnFrom(references, comparison.by_mass, rules.usual);
  comparison.ln_command = LnCommand(flight, comparison.by_mass);
  const Eigen::MatrixXd within = comparison.references.within.Cov(flight.channels());
  double tilt = 0.0;
  for (const ReferenceFlight& one : all) tilt = std::max(tilt, one.trim.tilt);
  const auto search = [&](SessionOfFlight of, TrimForecast* forecast) {
    *forecast = ForecastOf(comparison.references, flight, tilt, comparison.ln_command, of);
    return Search(comparison.ln_command, *forecast, within, rules.alpha);
  };
  TrimForecast same;
  comparison.findings = search(session, &comparison.forecast);
  comparison.if_same_session = search(SessionOfFlight::kSame, &same);
  comparison.verdict = VerdictOf(comparison.findings);
  return comparison;
}

}  // namespace trueline
