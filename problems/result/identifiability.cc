#include "problems/result/identifiability.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

constexpr double kIdentified = 0.5;  // posterior over prior sigma
constexpr double kWeak = 0.9;
// The data do not show a direction along which the posterior sigma is above 90 % of the prior's.
constexpr double kOpenInformation = 1.0 / (kWeak * kWeak) - 1.0;
constexpr double kHeldSigmas = 3.0;  // of the own prior, without the priors of others
constexpr double kNamedShare = 0.3;  // smallest component of a direction that is named

// "psi_E_Ep by +0.0371 rad with psi_I_B by -0.0370 rad", the largest component first.
std::string Describe(const Eigen::VectorXd& direction, const std::vector<std::string>& names,
                     const std::vector<std::string>& units, const Eigen::VectorXd& prior_sigma) {
  std::vector<int> order;
  for (int i = 0; i < direction.size(); ++i) {
    if (std::abs(direction[i]) > kNamedShare) order.push_back(i);
  }
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  std::vector<std::string> words;
  for (const int i : order) {
    words.push_back(
        fmt::format("{} by {:+.3g} {}", names[i], direction[i] * prior_sigma[i], units[i]));
  }
  return fmt::format("{}", fmt::join(words, " with "));
}

// A parameter whose sigma is small only because the priors of others hold a combination is not
// identified. Without these priors, this direction alone would leave it several sigmas of its own
// prior.
void DowngradeHeldByPriors(const Eigen::VectorXd& direction, double information,
                           std::vector<std::string>* status) {
  for (int i = 0; i < direction.size(); ++i) {
    const bool held = direction[i] * direction[i] > kHeldSigmas * kHeldSigmas * information;
    if (std::abs(direction[i]) > kNamedShare && held && (*status)[i] == "identified") {
      (*status)[i] = "weak";
    }
  }
}

}  // namespace

std::string StatusByRatio(double ratio) {
  if (ratio <= kIdentified) return "identified";
  return ratio <= kWeak ? "weak" : "unobservable";
}

Identifiability AnalyseIdentifiability(const std::vector<std::string>& names,
                                       const std::vector<std::string>& units,
                                       const Eigen::VectorXd& prior_sigma,
                                       const Eigen::MatrixXd& cov) {
  Identifiability result;
  for (int i = 0; i < cov.rows(); ++i) {
    result.status.push_back(StatusByRatio(std::sqrt(cov(i, i))));
  }
  // The prior is the identity in these units, so the data's information is inv(cov) - I.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(cov);
  for (int i = static_cast<int>(cov.rows()) - 1; i >= 0; --i) {
    const double information = 1.0 / std::max(eigen.eigenvalues()[i], 1e-300) - 1.0;
    if (information > kOpenInformation) break;  // eigenvalues fall from here on
    const Eigen::VectorXd direction = eigen.eigenvectors().col(i);
    result.combinations.push_back(Describe(direction, names, units, prior_sigma));
    DowngradeHeldByPriors(direction, information, &result.status);
  }
  return result;
}

}  // namespace trueline
