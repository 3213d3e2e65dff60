// Evidence of a linearised fit for candidates and for the library's terms: each singly, and effects
// in pairs.
#pragma once

#include <string>
#include <vector>

#include "problems/diagnosis/score_test.h"
#include "problems/rotor_diagnosis/rotor_columns.h"

namespace trueline {

struct RotorTested {
  Candidate candidate;
  Eigen::VectorXd value;  // estimate by one Gauss-Newton step from the fit
  ScoreTest test;         // in units of each parameter's step
  double gain = 0.0;      // twice the increase of the log likelihood
  double p = 1.0;         // corrected for the candidates of the same id
  int tried = 1;          // of them

  // Gain less that of the same number of spurious parameters (Akaike).
  double Merit() const { return gain - 2.0 * static_cast<double>(value.size()); }
  bool IsOf(const std::string& id) const { return candidate.info->id == id; }
};

inline const Eigen::VectorXd& ValueOf(const RotorTested& t) { return t.value; }

// Two effects tested together, each given the other.
struct RotorPair {
  RotorTested first, second;
  double merit;  // of both together

  bool Has(const std::string& id) const { return first.IsOf(id) || second.IsOf(id); }
};

// A term of the library, or an effect of an impossible size, that the residual is correlated with.
struct RotorDescribed {
  std::string name;
  double p;      // after the correction for the number of terms, or of effects
  double merit;  // as RotorTested::Merit
  bool of_sensor;
  std::vector<int> columns;  // of RotorEvidence::normal, from 0; none for an effect

  // True if significant and of a merit clearly greater than `than`.
  bool Stands(double alpha, double than) const {
    constexpr double kClearlyBetter = 10.0;
    return p < alpha && merit > than + kClearlyBetter;
  }
};

class RotorEvidence {
 public:
  // `normal` holds, in this order, the columns of `own` parameters of causes in the model, of the
  // candidates, and of `library` (may be null). Where errors of a sensor's readings explain clearly
  // more than any effect, effects are tested given those errors.
  RotorEvidence(RotorNormal normal, int own, const std::vector<Candidate>& candidates,
                const RotorLibrary* library);

  const RotorNormal& normal() const { return normal_; }
  const std::vector<RotorTested>& tested() const { return tested_; }
  const std::vector<RotorDescribed>& described() const { return described_; }
  // Pairs of effects whose joint merit exceeds `merit` and of which each is significant (p < alpha)
  // given the other. Of a step effect only the best time takes part.
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
  std::vector<int> beside_;  // nuisance columns in each test
  std::vector<RotorTested> tested_;
  std::vector<RotorDescribed> described_;
};

// Indices in `tested` of the best candidate of each effect; rotor_loss counts rotor by rotor.
std::vector<std::size_t> BestOfEach(const std::vector<RotorTested>& tested);

// Tests the last columns of `normal`, one for each entry of `ordinary` (usual sizes); all columns
// before them are nuisances.
ScoreTest TestLast(const RotorNormal& normal, const Eigen::VectorXd& ordinary);

// Converts steps of columns, in units of each parameter's step, to parameter values.
Eigen::VectorXd SizesFromSteps(const EffectInfo& info, const Eigen::VectorXd& steps);

}  // namespace trueline
