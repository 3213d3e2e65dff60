// Probabilities of the distributions that tests need, by Boost.Math.
#pragma once

#include <vector>

namespace trueline {

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
