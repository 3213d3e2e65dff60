// _trueline: what the Python package `trueline` is made of. The verbs are those of the command
// line, with their flags; beside them go logs as arrays, flights of a model, and their errors.
#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <mutex>

#include "apps/python/log_arrays.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/log/log_yaml.h"
#include "problems/log/native_log.h"
#include "problems/prediction/multi_step_score.h"
#include "problems/simulators/vehicle_replay.h"

namespace py = pybind11;

namespace trueline {
namespace {

Verb& FindVerb(const std::string& name) {
  for (Verb* verb : AllVerbs()) {
    if (verb->name() == name) return *verb;
  }
  throw InputError("'" + name + "' is no verb");
}

void SetFlags(const py::dict& values, Verb* verb) {
  for (const Flag& flag : verb->flags()) verb->Find(flag.name).value = flag.initial;
  for (const auto& [name, value] : values) {
    Flag& flag = verb->Find(name.cast<std::string>());
    std::visit([&, &given = value]<class T>(T& held) { held = given.cast<T>(); }, flag.value);
  }
}

// The exit code and the warnings of a run with these flags. One verb runs at a time, since flags
// are global; other threads of Python go on.
std::pair<int, std::vector<std::string>> Run(const std::string& name, const py::dict& values) {
  static std::mutex one_at_a_time;
  Verb& verb = FindVerb(name);
  std::unique_lock lock(one_at_a_time, std::defer_lock);
  {
    const py::gil_scoped_release others;
    lock.lock();
  }
  SetFlags(values, &verb);
  std::vector<std::string> warnings;
  std::mutex writing;
  WarningSink() = [&](const std::string& text) {
    const std::scoped_lock alone(writing);
    warnings.push_back(text);
  };
  struct Reset {
    ~Reset() { WarningSink() = nullptr; }
  } reset;
  const py::gil_scoped_release others;
  const int code = verb.Run();
  std::fflush(stdout);
  return {code, warnings};
}

py::list FlagsOf(const std::string& verb) {
  py::list flags;
  for (const Flag& flag : FindVerb(verb).flags()) {
    flags.append(py::make_tuple(flag.name, flag.initial, flag.help));
  }
  return flags;
}

py::dict ReadLog(const std::string& folder) {
  const FlightLog log = ReadCommandLog(folder);
  py::dict streams;
  for (const auto& [name, array] : ArraysOf(log)) {
    streams[py::str(name)] = py::make_tuple(array.columns, array.rows);
  }
  return streams;
}

// `folder` holds a log.yaml, which the streams join. Reads the log again, which checks it.
void WriteStreamsOf(const std::string& folder,
                    const std::map<std::string, py::array_t<double>>& arrays) {
  FlightLog log;
  ReadLogYaml(std::filesystem::path(folder) / "log.yaml", &log);
  SetStreams(arrays, &log);
  WriteStreams(log, folder);
  ReadCommandLog(folder);
}

// Rows: t, then the moving state.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 1 + RotorAeroModel::kMoving, Eigen::RowMajor>;
using Table = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Rows RowsOf(const Replay& flight) {
  Rows rows(static_cast<int>(flight.t.size()), Rows::ColsAtCompileTime);
  for (int i = 0; i < rows.rows(); ++i) {
    rows(i, 0) = flight.t[static_cast<std::size_t>(i)];
    rows.row(i).tail<RotorAeroModel::kMoving>() = flight.states[static_cast<std::size_t>(i)];
  }
  return rows;
}

// The measured states of a log, and the times and speeds of its rotors.
std::tuple<Rows, std::vector<double>, std::vector<std::vector<double>>> Measured(
    const std::string& folder, const std::string& model) {
  const FlightLog log = ReadNativeLog(folder);
  if (log.rotors.empty()) {
    throw ErrorAt(folder, 0, "has no rotor speeds (rotors.csv); give states and speeds as arrays");
  }
  const RotorConstants constants =
      model.empty() ? RotorConstants::Zero() : ReadFlying(model).constants;
  const int rotors = static_cast<int>(log.rotors.front().values.size());
  const MeasuredFlight flight = MeasuredStates(log, rotors, constants);
  return {RowsOf(flight.states), flight.speed_times, flight.speeds};
}

// Speeds (a row for each of `times`) between which the flight goes linearly; held outside.
SpeedsAt Between(const std::vector<double>& times, const Table& speeds) {
  return [&times, &speeds](double t) {
    const auto after = std::upper_bound(times.begin(), times.end(), t) - times.begin();
    const auto b = std::min<std::ptrdiff_t>(after, speeds.rows() - 1);
    const auto a = std::max<std::ptrdiff_t>(after - 1, 0);
    const double gap = times[static_cast<std::size_t>(b)] - times[static_cast<std::size_t>(a)];
    const double share = gap > 0.0 ? (t - times[static_cast<std::size_t>(a)]) / gap : 0.0;
    const Eigen::RowVectorXd at = speeds.row(a) + share * (speeds.row(b) - speeds.row(a));
    return std::vector<double>(at.begin(), at.end());
  };
}

void CheckAscending(const char* name, const std::vector<double>& times) {
  if (!times.empty() && std::ranges::adjacent_find(times, std::greater_equal()) == times.end()) {
    return;
  }
  throw InputError(fmt::format("{}: times must ascend", name));
}

Rows ReplayOf(const std::string& model, const MovingState& start, const std::vector<double>& times,
              const std::vector<double>& speed_times, const Table& speeds, bool commands) {
  FlyingVehicle vehicle = ReadFlying(model);
  CheckAscending("t", times);
  CheckAscending("speeds", speed_times);
  const auto rotors = static_cast<Eigen::Index>(vehicle.model.num_rotors());
  if (speeds.rows() != static_cast<Eigen::Index>(speed_times.size()) || speeds.cols() != rotors) {
    throw InputError(
        fmt::format("speeds: a row for each of {} times and a column for each of {} "
                    "rotors are needed; found {} x {}",
                    speed_times.size(), rotors, speeds.rows(), speeds.cols()));
  }
  if (!commands) vehicle.tau = 0.0;
  const py::gil_scoped_release others;
  return RowsOf(Fly(vehicle, start, Between(speed_times, speeds), times));
}

// Errors of p, v, R and w by row of two tables of states (p, v, q, w in 13 columns).
Table Errors(const Table& predicted, const Table& measured) {
  Table errors(predicted.rows(), 4);
  for (int i = 0; i < predicted.rows(); ++i) {
    const auto of = StateErrors(measured.row(i).transpose(), predicted.row(i).transpose());
    for (int k = 0; k < 4; ++k) errors(i, k) = of[static_cast<std::size_t>(k)];
  }
  return errors;
}

}  // namespace
}  // namespace trueline

