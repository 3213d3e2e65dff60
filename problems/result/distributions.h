// Probabilities of the distributions that tests need, by Boost.Math.
#pragma once

namespace trueline {

// P(X > x) of chi-square with `dof` degrees of freedom.
double ChiSquareTail(double x, double dof);

// P(X > x) of Fisher's F with (d1, d2) degrees of freedom.
double FTail(double x, double d1, double d2);

// P(|X| > x) of a normal X whose sigma is r >= 1 times s, where x = `times` s. r^2 was measured as
// `ratio` with `dof` degrees of freedom; before that, log r is half normal with scale `spread`. An
// infinite spread gives the tail of Student's t, but for r >= 1. With few degrees of freedom that
// tail is heavy, since it counts an r of any size as likely; the prior says which r occur.
double TailWithUncertainSigma(double times, double ratio, double dof, double spread);

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
