// Which of the tested candidates is taken, for both kinds of drive. A "tested" has a candidate, p
// (corrected for the candidates of the same id), Merit() and a ValueOf (its estimate).
#pragma once

#include <set>
#include <string>
#include <vector>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// Value within what a real vehicle has, of a sign that physics allows.
bool Plausible(const Candidate& candidate, const Eigen::VectorXd& value);

int DistinctIds(const std::vector<Candidate>& candidates);

// With names and units of the parameters; sizes are left to the caller.
CandidateReport NamedReport(const Candidate& candidate, double z, double p);

// The best of those that stand out, or none.
template <class Tested>
const Tested* Best(const std::vector<Tested>& tested, double alpha) {
  const Tested* best = nullptr;
  for (const Tested& t : tested) {
    if (t.p >= alpha || !Plausible(t.candidate, ValueOf(t))) continue;
    if (best == nullptr || t.Merit() > best->Merit()) best = &t;
  }
  return best;
}

inline constexpr double kAsGood = 6.0;  // of merit: within this, two effects fit alike

// Ids of the others that fit alike.
template <class Tested>
std::vector<std::string> ConfusedWith(const std::vector<Tested>& tested, const Tested& best) {
  std::set<std::string> ids;
  for (const Tested& t : tested) {
    const bool as_good = t.Merit() > best.Merit() - kAsGood && Plausible(t.candidate, ValueOf(t));
    if (as_good && t.candidate.info->id != best.candidate.info->id) {
      ids.insert(t.candidate.info->id);
    }
  }
  return {ids.begin(), ids.end()};
}

}  // namespace trueline
