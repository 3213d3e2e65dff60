// trueline-design: flights that show chosen parameters as well as the limits allow.
#include "problems/observability/design.h"

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/progress.h"
#include "problems/common/result_folder.h"
#include "problems/result/render.h"

DEFINE_string(config, "", "YAML with vehicle, limits and the states to show, as in config/design/");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_uint64(
    seed, 0, "of the random starts; the same seed gives the same flight, if no time limit ends it");
DEFINE_int32(compare, -1, "random flights to compare with; -1 takes the configuration's");
DEFINE_int32(threads, 0, "0: all cores");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] = R"(Designs a flight that shows chosen parameters well.

  trueline design --config=config/design/sensor_position_bound.yaml --out=result
      20 s that show where the pose sensor sits, within the limits of Boehm et al. 2020, by the
      Cramer-Rao bound of the batch calibration that will read the flight (the default criterion):
      trajectory.yaml (polynomials), trajectory.csv (states and rotor speeds at 100 Hz),
      score.yaml, report.html; takes a minute or two
  trueline design --config=config/design/sensor_position.yaml --out=result
      the same by the smallest singular value of their Gramian, as published: shows less
  trueline design --config=config/design/inertia.yaml --out=result --compare=1000
      also scores 1,000 random flights and Lissajous figures within the same limits
  trueline observe --config=... --out=...  with  trajectory: {kind: file, file: trajectory.yaml}
      what the designed flight shows of everything else

Exit codes: 0 done, 2 bad input or usage, 1 a defect.)";

int Run() {
  if (FLAGS_config.empty() || FLAGS_out.empty()) {
    throw trueline::InputError("--config and --out are needed; see trueline design --help");
  }
  trueline::DesignTask task = trueline::ReadDesignTask(trueline::YamlMap::FromFile(FLAGS_config),
                                                       FLAGS_seed, FLAGS_threads);
  if (FLAGS_compare >= 0) task.compare = FLAGS_compare;
  trueline::ResultFolder out(FLAGS_out, "trueline-design");
  const auto progress = [](const std::string& what) { trueline::Announce(what, FLAGS_quiet); };
  const trueline::DesignOutcome outcome = trueline::RunDesignTask(task, progress);
  trueline::WriteDesign(task, outcome, out.path());
  trueline::Publish("design", FLAGS_report, FLAGS_quiet, trueline::DesignTable(task, outcome),
                    &out);
  return trueline::kExitDone;
}

}  // namespace

TRUELINE_VERB("design", kUsage, Run);