PYBIND11_MODULE(_trueline, module) {
  using namespace trueline;  // NOLINT(google-build-using-namespace): a main file
  static py::exception<InputError> input_error(module, "InputError", PyExc_ValueError);
  static py::exception<NoUsableResult> no_result(module, "NoUsableResult", input_error.ptr());
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const py::builtin_exception&) {
      throw;
    } catch (const py::error_already_set&) {
      throw;
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception&) {
      const Failure failure = CurrentFailure();
      PyObject* kind = failure.code == kExitBadInput   ? input_error.ptr()
                       : failure.code == kExitNoResult ? no_result.ptr()
                                                       : PyExc_RuntimeError;
      constexpr std::string_view kHead = "error: ";  // Python names the kind itself
      const bool has_head = failure.text.starts_with(kHead);
      PyErr_SetString(kind, failure.text.c_str() + (has_head ? kHead.size() : 0));
    }
  });
  std::vector<std::string> names;
  for (const Verb* verb : AllVerbs()) names.push_back(verb->name());
  module.attr("version") = Version();
  module.attr("verbs") = names;
  module.attr("streams") = StreamNames();
  module.def("usage", [](const std::string& verb) { return FindVerb(verb).usage(); });
  module.def("flags", &FlagsOf);
  module.def("find_shared", &FindShared);
  module.def("run", &Run);
  module.def("read_log", &ReadLog);
  module.def("write_streams", &WriteStreamsOf);
  module.def("measured", &Measured);
  module.def("replay", &ReplayOf);
  module.def("errors", &Errors);
}
