// What a window's data say about each parameter, beyond the prior.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace trueline {

struct Identifiability {
  std::vector<std::string> status;        // by parameter: identified | weak | unobservable
  std::vector<std::string> combinations;  // what is not shown, in words with numbers
};

// cov: covariance of the parameters in units of their prior sigma, which prior_sigma takes back to
// physical ones. The data's own information is what the
// posterior has over the prior. A parameter whose sigma fell
//   to half the prior's or less is identified, to 90 % or less weak, else unobservable.
// Directions (eigenvectors of the data's information) in which the data know less than the prior
// are named as combinations.
Identifiability AnalyseIdentifiability(const std::vector<std::string>& names,
                                       const std::vector<std::string>& units,
                                       const Eigen::VectorXd& prior_sigma,
                                       const Eigen::MatrixXd& cov);

}  // namespace trueline
