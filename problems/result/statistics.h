// Statistics of samples, and probabilities of the distributions that tests need.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

namespace trueline {

// Of the regions that are stated for predictions.
inline constexpr std::array kRegionLevels = {0.5, 0.9, 0.95};

// Linear interpolation between order statistics; NaN for no values. p in [0, 1].
double Quantile(std::vector<double> values, double p);
double Mean(const std::vector<double>& values);
double RootMeanSquare(const std::vector<double>& values);

// The value itself that is in the middle, the lower or upper one of an even number: stays
// meaningful where some are infinite. There must be a value.
double LowerMedian(std::vector<double> values);
double UpperMedian(std::vector<double> values);

// Standard deviation by the median of a normal distribution's absolute values (`sizes`), or of
// those from the median; 0 for no values.
double SigmaOfSizes(std::vector<double> sizes);
double SigmaByMedian(std::vector<double> values);

// Where the parabola through three values at -1, 0 and 1 is greatest, within those; 0 where the
// values have no peak.
double ParabolaVertex(double low, double middle, double high);

struct ErrorSummary {
  int count = 0;
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
};
ErrorSummary Summarise(const std::vector<double>& values);

// Intervals of a statistic over flights. The bootstrap resamples flights, because arcs of one
// flight share its biases and are not independent.
struct Interval {
  double low;
  double high;
};

// 95 % percentile interval of `statistic` over the pooled values of flights drawn with replacement
// (cluster bootstrap, fixed seed). `flights` holds the values of each flight. No value for fewer
// than two flights with values.
std::optional<Interval> BootstrapInterval(
    const std::vector<std::vector<double>>& flights,
    const std::function<double(const std::vector<double>&)>& statistic);

// P(X > x) of chi-square with `dof` degrees of freedom.
double ChiSquareTail(double x, double dof);

// P(X > x) of Fisher's F with (d1, d2) degrees of freedom.
double FTail(double x, double d1, double d2);

// A standard deviation that is r >= 1 times a stated one. r^2 was measured as `ratio` with `dof`
// degrees of freedom; before that, log r is half normal with scale `spread`. With few degrees of
// freedom Student's t counts an r of any size as likely; here the prior says which r occur.
class UncertainSigma {
 public:
  UncertainSigma(double ratio, double dof, double spread);

  // P(|X| > x) of a normal X with that sigma, for x = `times` the stated one. With an infinite
  // spread the tail of Student's t, but for r >= 1.
  double Tail(double times) const;
  // Root mean square of r.
  double Factor() const;

 private:
  std::vector<double> r_, weight_;  // weights sum to 1
};

// The value that chi-square with `dof` (F with d1, d2) exceeds with probability p.
double ChiSquareCritical(double p, double dof);
double FCritical(double p, double d1, double d2);

// Probability of `inside` or fewer hits out of `count` where each has probability p: small values
// say that intervals are too narrow.
double BinomialCdf(int inside, int count, double p);

// Non-centrality at which chi-square with `dof` exceeds `critical` with probability `power`
// (0.5 < power < 1; Abdel-Aty's cube-root approximation where dof is above 1, good to a few per
// cent).
double NonCentralityFor(double critical, double dof, double power);

}  // namespace trueline
