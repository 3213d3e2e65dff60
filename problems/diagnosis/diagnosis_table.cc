// The table of trueline-diagnose for standard output, and its words.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/diagnosis/rules.h"
#include "problems/diagnosis/witness.h"
#include "problems/diagnosis/write_diagnosis.h"

namespace trueline {
namespace {

// Estimates or detectable sizes; none for a parameter that the flight does not show.
std::string Sizes(const CandidateReport& c, const Eigen::VectorXd& sizes) {
  std::vector<std::string> texts;
  for (int i = 0; i < sizes.size(); ++i) {
    const EffectParameterInfo& parameter = c.parameters()[i];
    texts.push_back(parameter.name + (Shown(parameter, std::abs(sizes[i]))
                                          ? fmt::format(" {:.2g}", sizes[i])
                                          : " not shown"));
  }
  return fmt::format("{}{}", fmt::join(texts, ", "), AfterNumber(c.parameters().front().unit));
}

// `what` was measured on how many of `held_out`.
std::string GainText(const Gain& gain, const std::string& what, const std::string& held_out) {
  if (gain.arcs == 0) return "";
  const std::string means =
      fmt::format("    {} on {} held-out {}: {:.3g} {} before, {:.3g} {} after", what, gain.arcs,
                  held_out, gain.before, gain.unit, gain.after, gain.unit);
  if (!std::isfinite(gain.low)) return means + " (too few for an interval)\n";
  return means + fmt::format(" (95 % interval of the gain: {:.2g} to {:.2g} {})\n", gain.low,
                             gain.high, gain.unit);
}

std::string GainTexts(const Gains& gains) {
  const auto& [arcs, replays] = gains;
  const bool final_point = arcs.metric == "final_point_error";
  return GainText(arcs, final_point ? "final-point error" : "open-loop error over 0.5 s",
                  final_point ? "arcs" : "seconds") +
         GainText(replays, "open-loop error over 1 s", "replays");
}

std::string RepeatsText(const std::vector<Repeat>& repeats) {
  std::string text;
  for (const Repeat& repeat : repeats) {
    text += fmt::format("    on {}: {}", repeat.log, repeat.outcome);
    for (int i = 0; i < repeat.value.size(); ++i) {
      text += fmt::format(", {:.3g} +- {:.2g}", repeat.value[i], repeat.sigma[i]);
    }
    text += "\n";
  }
  return text;
}

// A cause that is set aside takes two lines: its size, and why.
std::string CauseText(const Cause& cause, double needed) {
  std::string text = fmt::format("  {}: {}\n", cause.candidate.Label(),
                                 SizesText(*cause.candidate.info, cause.value, cause.sigma));
  if (!cause.because.empty()) return text + fmt::format("    not named: {}\n", cause.because);
  text += fmt::format("    {}\n", cause.candidate.info->physics);
  text += fmt::format("    evidence {:.1f} ({:.1f} is needed): {}\n", cause.evidence.Total(),
                      needed, PartsText(cause.evidence));
  if (!cause.witness.text.empty()) {
    text += fmt::format("    witness {}: {}\n", cause.witness.says, cause.witness.text);
  }
  text += RepeatsText(cause.repeats);
  text += GainTexts(cause.gains);
  text += GainText(cause.agreement, "distance from " + cause.agreement.metric, "seconds");
  if (!cause.confused_with.empty()) {
    text += fmt::format("    fits equally well: {}; to separate them: {}\n",
                        fmt::join(cause.confused_with, ", "), cause.candidate.info->separate_by);
  }
  return text;
}

std::string TermText(const DescribedTerm& term) {
  std::string text =
      fmt::format("  {} (p {:.1g}){}\n", term.term.Text(term.size.value, term.size.sigma), term.p,
                  term.in_model ? ", in model.yaml" : "");
  return text + RepeatsText(term.repeats);
}

}  // namespace

std::string VerdictMeaning(const Diagnosis& diagnosis) {
  if (diagnosis.verdict == "clean") {
    return "nothing of the catalogue shows in this flight; smaller effects may be there unseen";
  }
  if (diagnosis.verdict == "explained") return "the causes leave no significant misfit";
  if (diagnosis.verdict == "ambiguous") {
    return "the causes leave no significant misfit, and others would explain it as well";
  }
  return diagnosis.causes.empty() ? "a significant misfit remains, and no cause of it is proven"
                                  : "beside the causes a significant misfit remains";
}

std::vector<std::string> NextSteps(const Diagnosis& diagnosis) {
  std::vector<std::string> steps;
  if (!diagnosis.log_faults.empty()) {
    steps.push_back(
        fmt::format("put the log right first: trueline inspect --log={} says how, and writes "
                    "corrected_map.yaml where a map can do it",
                    diagnosis.log));
  }
  if (!diagnosis.in_model.empty()) {
    steps.push_back(fmt::format(
        "use what was found: trueline calibrate --log={}{} --model={}/model.yaml --out=OUT",
        diagnosis.log, diagnosis.flags, diagnosis.folder));
  }
  bool unconfirmed = diagnosis.causes.empty() && diagnosis.verdict == "unexplained";
  for (const Cause& cause : diagnosis.causes) {
    unconfirmed = unconfirmed || cause.repeats.empty();
    if (cause.confused_with.empty()) continue;
    steps.push_back(fmt::format("to tell {} from {}: {}", cause.candidate.Label(),
                                fmt::join(cause.confused_with, ", "),
                                cause.candidate.info->separate_by));
  }
  if (unconfirmed) {
    steps.push_back(fmt::format(
        "confirm it: add a further flight of this vehicle, --log={},FURTHER", diagnosis.log));
  }
  if (diagnosis.verdict == "unexplained") {
    steps.emplace_back("see what the misfit is correlated with: report.html, section Misfit");
  }
  if (diagnosis.verdict == "clean") {
    steps.push_back(fmt::format(
        "see how large each effect must be to be found: --verbose, or detectable_size in "
        "{}/diagnosis.yaml",
        diagnosis.folder));
  }
  return steps;
}

std::string CandidateTable(const Diagnosis& diagnosis) {
  std::string table = fmt::format("{:<26}{:>8}{:>10}  {:<48}{}\n", "candidate", "score z", "p",
                                  "estimate", "detectable from");
  for (const CandidateReport& c : diagnosis.candidates) {
    table += fmt::format("{:<26}{:>8.1f}{:>10.2g}  {:<48}{}\n", c.label, c.z, c.p,
                         Sizes(c, c.value), Sizes(c, c.detectable));
  }
  return table + "\n";
}

std::string DiagnosisTable(const Diagnosis& diagnosis) {
  std::string table = diagnosis.fixes.empty() ? "" : diagnosis.fixes + "\n\n";
  table += fmt::format("verdict: {}: {}\n", diagnosis.verdict, VerdictMeaning(diagnosis));
  for (const std::string& fault : diagnosis.log_faults) {
    table += "  the log has a fault, which may cause all that follows: " + fault + "\n";
  }
  if (!diagnosis.not_shown.empty()) {
    table += fmt::format("  this flight can't show: {}\n", fmt::join(diagnosis.not_shown, ", "));
  }
  const double needed = diagnosis.evidence_needed;
  for (const Cause& cause : diagnosis.causes) table += CauseText(cause, needed);
  if (diagnosis.causes.size() > 1) table += "  all together\n" + GainTexts(diagnosis.gains);
  for (const DescribedTerm& term : diagnosis.open.described) table += TermText(term);
  for (const std::string& what : diagnosis.unexplained_by) {
    table += "  the misfit is correlated with " + what + "\n";
  }
  if (!diagnosis.model_lacks.empty()) table += "model.yaml lacks " + diagnosis.model_lacks + "\n";
  if (!diagnosis.set_aside.empty()) table += "set aside:\n";
  for (const Cause& cause : diagnosis.set_aside) table += CauseText(cause, needed);
  table += fmt::format("{}: {:.2f} sigma before, {:.2f} after, each in its own learned noise\n",
                       diagnosis.residual_of, diagnosis.before.rms, diagnosis.after.rms);
  return table + fmt::format("next:\n  {}\n", fmt::join(NextSteps(diagnosis), "\n  "));
}

}  // namespace trueline
