// trueline-audit: what a simulator gets wrong of a vehicle.
#include "problems/simulators/audit.h"

#include <fmt/format.h>

#include "apps/main/flags.h"
#include "problems/against/comparison.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/result_folder.h"
#include "problems/inspection/settle_proposal.h"
#include "problems/result/render.h"

DEFINE_string(simulator, "",
              "the simulator's parameter file; further ones of the vehicle after commas");
DEFINE_string(simulator_log, "", "in place of the file: a log flown in the simulator");
DEFINE_string(vehicle, "", "of a file that holds several vehicles, the one that flew");
DEFINE_string(log, "", "flights of the vehicle, separated by commas; empty: the file alone");
DEFINE_string(map, "", "the YAML column map of foreign logs; empty: one that ships");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_string(fail_on, "", "contradicted: end with exit code 4 where something is");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] = R"(Says what a simulator's parameter file gets wrong of a vehicle.

  trueline audit --simulator=crazyflie.sdf --out=audit
      what the file can be told from itself: inertia that no body has, hover beyond the motors'
      range, ratios that no vehicle has, rotor order against spins, another unit
  trueline audit --simulator=x500.sdf,x500_base.sdf --out=audit
      files of one vehicle: one is read beside the other, and what they state twice must agree
  trueline audit --simulator=crazyflie.sdf --log=flight --out=audit
      calibrates the vehicle on the flight and compares: which numbers the flight contradicts, by
      how much and at what cost in prediction; audit/crazyflie.sdf is the corrected file. The mass
      in log.yaml is taken as weighed
  trueline audit --simulator_log=in_simulator --log=flight --out=audit
      the same by logs alone, for any simulator
  trueline audit --simulator=crazyflie.sdf --out=audit --fail_on=contradicted
      for continuous integration: exit code 4 if anything is contradicted

Exit codes: 0 done, 2 bad input or usage, 3 the flight can't be used, 4 contradicted (--fail_on), 1 a
defect.)";

std::vector<trueline::FlightLog> Flights(const std::string& list) {
  std::vector<trueline::FlightLog> logs;
  for (const trueline::NamedFlight& flight : trueline::FlightsOf(list)) {
    logs.push_back(trueline::ReadAnyLog(flight.path, FLAGS_map));
    trueline::WarnAll(logs.back().warnings, FLAGS_quiet);
  }
  return logs;
}

// The files' vehicles, or the one that --vehicle names.
std::vector<trueline::VehicleFile> Files() {
  std::vector<trueline::VehicleFile> files =
      trueline::ReadVehicleFiles(trueline::SplitPaths(FLAGS_simulator));
  std::string names;
  for (const trueline::VehicleFile& file : files) names += " " + file.vehicle.name;
  if (!FLAGS_vehicle.empty()) {
    std::erase_if(files, [](const auto& file) { return file.vehicle.name != FLAGS_vehicle; });
  }
  if (files.empty()) {
    const bool named = names.find_first_not_of(' ') != std::string::npos;
    throw trueline::InputError(
        "--vehicle=" + FLAGS_vehicle +
        (named ? ": is none of" + names : ": the file names no vehicle; leave --vehicle out"));
  }
  if (!FLAGS_log.empty() && files.front().target->tables && files.size() > 1) {
    trueline::Warn("the file holds several vehicles (" + names + " ); " +
                       files.front().vehicle.name + " is compared; --vehicle names another",
                   FLAGS_quiet);
  }
  return files;
}

trueline::Audit AuditWith(const std::vector<trueline::FlightLog>& logs) {
  if (!FLAGS_simulator_log.empty()) {
    return trueline::AuditLogs(Flights(FLAGS_simulator_log).front(), logs);
  }
  const std::vector<trueline::VehicleFile> files = Files();
  return logs.empty() ? trueline::AuditFiles(files) : trueline::AuditByFlights(files, logs);
}

int Run() {
  if (FLAGS_out.empty() || FLAGS_simulator.empty() == FLAGS_simulator_log.empty()) {
    throw trueline::InputError(
        "--out and either --simulator or --simulator_log are needed; see trueline audit --help");
  }
  if (!FLAGS_simulator_log.empty() && FLAGS_log.empty()) {
    throw trueline::InputError("--simulator_log needs --log, a flight of the vehicle");
  }
  const trueline::FailOn refused(FLAGS_fail_on, {"contradicted"});
  trueline::ResultFolder out(FLAGS_out, "trueline-audit");
  const std::vector<trueline::FlightLog> logs =
      FLAGS_log.empty() ? std::vector<trueline::FlightLog>() : Flights(FLAGS_log);
  const trueline::Audit audit = AuditWith(logs);
  trueline::WarnAll(audit.warnings, FLAGS_quiet);
  trueline::WriteAudit(audit, out.path());
  trueline::Publish("audit", FLAGS_report, FLAGS_quiet, trueline::AuditTable(audit), &out);
  return refused.ExitFor(audit.contradicted.empty() ? "" : "contradicted");
}

}  // namespace

TRUELINE_VERB("audit", kUsage, Run);
