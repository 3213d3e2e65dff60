#include "problems/diagnosis/verdict.h"

#include <fmt/format.h>

#include <algorithm>

namespace trueline {

std::vector<std::string> ExtraordinaryNoise(const NoiseStrengths& noise) {
  std::vector<std::string> findings;
  const auto note = [&](double value, double usual, const std::string& what) {
    if (value > usual) findings.push_back(fmt::format(fmt::runtime(what), value));
  };
  note(noise.process.gust, 0.35, "unmodelled forces of {:.2f} m/s^2 that are correlated in time");
  note(noise.process.acceleration, 0.25, "unmodelled white accelerations of {:.2f} m/s^2/sqrt(Hz)");
  note(noise.process.tilt / kDegree, 2.0, "a tilt of the attitude that drifts by {:.1f} deg");
  // A compass error drifts slowly; a heading error that changes within seconds follows the turns.
  const bool quick = noise.process.memory < 10.0;
  note(noise.process.heading / kDegree, quick ? 2.5 : 6.0, "a heading that drifts by {:.1f} deg");
  note(noise.fix_scale, 2.0, "fixes that scatter {:.1f} times as much as the detector states");
  return findings;
}

std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by) {
  const auto claimed = [](const Cause& c) { return c.confirmed.value_or(true); };
  if (std::none_of(causes.begin(), causes.end(), claimed)) {
    const bool clean = causes.empty() && set_aside.empty() && unexplained_by.empty();
    return clean ? "clean" : "unexplained";
  }
  // A significant misfit remains, so the causes explain only a part of it.
  if (!unexplained_by.empty()) return "unexplained";
  const bool ambiguous = std::any_of(causes.begin(), causes.end(), [&](const Cause& c) {
    return claimed(c) && !c.confused_with.empty();
  });
  return ambiguous ? "ambiguous" : "explained";
}

}  // namespace trueline
