// trueline-observe: which states and parameters are observable in a kind of motion or on one
// flight.
#include <fmt/format.h>
#include <gflags/gflags.h>

#include <optional>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/progress.h"
#include "problems/inspection/first_look.h"
#include "problems/observability/observe_config.h"
#include "problems/observability/write_observability.h"
#include "problems/result/render.h"

DEFINE_string(config, "", "YAML with a system and cases, as in config/observe/");
DEFINE_string(log, "", "a flight: a native log directory");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] =
    R"(Tells which states and parameters a flight shows, and what to fly to see more.

  trueline-observe --config=config/observe/table1.yaml --out=result
      Table I of Boehm et al. 2020, exactly, with every null space named
  trueline-observe --config=config/observe/flights.yaml --out=result
      predicted sigmas of mass, inertia, levers and biases for given trajectories
  trueline-observe --log=flight --out=result
      what a recorded flight shows: of the rotor-driven model where it has rotor speeds,
      of the model of Li et al. 2019 where it has attitude and fixes
  trueline-observe --log=flight --config=vehicle.yaml --out=result
      the same with inertia and levers of the vehicle (keys 'vehicle' and 'sensors')

Exit codes: 0 done, 2 bad input or usage, 1 a defect.)";

int Run() {
  if (FLAGS_out.empty() || (FLAGS_config.empty() && FLAGS_log.empty())) {
    throw trueline::InputError("--out and one of --config, --log are needed; see --help");
  }
  const auto progress = [](const std::string& name) { trueline::Announce(name, FLAGS_quiet); };
  std::optional<trueline::YamlMap> config;
  if (!FLAGS_config.empty()) config = trueline::YamlMap::FromFile(FLAGS_config);
  const std::vector<trueline::CaseResult> cases =
      FLAGS_log.empty()
          ? trueline::RunObserveConfig(*config, progress)
          : trueline::RunObserveLog(trueline::ReadAndLook(FLAGS_log), config, progress);
  for (const auto& result : cases) {
    for (const std::string& warning : result.warnings) trueline::Warn(warning, FLAGS_quiet);
  }
  trueline::WriteFileAtomically(
      FLAGS_out + "/observability.yaml",
      trueline::ObservabilityYaml(cases, FLAGS_log.empty() ? FLAGS_config : FLAGS_log));
  if (FLAGS_report) {
    const std::string warning =
        trueline::RenderReport("observe", {"--result=" + FLAGS_out}, FLAGS_out);
    if (!warning.empty()) trueline::Warn(warning, FLAGS_quiet);
  }
  if (!FLAGS_quiet) fmt::print("{}", trueline::ObservabilityTable(cases));
  return trueline::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  return trueline::RunApp("trueline-observe", kUsage, &argc, &argv, Run);
}
