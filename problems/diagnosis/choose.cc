#include "problems/diagnosis/choose.h"

#include <cmath>

namespace trueline {

bool Plausible(const Candidate& candidate, const Eigen::VectorXd& value) {
  for (int i = 0; i < value.size(); ++i) {
    const EffectParameterInfo& info = candidate.info->parameters[i];
    if (std::abs(value[i]) >= info.plausible) return false;
    if (!info.either_sign && value[i] < 0.0) return false;
  }
  return true;
}

int DistinctIds(const std::vector<Candidate>& candidates) {
  std::set<std::string> ids;
  for (const Candidate& c : candidates) ids.insert(c.info->id);
  return static_cast<int>(ids.size());
}

CandidateReport NamedReport(const Candidate& candidate, double z, double p) {
  CandidateReport report{candidate.info->id, candidate.Label(), z, p, {}, {}, {}, {}, {}};
  for (const EffectParameterInfo& info : candidate.info->parameters) {
    report.parameters.push_back(info.name);
    report.units.push_back(info.unit);
  }
  return report;
}

}  // namespace trueline
