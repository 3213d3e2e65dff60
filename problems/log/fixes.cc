#include "problems/log/fixes.h"

#include <utility>

#include "problems/result/statistics.h"

namespace trueline {

double MedianSigma(const std::vector<Fix>& fixes) {
  std::vector<double> sigmas;
  for (const Fix& fix : fixes) sigmas.push_back(fix.sigma);
  return Quantile(std::move(sigmas), 0.5);
}

}  // namespace trueline
