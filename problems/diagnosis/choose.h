// Selection among tested candidates, for both drives. The type Tested has a candidate, p (corrected
// for the candidates of the same id), Merit() and a ValueOf (its estimate).
#pragma once

#include <set>
#include <string>
#include <vector>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// True if the value is within the range of real vehicles and of a physical sign.
bool Plausible(const Candidate& candidate, const Eigen::VectorXd& value);

int DistinctIds(const std::vector<Candidate>& candidates);

// A report with names and units of the parameters; the caller fills in sizes.
CandidateReport NamedReport(const Candidate& candidate, double z, double p);

// The significant, plausible candidate of the greatest merit, or null.
template <class Tested>
const Tested* Best(const std::vector<Tested>& tested, double alpha) {
  const Tested* best = nullptr;
  for (const Tested& t : tested) {
    if (t.p >= alpha || !Plausible(t.candidate, ValueOf(t))) continue;
    if (best == nullptr || t.Merit() > best->Merit()) best = &t;
  }
  return best;
}

inline constexpr double kAsGood = 6.0;  // effects whose merits differ by less fit equally well

// Ids of the other effects that fit equally well.
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
