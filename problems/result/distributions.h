// Probabilities of the distributions that tests need, by Boost.Math.
#pragma once

namespace trueline {

// P(X > x) of chi-square with `dof` degrees of freedom.
double ChiSquareTail(double x, double dof);

// P(X > x) of Fisher's F with (d1, d2) degrees of freedom.
double FTail(double x, double d1, double d2);

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
