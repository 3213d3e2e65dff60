// trueline-observe: which states and parameters are observable in a kind of motion or on one
// flight.
#include "problems/observability/observe.h"

#include <fmt/format.h>

#include <optional>

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/progress.h"
#include "problems/common/result_folder.h"
#include "problems/inspection/first_look.h"
#include "problems/observability/gramian_ranking.h"
#include "problems/result/render.h"

DEFINE_string(config, "", "YAML with a system and cases, as in config/observe/");
DEFINE_string(log, "", "a flight: a native log directory; several, by commas, with --score");
DEFINE_string(score, "", "e2log: rank flights by that Gramian (Boehm et al. 2020, eq. 2-5)");
DEFINE_string(trajectory, "", "with --score: trajectory.yaml files of trueline design, by commas");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(verbose, false, "print all of each case, also where that is longer than a screen");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] =
    R"(Tells which states and parameters a flight shows, and what to fly to see more.

  trueline observe --config=config/observe/table1.yaml --out=result
      Table I of Boehm et al. 2020, exactly, with every null space named
  trueline observe --config=config/observe/flights.yaml --out=result
      predicted sigmas of mass, inertia, levers and biases for given trajectories
  trueline observe --log=flight --out=result
      what a recorded flight shows: of the rotor-driven model where it has rotor speeds,
      of the model of Li et al. 2019 where it has attitude or no rotor speeds, and positions
  trueline observe --log=flight --config=vehicle.yaml --out=result
      the same with inertia and levers of the vehicle (keys 'vehicle' and 'sensors')
  trueline observe --score=e2log --config=config/observe/e2log.yaml \
      --trajectory=a/trajectory.yaml,b/trajectory.yaml --log=flight,flight2 --out=result
      ranks trajectories and recorded flights by sigma_min of the E2LOG Gramian, the largest
      first, in ranking.yaml; the configuration's own 'cases' are ranked with them.
      config/observe/e2log_published.yaml scores as Boehm et al. 2020 do

Exit codes: 0 done, 2 bad input or usage, 3 no flight shows what is asked for (--score), 1 a
defect.)";

int Rank(const std::optional<trueline::YamlMap>& config, trueline::ResultFolder* out) {
  const auto progress = [](const std::string& name) { trueline::Announce(name, FLAGS_quiet); };
  trueline::RankingInputs inputs{config, {}, {}};
  for (const auto& file : trueline::SplitPaths(FLAGS_trajectory))
    inputs.trajectories.push_back(file);
  for (const auto& log : trueline::SplitPaths(FLAGS_log)) inputs.logs.push_back(log);
  const trueline::Ranking ranking = trueline::RankByE2log(inputs, progress);
  trueline::WarnAll(ranking.warnings, FLAGS_quiet);
  trueline::WriteFileAtomically(
      out->path() / "ranking.yaml",
      trueline::RankingYaml(ranking,
                            fmt::format("{} {} {}", FLAGS_config, FLAGS_trajectory, FLAGS_log)));
  out->Commit(FLAGS_quiet);
  if (!FLAGS_quiet) fmt::print("{}", trueline::RankingTable(ranking));
  const bool shown = ranking.flights.front().scores.sigma_min > 0.0;
  return shown ? trueline::kExitDone : trueline::kExitNoResult;
}

int Run() {
  if (!FLAGS_score.empty() && FLAGS_score != "e2log") {
    throw trueline::InputError("--score=" + FLAGS_score + " is not known; use e2log");
  }
  if (FLAGS_score.empty() && !FLAGS_trajectory.empty()) {
    throw trueline::InputError("--trajectory needs --score=e2log");
  }
  if (FLAGS_out.empty() || (FLAGS_config.empty() && FLAGS_log.empty())) {
    throw trueline::InputError("--out and one of --config, --log are needed; see --help");
  }
  trueline::ResultFolder out(FLAGS_out, "trueline-observe");
  const auto progress = [](const std::string& name) { trueline::Announce(name, FLAGS_quiet); };
  std::optional<trueline::YamlMap> config;
  if (!FLAGS_config.empty()) config = trueline::YamlMap::FromFile(FLAGS_config);
  if (!FLAGS_score.empty()) return Rank(config, &out);
  std::vector<trueline::CaseResult> cases;
  if (FLAGS_log.empty()) {
    cases = trueline::RunObserveConfig(*config, progress);
  } else {
    const trueline::FlightLog log = trueline::ReadAndLook(FLAGS_log);
    trueline::WarnAll(log.warnings, FLAGS_quiet);
    cases = trueline::RunObserveLog(log, config, progress);
  }
  for (const auto& result : cases) trueline::WarnAll(result.warnings, FLAGS_quiet);
  trueline::WriteFileAtomically(
      out.path() / "observability.yaml",
      trueline::ObservabilityYaml(cases, FLAGS_log.empty() ? FLAGS_config : FLAGS_log));
  trueline::Publish("observe", FLAGS_report, FLAGS_quiet,
                    trueline::OneScreen(trueline::ObservabilityTable(cases),
                                        trueline::ObservabilityBrief(cases), FLAGS_verbose),
                    &out);
  return trueline::kExitDone;
}

}  // namespace

TRUELINE_VERB("observe", kUsage, Run);
