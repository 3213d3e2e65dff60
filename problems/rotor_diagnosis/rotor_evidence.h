// What a linearised fit says of candidates and of the library's terms: each by itself, and effects
// two at a time.
#pragma once

#include <string>
#include <vector>

#include "problems/diagnosis/score_test.h"
#include "problems/rotor_diagnosis/rotor_columns.h"

namespace trueline {

struct RotorTested {
  Candidate candidate;
  Eigen::VectorXd value;  // estimate by one step from where the fit stands
  ScoreTest test;         // in units of each parameter's step
  double gain = 0.0;      // twice the increase of the log likelihood
  double p = 1.0;         // corrected for the candidates of the same id
  int tried = 1;          // of them

  // Gain less what as many parameters of no meaning would give (Akaike).
  double Merit() const { return gain - 2.0 * static_cast<double>(value.size()); }
  bool IsOf(const std::string& id) const { return candidate.info->id == id; }
};

inline const Eigen::VectorXd& ValueOf(const RotorTested& t) { return t.value; }

// Two effects at once, each as it stands beside the other.
struct RotorPair {
  RotorTested first, second;
  double merit;  // of both together

  bool Has(const std::string& id) const { return first.IsOf(id) || second.IsOf(id); }
};

// A term of the library, or an effect of an impossible size: what the residual goes with.
struct RotorDescribed {
  std::string name;
  double p;      // after the correction for the number of terms, or of effects
  double merit;  // as RotorTested::Merit
  bool of_sensor;
  std::vector<int> columns;  // of RotorEvidence::normal, from 0; none for an effect

  // Explains clearly more than what has `merit`.
  bool Stands(double alpha, double than) const {
    constexpr double kClearlyBetter = 10.0;
    return p < alpha && merit > than + kClearlyBetter;
  }
};

class RotorEvidence {
 public:
  // `normal` holds the columns of `own` parameters of causes that are in the model, those of the
  // candidates, then those of `library`, which may be null. Where a sensor's readings explain
  // clearly more than any effect, effects are judged beside them.
  RotorEvidence(RotorNormal normal, int own, const std::vector<Candidate>& candidates,
                const RotorLibrary* library);

  const RotorNormal& normal() const { return normal_; }
  const std::vector<RotorTested>& tested() const { return tested_; }
  const std::vector<RotorDescribed>& described() const { return described_; }
  // Effects that explain more than `merit` together and of which each stands out (p < alpha) beside
  // the other. Of an effect that has a time, the best one.
  std::vector<RotorPair> Pairs(double alpha, double merit) const;

 private:
  RotorTested TestOne(std::size_t which, const std::vector<int>& beside) const;
  void TestEach();
  void Describe(const RotorLibrary& library, bool of_sensor, int first, double merit);
  void DescribeImplausible();
  std::vector<int> Columns(std::size_t which) const;

  RotorNormal normal_;
  std::vector<Candidate> candidates_;
  std::vector<int> first_;   // column of each candidate
  std::vector<int> beside_;  // columns that are no candidate's
  std::vector<RotorTested> tested_;
  std::vector<RotorDescribed> described_;
};

// Where in `tested` the best of each effect stands, and of each rotor's loss.
std::vector<std::size_t> BestOfEach(const std::vector<RotorTested>& tested);

// The last columns of `normal`, as many as there are `ordinary` sizes, against all before them.
ScoreTest TestLast(const RotorNormal& normal, const Eigen::VectorXd& ordinary);

// Parameter sizes at which one step of a column ends up: `steps` in units of its step.
Eigen::VectorXd SizesFromSteps(const EffectInfo& info, const Eigen::VectorXd& steps);

}  // namespace trueline
