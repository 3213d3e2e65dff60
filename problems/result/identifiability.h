// Information of a window's data on each parameter, beyond the prior.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace trueline {

struct Identifiability {
  std::vector<std::string> status;        // by parameter: identified | weak | unobservable
  std::vector<std::string> combinations;  // unobservable ones, in words with numbers
};

// "identified", "weak" or "unobservable", by the ratio of posterior to prior sigma.
std::string StatusByRatio(double ratio);

// cov: covariance of the parameters in units of their prior sigma; prior_sigma converts to physical
// units. The data's information is the posterior's less the prior's. Status by the ratio of
// posterior to prior sigma: at most half is identified, at most 90 % is weak, else unobservable.
// Eigenvectors along which the posterior's sigma is above 90 % of the prior's are named as
// combinations. A parameter that is named in one is weak at best if, without the priors of the
// others, that direction alone would leave it three sigmas of its own prior.
Identifiability AnalyseIdentifiability(const std::vector<std::string>& names,
                                       const std::vector<std::string>& units,
                                       const Eigen::VectorXd& prior_sigma,
                                       const Eigen::MatrixXd& cov);

}  // namespace trueline
