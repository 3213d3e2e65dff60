// What all sources together say of a cause: a sum of logarithms of likelihood ratios, of the cause
// against none. A ratio of densities of data that took no part in the fit has mean one where the
// effect is absent; a sum above log(N / alpha) is then seen with a chance below alpha for the best
// of N effects (Markov; Vovk and Wang 2021). Each estimate is predicted from what came before it,
// so that the ratios multiply (Dawid 1984).
#pragma once

#include <optional>

#include "problems/diagnosis/evidence.h"

namespace trueline {

struct Cause;  // diagnosis.h
struct CandidateReport;
struct Gains;

// The sizes that a vehicle may have: normal around the neutral ones, largest plausible at 3 sigma.
// Standard deviations in the units of the parameters.
Eigen::VectorXd PriorSizes(const EffectInfo& info);

// Covariances that an error which no hypothesis states may add to an estimate; each is as likely.
using UnstatedErrors = std::vector<Eigen::MatrixXd>;

// Those of the value of a cause, in units of its parameters. A flight whose misfit has the merit
// `unstated` shows such an error: it is like one of the other effects, `candidates` of the fit.
// None where `unstated` is zero. `own`: columns of the cause, and `beside` those of the model.
UnstatedErrors UnstatedErrorsOf(const Linearisation& fit, const Candidate& cause,
                                const EffectColumns& own, const std::vector<int>& beside,
                                const std::vector<Candidate>& candidates, double unstated);

// Of an error that is any one of them.
Eigen::VectorXd MeanSigma(const UnstatedErrors& errors, Eigen::Index size);

// Log of the ratio of two densities of an estimate that differs from none by `estimate`: around
// `expected` with `cov` and the spread `more` added, and around none with `cov`. Student's t with
// `dof` degrees of freedom, normal where they are infinite.
double LogRatio(const Eigen::VectorXd& estimate, const Eigen::MatrixXd& cov,
                const Eigen::VectorXd& expected, const Eigen::MatrixXd& more, double dof,
                const UnstatedErrors& errors = {});

// What the flight that was fitted says of an effect, whose whole value `test` judges: the lesser of
// the ratio by the noise model and of that by the scatter between clusters. It is bounded: an error
// that no hypothesis states may imitate the effect, so that no ratio of two models is trusted
// beyond 1e5, and sources that do not share the model can outweigh it. Ratios are averaged over
// priors of several widths. `prior`: the widest, PriorSizes in the units of the test.
double FlightEvidenceOf(const ScoreTest& test, const Eigen::VectorXd& prior,
                        const UnstatedErrors& errors = {});

// That it is one of as many effects, gates, rotors and times as were tried.
double PriorEvidenceOf(const std::string& id, const std::vector<CandidateReport>& tried);

// What held-out flight says against a cause, by arcs and by replays: the log of the ratio of the
// densities of their mean gains, under the gain of none and under the loss that was measured. A
// gain adds nothing: the flight's own evidence has it.
double HeldOutEvidence(const Gains& gains);

// The e-value that a chance of its own admits: half the inverse of its root (Vovk and Wang 2021).
double EvidenceOfChance(double p);

// What an independent estimate of the cause's size (by a witness, by another flight) says, given
// the size that the flight shows. Such estimates err by more than they state now and then, so its
// density has heavy tails. `same_model`: the estimate shares the model, and so the errors that no
// hypothesis states.
double IndependentEvidence(const Cause& cause, const Eigen::VectorXd& value,
                           const Eigen::VectorXd& sigma, bool same_model);

// What a witness says of an effect whatever the flight says. Minus infinite where it is silent,
// used what the flight used, or shows a size that no vehicle has.
double WitnessAlone(const Cause& cause);

// A candidate as a cause, with what the flight says of it.
Cause CauseOf(const Tested& tested);

// Stores what the witness and the further flights say.
void AddIndependentEvidence(Cause* cause);

// That the size has changed between the further flights and this one: of the difference, in which
// an error of the model that they share cancels. Empty where none can tell.
std::optional<double> ChangeEvidence(const Cause& cause);

}  // namespace trueline
